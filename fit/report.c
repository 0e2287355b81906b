/* The page as a whole: what is asked of a report, the order of its sections, and the files. */
#include "fit/report.h"

#include "fit/report_page.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bounds of a page that people, and browsers, can still read. */
enum {
    PICTURE_LIMIT = 64,
    PROFILE_LIMIT = 64,
    ROW_LIMIT = 1024, /* of values, searches, notes and parameters each */
    PAGE_PIXEL_LIMIT = 1 << 22,
    PATH_SIZE = 4096,
    NAME_SIZE = 240, /* of a file; most systems allow 255 bytes */
};

/* ---- what is asked of a report ------------------------------------------------------------------------
 */

static bool counts_check(const struct fit_report *report, dipole_status *status)
{
    const struct {
        const char *name;
        size_t count, limit;
    } rows[] = {
        { "values", report->value_count, ROW_LIMIT },
        { "pictures", report->picture_count, PICTURE_LIMIT },
        { "profiles", report->profile_count, PROFILE_LIMIT },
        { "searches", report->search_count, ROW_LIMIT },
        { "notes", report->note_count, ROW_LIMIT },
        { "correlated parameters", report->correlation_count, ROW_LIMIT },
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].count > rows[i].limit)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "a report of %zu %s, expected at most %zu",
                               rows[i].count, rows[i].name, rows[i].limit);
    return true;
}

static bool picture_check(const struct fit_report_picture *picture, dipole_status *status)
{
    const dipole_place place = { .source = picture->name };
    const struct io_image *const image = picture->image, *const model = picture->model;
    if (image->channel_count < 3 || model->channel_count < 3)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "has %d channels and its model %d, expected 3 or 4", image->channel_count,
                           model->channel_count);
    if (image->width_px != model->width_px || image->height_px != model->height_px)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "has %d x %d pixels and its model %d x %d, expected the same", image->width_px,
                           image->height_px, model->width_px, model->height_px);
    const size_t count = (size_t)image->width_px * (size_t)image->height_px;
    for (size_t i = 0; i < count; i++)
        if (picture->uses[i] >= FIT_USE_COUNT)
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "use of pixel %zu is %d, expected 0 to %d",
                               i, picture->uses[i], FIT_USE_COUNT - 1);
    return true;
}

static bool report_check(const struct fit_report *report, dipole_status *status)
{
    if (!counts_check(report, status))
        return false;
    for (size_t i = 0; i < report->picture_count; i++)
        if (!picture_check(&report->pictures[i], status))
            return false;
    return true;
}

/* ---- the page -----------------------------------------------------------------------------------------
 */

static void add_fact(struct plot_text *page, const char *name, const char *value, const char *unit)
{
    plot_text_print(page, "<div><dt>%s</dt><dd>%s%s</dd></div>\n", name, value, unit);
}

