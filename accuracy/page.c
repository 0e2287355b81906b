#include "accuracy/page_internal.h"

#include "io/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { THUMBNAIL_PX = 240 };

static const char style[] =
    "#tip{position:fixed;z-index:2;max-width:24rem;padding:.3rem .6rem;background:#222;color:#fff;"
    "font-size:.85rem;border-radius:.3rem;pointer-events:none}\n"
    "#tip[hidden]{display:none}\n"
    "svg [data-tip]{cursor:pointer}\n"
    "nav a{margin-right:1rem}\n";

/* Values beside the mouse at once, where <title> takes a second; without it <title> remains. */
static const char script[] =
    "<div id=\"tip\" role=\"tooltip\" hidden=\"hidden\"></div>\n<script>\n"
    "(function () {\n"
    "  var tip = document.getElementById('tip');\n"
    "  document.querySelectorAll('svg title').forEach(function (title) {\n"
    "    var mark = title.parentNode;\n"
    "    if (mark.tagName === 'svg') return;\n"
    "    mark.setAttribute('data-tip', title.textContent);\n"
    "    mark.removeChild(title);\n"
    "  });\n"
    "  document.addEventListener('mousemove', function (event) {\n"
    "    var mark = event.target.closest ? event.target.closest('[data-tip]') : null;\n"
    "    tip.hidden = !mark;\n"
    "    if (!mark) return;\n"
    "    tip.textContent = mark.getAttribute('data-tip');\n"
    "    var room = document.documentElement.clientWidth - tip.offsetWidth - 8;\n"
    "    tip.style.left = Math.max(0, Math.min(event.clientX + 12, room)) + 'px';\n"
    "    tip.style.top = event.clientY + 16 + 'px';\n"
    "  });\n"
    "})();\n"
    "</script>\n";

/* Full colour of a difference. */
#define DIFFERENCE_LIMIT 0.05

bool accuracy_page_add_plot(struct plot_text *page, char *svg, size_t size)
{
    if (svg) {
        fit_page_add(page, "<figure class=\"plot\">");
        plot_text_add(page, svg, size);
        fit_page_add(page, "</figure>\n");
    }
    free(svg);
    return svg != NULL;
}

/* ---- sections ----------------------------------------------------------------------------------- */

static void add_sentence(struct plot_text *page, const struct accuracy_sweep *sweep,
                         const struct accuracy_knob *knob)
{
    const struct accuracy_point *list[ACCURACY_POINT_LIMIT];
    const size_t count = accuracy_list_points(sweep, knob, list);
    const double factor = accuracy_halving_cost(sweep, knob);
    char number[FIT_NUMBER_SIZE];
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < count; i++) {
        least = fmin(least, list[i]->error.rmse);
        most = fmax(most, list[i]->error.rmse);
    }
    plot_text_print(page, "<p>%s ", knob->what);
    fit_number_format(factor, 2, number);
    if (isnan(factor))
        plot_text_print(
            page, "<b>It makes no difference worth its name here</b>: the error is %f to %f %%.</p>\n",
            100 * least, 100 * most);
    else
        plot_text_print(page, "<b>Halving its error costs %s times the time</b>, from %f to %f %%.</p>\n",
                        number, 100 * most, 100 * least);
}

static bool add_knobs(struct plot_text *page, const struct accuracy_sweep *sweep, dipole_status *status)
{
    const struct accuracy_point *list[ACCURACY_POINT_LIMIT];
    fit_page_add(page, "<h2 id=\"knobs\">Knob by knob</h2>\n<div class=\"plots\">\n");
    for (size_t k = 0; k < accuracy_knob_count(); k++) {
        char *svg;
        size_t size;
        if (accuracy_list_points(sweep, &accuracy_knobs[k], list) == 0)
            continue;
        plot_text_print(page, "<section id=\"%s\"><h3>%s</h3>\n", accuracy_knobs[k].name,
                        accuracy_knobs[k].title);
        add_sentence(page, sweep, &accuracy_knobs[k]);
        if (!accuracy_draw_knob_plot(sweep, &accuracy_knobs[k], &svg, &size, status) ||
            !accuracy_page_add_plot(page, svg, size))
            return false;
        fit_page_add(page, "</section>\n");
    }
    fit_page_add(page, "</div>\n");
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        if (point->refusal[0])
            plot_text_print(page, "<p class=\"small\">%s, %s: refused, %s.</p>\n", point->knob->title,
                            point->setting.label, point->refusal);
    }
    for (size_t i = 0; i < sweep->omission_count; i++)
        plot_text_print(page, "<p class=\"small\">%s: not measured, %s.</p>\n",
                        sweep->omissions[i].knob->title, sweep->omissions[i].reason);
    return true;
}

