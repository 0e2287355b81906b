#include "fit/report_page.h"

#include "io/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Light, with the system's fonts; one column on a phone; nothing that is seen is a background on paper. */
const char fit_report_style[] =
    ":root{color-scheme:light;font:16px/1.5 system-ui,sans-serif;color:#222;background:#fff}\n"
    "body{margin:0 auto;padding:1rem;max-width:76rem;overflow-wrap:anywhere}\n"
    "h1{font-size:1.6rem;line-height:1.25;margin:.5rem 0}\n"
    "h2{font-size:1.2rem;margin:2.2rem 0 .6rem;padding-top:.8rem;border-top:1px solid #ddd}\n"
    "h3{font-size:1rem;margin:1.4rem 0 .4rem}\n"
    "p,dl,ul{margin:.5rem 0;max-width:48rem}\n"
    ".verdict{font-size:1.1rem;white-space:pre-line}\n"
    ".state{display:inline-block;font-weight:600;padding:.2rem .8rem;border:2px "
    "solid;border-radius:.4rem}\n"
    ".good{color:#00694d}\n"
    ".bad{color:#a8380a}\n"
    "dl{display:flex;flex-wrap:wrap;gap:.3rem 2rem}\n"
    "dt{font-size:.8rem;color:#555}\n"
    "dd{margin:0;font-variant-numeric:tabular-nums}\n"
    ".wide{overflow-x:auto}\n"
    "table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums;overflow-wrap:normal}"
    "\n"
    "th,td{padding:.25rem .6rem;text-align:left;border-bottom:1px solid #ddd;vertical-align:baseline}\n"
    "th{font-weight:600}\n"
    ".number{text-align:right;white-space:nowrap}\n"
    ".note{min-width:12rem}\n"
    ".cells td{text-align:center;padding:.25rem .4rem;border:1px solid #fff;print-color-adjust:exact;"
    "-webkit-print-color-adjust:exact}\n"
    ".cells th{white-space:nowrap}\n"
    ".row{display:grid;gap:1rem;grid-template-columns:repeat(2,1fr)}\n"
    "@media(min-width:48rem){.row{grid-template-columns:repeat(4,1fr)}}\n"
    "@media(max-width:40rem){table{font-size:.8rem}th,td{padding:.2rem .3rem}}\n"
    ".plots{display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(min(100%,30rem),1fr))}\n"
    "figure{margin:0;min-width:0;break-inside:avoid}\n"
    "figcaption,.small{font-size:.85rem;color:#444}\n"
    "figcaption b{color:#222}\n"
    ".plot{overflow-x:auto}\n"
    ".plot svg{display:block;width:100%;min-width:26rem;max-width:46rem;height:auto}\n"
    "img{image-rendering:pixelated}\n"
    ".zoom{display:block;position:relative}\n"
    ".zoom input{position:absolute;opacity:0}\n"
    ".zoom span{display:flex;cursor:zoom-in}\n"
    ".zoom img{display:block;width:100%;height:auto;border:1px solid #bbb;box-sizing:border-box}\n"
    ".zoom input:focus-visible+span{outline:3px solid #0072b2}\n"
    ".zoom input:checked+span{position:fixed;inset:0;z-index:1;overflow:auto;background:#fff;"
    "cursor:zoom-out}\n"
    ".zoom input:checked+span img{flex:none;margin:auto;width:auto;min-width:90vmin;border:0}\n"
    ".scale img{display:block;width:100%;height:.8rem;border:1px solid #bbb;box-sizing:border-box}\n"
    ".ends{display:flex;justify-content:space-between}\n"
    ".legend svg{vertical-align:-.1em;margin-right:.4rem}\n"
    ".legend{list-style:none;margin:0;padding:0 0 0 1.1rem;text-indent:-1.1rem}\n"
    ".legend svg{vertical-align:-.1em;margin-right:.4rem}\n"
    "summary{cursor:pointer;font-size:.9rem;margin:.5rem 0}\n"
    "@media print{body{max-width:none;padding:0}.wide,.plot{overflow:visible}.plot svg{min-width:0}"
    "table{font-size:.75rem}"
    ".row{grid-template-columns:repeat(4,1fr)}.plots{grid-template-columns:1fr 1fr}}\n";

/* ---- numbers ------------------------------------------------------------------------------------------
 */

/* printf writes the decimal point of the locale, which may be any bytes: here it is a point. */
static void point_restore(char *s)
{
    char *out = s;
    for (bool was_point = false; *s; s++) {
        const bool is_point = !strchr("+-0123456789e", *s);
        if (!is_point)
            *out++ = *s;
        else if (!was_point)
            *out++ = '.';
        was_point = is_point;
    }
    *out = '\0';
}

void fit_number_format(double value, int digits, char out[FIT_NUMBER_SIZE])
{
    if (!isfinite(value) || value == 0) {
        snprintf(out, FIT_NUMBER_SIZE, "%s",
                 isnan(value) ? "unknown"
                 : value > 0  ? "∞"
                 : value == 0 ? "0"
                              : "−∞");
        return;
    }
    char scientific[FIT_NUMBER_SIZE];
    snprintf(scientific, sizeof scientific, "%.*e", digits - 1, value);
    const int exponent = (int)strtol(strchr(scientific, 'e') + 1, NULL, 10); /* after rounding */
    if (exponent < -4 || exponent > 5) {
        snprintf(out, FIT_NUMBER_SIZE, "%.*se%d", (int)strcspn(scientific, "e"), scientific, exponent);
    } else {
        const int decimals = digits - 1 - exponent;
        const double step = pow(10, -decimals);
        snprintf(out, FIT_NUMBER_SIZE, "%.*f", decimals > 0 ? decimals : 0,
                 decimals < 0 ? round(value / step) * step : value);
    }
    point_restore(out);
}

int fit_number_digits(double value, double distance)
{
    enum { EXACT = 6 };
    const double digits = floor(log10(fabs(value))) - floor(log10(fabs(distance))) + 2;
    return digits >= 2 ? (int)fmin(digits, EXACT) : isnan(digits) ? 4 : 2;
}

/* ---- markup -------------------------------------------------------------------------------------------
 */

void fit_page_add(struct plot_text *page, const char *markup)
{
    plot_text_add(page, markup, strlen(markup));
}

static void add_base64(struct plot_text *page, const unsigned char *bytes, size_t size)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t count = size - i < 3 ? size - i : 3;
        unsigned long bits = 0;
        for (size_t k = 0; k < 3; k++)
            bits = bits << 8 | (k < count ? bytes[i + k] : 0);
        char four[4];
        for (size_t k = 0; k < 4; k++)
            four[k] = k <= count ? letters[bits >> (18 - 6 * k) & 63] : '=';
        plot_text_add(page, four, sizeof four);
    }
}

bool fit_page_add_image(struct plot_text *page, const struct io_image *image, const char *alt,
                        dipole_status *status)
{
    unsigned char *png = NULL;
    size_t size = 0;
    if (!io_png_encode(image, &png, &size, status))
        return false;
    plot_text_print(page, "<img width=\"%d\" height=\"%d\" alt=\"%s\" src=\"data:image/png;base64,",
                    image->width_px, image->height_px, alt);
    add_base64(page, png, size);
    fit_page_add(page, "\"/>");
    free(png);
    return true;
}
