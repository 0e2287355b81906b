/* Target, model, difference and mask of a picture, side by side. */
#include "fit/comparison.h"
#include "fit/report_color.h"
#include "fit/report_page.h"

#include <math.h>

static const char *const channel_names[3] = { "R", "G", "B" };

/* A picture that a click, or the space bar, shows at full size, and what stands first below it. */
static bool add_zoom(struct plot_text *page, const struct io_image *image, const char *title,
                     dipole_status *status)
{
    plot_text_print(page,
                    "<figure><label class=\"zoom\"><input type=\"checkbox\" "
                    "aria-label=\"%s at full size\"/><span>",
                    title);
    if (!fit_page_add_image(page, image, title, status))
        return false;
    plot_text_print(page, "</span></label>\n<figcaption><b>%s</b>", title);
    return true;
}

static void add_percent(struct plot_text *page, double part, int digits)
{
    char number[FIT_NUMBER_SIZE];
    fit_number_format(100 * part, digits, number);
    plot_text_print(page, "%s", number);
    fit_page_add(page, "\xc2\xa0%"); /* which no line break separates */
}

/* ---- differences --------------------------------------------------------------------------------------
 */

static bool add_scale(struct plot_text *page, double limit, dipole_status *status)
{
    enum { STEP_COUNT = 101 };
    struct io_image *image = NULL;
    if (!io_image_create(STEP_COUNT, 1, 3, &image, status))
        return false;
    for (size_t i = 0; i < STEP_COUNT; i++) {
        unsigned char rgb[3];
        fit_difference_color(2.0 * (double)i / (STEP_COUNT - 1) - 1, rgb);
        fit_pixel_set(image, i, rgb);
    }
    fit_page_add(page, "<div class=\"scale\">");
    const bool done = fit_page_add_image(page, image, "blue, white, red", status);
    io_image_destroy(image);
    fit_page_add(page, "<div class=\"ends\"><span>-");
    add_percent(page, limit, 1);
    fit_page_add(page, "</span><span>0</span><span>+");
    add_percent(page, limit, 1);
    fit_page_add(page, "</span></div></div>");
    return done;
}

static void add_means(struct plot_text *page, const struct fit_comparison *comparison)
{
    fit_page_add(page, "<div>Mean:");
    for (int c = 0; c < 3; c++) {
        plot_text_print(page, " %s ", channel_names[c]);
        fit_page_add(page, comparison->mean_differences[c] > 0 ? "+" : "");
        add_percent(page, comparison->mean_differences[c], 2);
        fit_page_add(page, c < 2 ? "," : "");
    }
    fit_page_add(page, ". Blue: the model is darker; red: brighter; grey: not used.</div>");
}

/* Channel 0 to 2, or -1 for the mean of all. */
static bool add_difference(struct plot_text *page, const struct fit_comparison *comparison, int channel,
                           dipole_status *status)
{
    static const char *const titles[4] = { "(model - target) / target", "R: (model - target) / target",
                                           "G: (model - target) / target", "B: (model - target) / target" };
    struct io_image *image = NULL;
    const bool done = fit_differences_draw(comparison, channel, &image, status) &&
                      add_zoom(page, image, titles[channel + 1], status) &&
                      add_scale(page, comparison->limit, status);
    io_image_destroy(image);
    if (!done)
        return false;
    if (channel < 0)
        add_means(page, comparison);
    fit_page_add(page, "</figcaption></figure>\n");
    return true;
}

static bool add_channels(struct plot_text *page, const struct fit_comparison *comparison,
                         dipole_status *status)
{
    fit_page_add(page, "<details><summary>The difference by channel</summary>\n<div class=\"row\">\n");
    for (int c = 0; c < 3; c++)
        if (!add_difference(page, comparison, c, status))
            return false;
    fit_page_add(page, "</div></details>\n");
    return true;
}

/* ---- the mask -----------------------------------------------------------------------------------------
 */

static void add_legend(struct plot_text *page, const struct fit_comparison *comparison)
{
    size_t all = 0;
    for (int i = 0; i < FIT_USE_COUNT; i++)
        all += comparison->use_counts[i];
    fit_page_add(page, "<ul class=\"legend\">\n");
    for (int i = 0; i < FIT_USE_COUNT; i++) {
        if (comparison->use_counts[i] == 0)
            continue;
        const unsigned char *const rgb = fit_use_colors[i];
        plot_text_print(page,
                        "<li><svg width=\"12\" height=\"12\"><rect width=\"12\" height=\"12\" "
                        "fill=\"rgb(%d,%d,%d)\" stroke=\"#888888\"/></svg>%s: ",
                        rgb[0], rgb[1], rgb[2], fit_use_names[i]);
        plot_text_print(page, "%d, ", (int)comparison->use_counts[i]);
        add_percent(page, (double)comparison->use_counts[i] / (double)all, 3);
        fit_page_add(page, "</li>\n");
    }
    fit_page_add(page, "</ul>");
}

static bool add_mask(struct plot_text *page, const struct fit_report_picture *picture,
                     const struct fit_comparison *comparison, dipole_status *status)
{
    struct io_image *image = NULL;
    const bool done = fit_uses_draw(picture->uses, picture->image->width_px, picture->image->height_px,
                                    comparison->factor, &image, status) &&
                      add_zoom(page, image, "Use of the pixels", status);
    io_image_destroy(image);
    if (!done)
        return false;
    add_legend(page, comparison);
    fit_page_add(page, "</figcaption></figure>\n");
    return true;
}

/* ---- all ----------------------------------------------------------------------------------------------
 */

static bool add_row(struct plot_text *page, const struct fit_report_picture *picture,
                    const struct fit_comparison *comparison, dipole_status *status)
{
    char exposure[FIT_NUMBER_SIZE];
    fit_number_format(comparison->exposure, 3, exposure);
    fit_page_add(page, "<div class=\"row\">\n");
    if (!add_zoom(page, comparison->target, "Target", status))
        return false;
    plot_text_print(page, "<div>%d × %d pixels, times %s, as sRGB.", picture->image->width_px,
                    picture->image->height_px, exposure);
    if (comparison->factor > 1)
        plot_text_print(page, " Each shown is the mean of %d × %d.", comparison->factor,
                        comparison->factor);
    fit_page_add(page, "</div></figcaption></figure>\n");
    if (!add_zoom(page, comparison->model, "Model", status))
        return false;
    fit_page_add(page, "<div>In the same exposure.</div></figcaption></figure>\n");
    if (!add_difference(page, comparison, -1, status) || !add_mask(page, picture, comparison, status))
        return false;
    fit_page_add(page, "</div>\n");
    return add_channels(page, comparison, status);
}

bool fit_page_add_picture(struct plot_text *page, const struct fit_report_picture *picture,
                          size_t pixel_limit, dipole_status *status)
{
    struct fit_comparison *comparison;
    if (!fit_comparison_create(picture, pixel_limit, &comparison, status))
        return false;
    plot_text_print(page, "<h3>%s</h3>\n", picture->name);
    const bool done = add_row(page, picture, comparison, status);
    fit_comparison_destroy(comparison);
    return done;
}