void accuracy_page_add_cell(struct plot_text *page, double value, int digits)
{
    char number[FIT_NUMBER_SIZE];
    fit_number_format(value, digits, number);
    plot_text_print(page, "<td class=\"number\">%s</td>", isnan(value) ? "\u2013" : number);
}

static void add_table(struct plot_text *page, const struct accuracy_sweep *sweep)
{
    fit_page_add(
        page,
        "<h2 id=\"table\">All points</h2>\n<div class=\"wide\"><table>\n<tr><th>knob</th><th>setting</th>"
        "<th class=\"number\">ms</th><th class=\"number\">quartiles</th><th class=\"number\">predicted</th>"
        "<th class=\"number\">RMSE %</th><th class=\"number\">predicted</th>"
        "<th class=\"number\">with edges</th><th class=\"number\">Weber 99 %</th><th "
        "class=\"number\">max %</th><th></th></tr>\n");
    for (size_t i = 0; i < sweep->point_count; i++) {
        const struct accuracy_point *const point = &sweep->points[i];
        char low[FIT_NUMBER_SIZE], high[FIT_NUMBER_SIZE];
        if (!point->is_drawn || point->time_count == 0)
            continue;
        fit_number_format(point->time_ms.low, 3, low);
        fit_number_format(point->time_ms.high, 3, high);
        plot_text_print(page, "<tr><td><a href=\"#%s\">%s</a></td><td>%s</td>", point->knob->name,
                        point->knob->title, point->setting.label);
        accuracy_page_add_cell(page, point->time_ms.median, 3);
        plot_text_print(page, "<td class=\"number\">%s \u2013 %s</td>", low, high);
        accuracy_page_add_cell(page, point->predicted_ms, 3);
        accuracy_page_add_cell(page, 100 * point->error.rmse, 2);
        accuracy_page_add_cell(page, 100 * point->error_predicted, 2);
        accuracy_page_add_cell(page, 100 * point->error.rmse_all, 2);
        accuracy_page_add_cell(page, 100 * point->error.weber_99, 2);
        accuracy_page_add_cell(page, 100 * point->error.max, 2);
        fit_page_add(page, accuracy_point_is_best(sweep, i, true) ? "<td><b>best</b></td></tr>\n"
                                                                  : "<td></td></tr>\n");
    }
    fit_page_add(page, "</table></div>\n");
}

/* Means over blocks of pixels, times scale. */
static bool shrink(const struct io_image *image, double scale, struct io_image **small_out,
                   dipole_status *status)
{
    const int block = (image->width_px + THUMBNAIL_PX - 1) / THUMBNAIL_PX;
    const int width_px = image->width_px / block,
              height_px = image->height_px / block > 0 ? image->height_px / block : 1;
    if (!io_image_create(width_px, height_px, 3, small_out, status))
        return false;
    for (int y = 0; y < height_px; y++) {
        for (int x = 0; x < width_px; x++) {
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int k = 0; k < block * block; k++) {
                    const int row = y * block + k / block, column = x * block + k % block;
                    sum +=
                        (double)image->pixels[(row * image->width_px + column) * image->channel_count + c];
                }
                (*small_out)->pixels[3 * (y * width_px + x) + c] =
                    (float)fmin(scale * sum / (block * block), 1);
            }
        }
    }
    return true;
}

static bool add_thumbnail(struct plot_text *page, const struct io_image *image, double scale,
                          const char *alt, dipole_status *status)
{
    struct io_image *small = NULL;
    const bool done = shrink(image, scale, &small, status) && fit_page_add_image(page, small, alt, status);
    io_image_destroy(small);
    return done;
}

static int compare_floats(const void *a, const void *b)
{
    return (*(const float *)a > *(const float *)b) - (*(const float *)a < *(const float *)b);
}

/* So that all but the brightest part in a hundred of what is covered is in range. */
static bool scale_of(const struct io_image *reference, double *scale_out, dipole_status *status)
{
    const size_t count = (size_t)reference->width_px * (size_t)reference->height_px;
    float *const values = calloc(count + 1, sizeof *values);
    size_t covered = 0;
    if (!values)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a picture's range");
    for (size_t i = 0; i < count; i++) {
        const float *const pixel = reference->pixels + 4 * i;
        if (pixel[3] > 0)
            values[covered++] = fmaxf(pixel[0], fmaxf(pixel[1], pixel[2]));
    }
    qsort(values, covered, sizeof *values, compare_floats);
    const float bright = covered > 0 ? values[(covered - 1) * 99 / 100] : 0;
    *scale_out = bright > 0 ? 1 / (double)bright : 1;
    free(values);
    return true;
}