static void add_head(struct plot_text *page, const struct fit_report *report)
{
    char rms[FIT_NUMBER_SIZE], seconds[FIT_NUMBER_SIZE];
    fit_number_format(100 * report->rms_residual, 3, rms);
    fit_number_format(report->seconds, 3, seconds);
    fit_page_add(page, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n");
    plot_text_print(page, "<title>%s</title>\n<style>\n", report->title);
    fit_page_add(page, fit_report_style);
    plot_text_print(page, "</style>\n</head>\n<body>\n<h1>%s</h1>\n", report->title);
    fit_page_add(page, report->has_converged
                           ? "<p class=\"state good\">✓ Converged</p>\n"
                           : "<p class=\"state bad\">✗ Not converged: the search stopped on the way, and "
                             "neither values nor intervals are to be relied on</p>\n");
    plot_text_print(page, "<p class=\"verdict\">%s</p>\n<dl>\n", report->verdict);
    add_fact(page, "model", report->model, "");
    add_fact(page, "rms residual", rms, " %");
    add_fact(page, "time", seconds, " s");
    fit_page_add(page, "</dl>\n");
}

static void add_notes(struct plot_text *page, const struct fit_report *report)
{
    if (report->note_count == 0)
        return;
    fit_page_add(page, "<h2>Notes</h2>\n<ul>\n");
    for (size_t i = 0; i < report->note_count; i++)
        plot_text_print(page, "<li>%s</li>\n", report->notes[i]);
    fit_page_add(page, "</ul>\n");
}

static bool add_pictures(struct plot_text *page, const struct fit_report *report, dipole_status *status)
{
    if (report->picture_count == 0)
        return true;
    fit_page_add(page, "<h2>Pictures</h2>\n<p class=\"small\">A click on a picture shows it at full size, "
                       "another puts it back.</p>\n");
    for (size_t i = 0; i < report->picture_count; i++)
        if (!fit_page_add_picture(page, &report->pictures[i], PAGE_PIXEL_LIMIT / report->picture_count,
                                  status))
            return false;
    return true;
}

static bool add_profiles(struct plot_text *page, const struct fit_report *report, dipole_status *status)
{
    if (report->profile_count == 0)
        return true;
    fit_page_add(page, "<h2>Profiles</h2>\n<p class=\"small\">Light that leaves at a distance r from "
                       "where it entered.</p>\n<div class=\"plots\">\n");
    for (size_t i = 0; i < report->profile_count; i++)
        if (!fit_page_add_profile(page, &report->profiles[i], status))
            return false;
    fit_page_add(page, "</div>\n");
    return true;
}

static bool page_compose(const struct fit_report *report, struct plot_text *page, dipole_status *status)
{
    add_head(page, report);
    fit_page_add_values(page, report);
    add_notes(page, report);
    if (!add_pictures(page, report, status) || !add_profiles(page, report, status) ||
        !fit_page_add_searches(page, report, status))
        return false;
    fit_page_add_correlations(page, report);
    plot_text_print(page, "<hr/>\n<p class=\"small\">Made by fit, libdipole %s.</p>\n</body>\n</html>\n",
                    dipole_version());
    return !page->has_failed ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the page of a report");
}

/* ---- files --------------------------------------------------------------------------------------------
 */

typedef char file_name[NAME_SIZE];

static bool is_taken(file_name *names, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(names[i], name) == 0)
            return true;
    return false;
}

/* Call pictures by files that lie in the folder, each by its own: names may hold what a file's may not. */
static void mask_names_make(const struct fit_report *report, file_name *names)
{
    for (size_t i = 0; i < report->picture_count; i++) {
        char base[NAME_SIZE - 32]; /* room for what follows it */
        snprintf(base, sizeof base, "%s", report->pictures[i].name);
        for (char *c = base; *c; c++)
            if (*c == '/' || (unsigned char)*c < 0x20 || *c == 0x7f)
                *c = '_';
        snprintf(names[i], sizeof names[i], "%s.mask.png", base);
        for (int number = 2; is_taken(names, i, names[i]); number++)
            snprintf(names[i], sizeof names[i], "%s-%d.mask.png", base, number);
    }
}

static bool path_make(const char *folder, const char *name, char path[PATH_SIZE], dipole_status *status)
{
    const dipole_place place = { .source = folder };
    const int length = snprintf(path, PATH_SIZE, "%s/%s", folder, name);
    return (length >= 0 && length < PATH_SIZE) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place, "has %zu bytes, expected at most %d",
                       strlen(folder), PATH_SIZE - NAME_SIZE);
}

static bool files_write(const char *folder, const struct fit_report *report, const struct plot_text *page,
                        dipole_status *status)
{
    char index_path[PATH_SIZE], path[PATH_SIZE];
    file_name names[PICTURE_LIMIT];
    if (!path_make(folder, "index.html", index_path, status) || !io_folder_make(folder, status) ||
        !io_file_check_writable(index_path, status))
        return false;
    mask_names_make(report, names);
    for (size_t i = 0; i < report->picture_count; i++) {
        const struct fit_report_picture *const picture = &report->pictures[i];
        if (!path_make(folder, names[i], path, status) ||
            !fit_mask_write(path, picture->uses, picture->image->width_px, picture->image->height_px,
                            status))
            return false;
    }
    return io_file_write(index_path, page->data, page->size, status);
}

bool fit_report_write(const char *folder, const struct fit_report *report, dipole_status *status)
{
    struct plot_text page = { 0 };
    const bool done = report_check(report, status) && page_compose(report, &page, status) &&
                      files_write(folder, report, &page, status);
    plot_text_destroy(&page);
    return done;
}