static bool add_pictures(struct plot_text *page, const struct accuracy_sweep *sweep, dipole_status *status)
{
    const struct accuracy_point *list[ACCURACY_POINT_LIMIT];
    const size_t count = accuracy_list_points(sweep, NULL, list);
    double scale = 1;
    if (!scale_of(sweep->reference, &scale, status))
        return false;
    fit_page_add(page,
                 "<h2 id=\"pictures\">The best, fastest first</h2>\n<p>Each with its difference from the "
                 "reference: red is too bright, blue too dark, full colour at 5 % of the brightest.</p>\n"
                 "<div class=\"row\">\n<figure>");
    bool done = add_thumbnail(page, sweep->reference, scale, "reference", status);
    fit_page_add(page, "<figcaption><b>The reference</b></figcaption></figure>\n");
    for (size_t i = 0; done && i < count; i++) {
        struct io_image *difference = NULL;
        char time[FIT_NUMBER_SIZE], error[FIT_NUMBER_SIZE];
        if (!list[i]->picture)
            continue;
        fit_number_format(list[i]->time_ms.median, 3, time);
        fit_number_format(100 * list[i]->error.rmse, 2, error);
        fit_page_add(page, "<figure>");
        done = add_thumbnail(page, list[i]->picture, scale, list[i]->setting.label, status) &&
               accuracy_difference_create(sweep->reference, list[i]->picture, DIFFERENCE_LIMIT, &difference,
                                          status) &&
               add_thumbnail(page, difference, 1, "difference from the reference", status);
        plot_text_print(page, "<figcaption><b>%s</b>, %s: %s ms, RMSE %s %%</figcaption></figure>\n",
                        list[i]->knob->title, list[i]->setting.label, time, error);
        io_image_destroy(difference);
    }
    fit_page_add(page, "</div>\n");
    return done;
}

/* Measured, or told why not. */
static bool has_fits(const struct accuracy_fits *fits)
{
    return fits->point_count > 0 || fits->refusal[0];
}

static void add_fit_sentence(struct plot_text *page, const struct accuracy_fits *fits, size_t knob)
{
    char number[FIT_NUMBER_SIZE];
    double first = NAN, last = NAN;
    const double factor = accuracy_fits_halving_cost(fits, knob);
    for (size_t i = 0; i < fits->point_count; i++) {
        if (fits->points[i].knob != knob)
            continue;
        first = isnan(first) ? fits->points[i].half_width : first;
        last = fits->points[i].half_width;
    }
    fit_number_format(factor, 2, number);
    plot_text_print(page, "<p>%s ", accuracy_fit_knobs[knob].what);
    if (factor > 1)
        plot_text_print(page, "<b>Halving its error costs %s times the time</b>", number);
    else
        fit_page_add(page, "<b>Errors hardly follow it here</b>");
    plot_text_print(page,
                    "; from the first to the last the interval goes from \u00b1 %f to \u00b1 %f %%.</p>\n",
                    100 * first, 100 * last);
}

static bool add_fits(struct plot_text *page, const struct accuracy_sweep *sweep, dipole_status *status)
{
    const struct accuracy_fits *const fits = &sweep->fits;
    char *svg;
    size_t size;
    if (!has_fits(fits))
        return true;
    fit_page_add(page, "<h2 id=\"fit\">A fit</h2>\n");
    if (fits->refusal[0]) {
        plot_text_print(page, "<p class=\"small\">Nothing is fitted to this scene: %s.</p>\n",
                        fits->refusal);
        return true;
    }
    fit_page_add(page,
                 "<p>The scene\u2019s coefficients, found again from the picture of the reference. Full: "
                 "the largest error of those that the picture tells; hollow: half of the widest 95 % "
                 "interval.</p>\n");
    for (size_t k = 0; k < ACCURACY_FIT_KNOBS; k++)
        add_fit_sentence(page, fits, k);
    if (!accuracy_fits_plot_create(fits, &svg, &size, status) || !accuracy_page_add_plot(page, svg, size))
        return false;
    fit_page_add(page, "<div class=\"wide\"><table>\n<tr><th>knob</th><th class=\"number\">value</th><th "
                       "class=\"number\">s</th><th class=\"number\">told, of 6</th><th class=\"number\">"
                       "inside their interval</th><th class=\"number\">error %</th><th class=\"number\">"
                       "interval \u00b1 %</th></tr>\n");
    for (size_t i = 0; i < fits->point_count; i++) {
        const struct accuracy_fit_point *const point = &fits->points[i];
        plot_text_print(page, "<tr><td>%s</td><td class=\"number\">%d</td>",
                        accuracy_fit_knobs[point->knob].title, point->value);
        accuracy_page_add_cell(page, point->time_s.median, 3);
        plot_text_print(page, "<td class=\"number\">%d</td><td class=\"number\">%d</td>", point->told_count,
                        point->inside_count);
        accuracy_page_add_cell(page, 100 * point->error, 2);
        accuracy_page_add_cell(page, 100 * point->half_width, 2);
        fit_page_add(page, "</tr>\n");
    }
    fit_page_add(page, "</table></div>\n");
    return true;
}

static bool add_ladder(struct plot_text *page, const struct accuracy_sweep *sweep, dipole_status *status)
{
    char *svg;
    size_t size;
    if (sweep->ladder.case_count == 0)
        return true;
    fit_page_add(page,
                 "<h2 id=\"ladder\">The physics ladder</h2>\n<p>What a model's radius costs, and how far "
                 "its profile of the scene's materials is from Monte Carlo of many photons.</p>\n");
    return accuracy_ladder_plot_create(&sweep->ladder, &svg, &size, status) &&
           accuracy_page_add_plot(page, svg, size);
}

static const char *name_of(const char *path)
{
    const char *const slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool add_all(struct plot_text *page, const struct accuracy_sweep *sweep, const char *folder,
                    dipole_status *status)
{
    const struct render_machine *const machine = &sweep->subject->renderer->machine;
    char path[4096], *svg, error[FIT_NUMBER_SIZE];
    size_t size;
    snprintf(path, sizeof path, "%s/accuracy.svg", folder);
    fit_number_format(100 * sweep->reference_error, 2, error);
    plot_text_print(page, "<h1>What accuracy costs: %s</h1>\n", name_of(sweep->subject->scene->path));
    fit_page_add(page, "<nav><a href=\"#knobs\">Knob by knob</a><a href=\"#predictions\">Predictions</a><a "
                       "href=\"#pictures\">Pictures</a><a href=\"#plan\">What is not run</a>");
    if (has_fits(&sweep->fits))
        fit_page_add(page, "<a href=\"#fit\">A fit</a>");
    fit_page_add(page, "<a href=\"#table\">All points</a></nav>\n");
    plot_text_print(
        page,
        "<p class=\"small\">%d \u00d7 %d pixels; %s, %d cores; %s. Times: medians of %d pictures each, "
        "of two where one takes over 3 s, drawn in turns of two after one that does not count. Errors: of "
        "radiance against the converged surface "
        "integral, whose own is estimated at %s %%, over pixels whose rays and neighbours\u2019 all "
        "meet one piece of surface: edges are a matter of points to a pixel, of which the renderer has "
        "four "
        "and the reference sixteen; a column has the error with edges.</p>\n",
        sweep->subject->scene->camera.width_px, sweep->subject->scene->camera.height_px, machine->cpu,
        machine->core_count, machine->driver, sweep->repeat_count, error);
    if (!accuracy_draw_main_plot(sweep, ACCURACY_RMSE, &svg, &size, status))
        return false;
    const bool is_kept = io_file_write(path, svg, size, status);
    if (!accuracy_page_add_plot(page, svg, size) || !is_kept || !add_knobs(page, sweep, status))
        return false;
    if (!accuracy_page_add_predictions(page, sweep, status) || !add_pictures(page, sweep, status))
        return false;
    accuracy_page_add_plan(page, sweep);
    fit_page_add(page, "<h2>Other errors</h2>\n<div class=\"plots\">\n");
    for (int norm = ACCURACY_WEBER; norm <= ACCURACY_MAX; norm++) {
        if (!accuracy_draw_main_plot(sweep, (enum accuracy_norm)norm, &svg, &size, status) ||
            !accuracy_page_add_plot(page, svg, size))
            return false;
    }
    fit_page_add(page, "</div>\n");
    if (!add_fits(page, sweep, status) || !add_ladder(page, sweep, status))
        return false;
    add_table(page, sweep);
    return true;
}

bool accuracy_page_write(const struct accuracy_sweep *sweep, const char *folder, dipole_status *status)
{
    struct plot_text page = { .data = NULL };
    char path[4096];
    snprintf(path, sizeof path, "%s/report.html", folder);
    fit_page_add(
        &page,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n<meta name=\"viewport\" "
        "content=\"width=device-width\"/>\n<title>What accuracy costs</title>\n<style>\n");
    fit_page_add(&page, fit_report_style);
    fit_page_add(&page, style);
    fit_page_add(&page, "</style></head>\n<body>\n");
    bool done = add_all(&page, sweep, folder, status);
    fit_page_add(&page, script);
    fit_page_add(&page, "</body></html>\n");
    if (done && page.has_failed)
        done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the report");
    done = done && io_file_write(path, page.data, page.size, status);
    plot_text_destroy(&page);
    return done;
}
