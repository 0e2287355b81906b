/* Coefficients with their intervals, and correlations of parameters. */
#include "fit/report_color.h"
#include "fit/report_page.h"

#include <math.h>
#include <string.h>

/* Largest matrix that is shown whole, and how many pairs of a larger one are. */
enum { MATRIX_LIMIT = 40, PAIR_COUNT = 20 };

/* ---- values -------------------------------------------------------------------------------------------
 */

static void add_value(struct plot_text *page, const struct fit_report_value *value)
{
    const double below = fabs(value->value - value->ci95[0]), above = fabs(value->ci95[1] - value->value);
    char number[FIT_NUMBER_SIZE], low[FIT_NUMBER_SIZE], high[FIT_NUMBER_SIZE], half[FIT_NUMBER_SIZE];
    fit_number_format(value->value, fit_number_digits(value->value, fmin(below, above)), number);
    fit_number_format(value->ci95[0], fit_number_digits(value->ci95[0], below), low);
    fit_number_format(value->ci95[1], fit_number_digits(value->ci95[1], above), high);
    /* of what may be on either side of 0 a share of itself says nothing */
    const bool has_share = value->value != 0 && !(value->ci95[0] < 0 && value->ci95[1] > 0);
    if (has_share)
        fit_number_format(100 * fmax(below, above) / fabs(value->value), 2, half);
    plot_text_print(page,
                    "<tr><td>%s</td><td>%s</td><td class=\"number\"><b>%s</b></td><td>%s</td>"
                    "<td class=\"number\">%s</td><td class=\"number\">%s</td>",
                    value->group, value->name, number, value->unit, low, high);
    plot_text_print(page, "<td class=\"number\">%s</td><td class=\"note\">%s</td></tr>\n",
                    has_share ? half : "–", value->note);
}

void fit_page_add_values(struct plot_text *page, const struct fit_report *report)
{
    fit_page_add(page, "<h2>What was found</h2>\n<div class=\"wide\"><table>\n"
                       "<tr><th>of</th><th>parameter</th><th class=\"number\">value</th><th>unit</th>"
                       "<th class=\"number\">95 % from</th><th class=\"number\">to</th>"
                       "<th class=\"number\">± %</th><th>note</th></tr>\n");
    for (size_t i = 0; i < report->value_count; i++)
        add_value(page, &report->values[i]);
    fit_page_add(page, "</table></div>\n");
}

/* ---- correlations -------------------------------------------------------------------------------------
 */

static double correlation(const struct fit_report *report, size_t row, size_t column)
{
    return report->correlations[row * report->correlation_count + column];
}

static void add_cell(struct plot_text *page, double value)
{
    unsigned char rgb[3];
    fit_difference_color(value, rgb);
    plot_text_print(page, "<td style=\"background:rgb(%d,%d,%d);color:%s\">", rgb[0], rgb[1], rgb[2],
                    fabs(value) > 0.6 ? "#fff" : "#222");
    const int hundredths = isnan(value) ? 0 : (int)lround(100 * fmin(fabs(value), 1));
    if (isnan(value))
        fit_page_add(page, "–");
    else
        plot_text_print(page, "%s%d.%d%d", value < 0 && hundredths > 0 ? "-" : "", hundredths / 100,
                        hundredths / 10 % 10, hundredths % 10);
    fit_page_add(page, "</td>");
}

static void add_matrix(struct plot_text *page, const struct fit_report *report)
{
    fit_page_add(page, "<div class=\"wide\"><table class=\"cells\">\n<tr><th></th>");
    for (size_t i = 0; i < report->correlation_count; i++)
        plot_text_print(page, "<th class=\"number\">%d</th>", (int)i + 1);
    fit_page_add(page, "</tr>\n");
    for (size_t row = 0; row < report->correlation_count; row++) {
        plot_text_print(page, "<tr><th>%d %s</th>", (int)row + 1, report->correlation_names[row]);
        for (size_t column = 0; column < report->correlation_count; column++)
            add_cell(page, correlation(report, row, column));
        fit_page_add(page, "</tr>\n");
    }
    fit_page_add(page, "</table></div>\n");
}

struct pair {
    size_t row, column;
    double size;
};

/* The strongest come first, among equals those that stand first. */
static size_t pairs_find(const struct fit_report *report, struct pair pairs[PAIR_COUNT + 1])
{
    size_t count = 0;
    for (size_t row = 0; row < report->correlation_count; row++)
        for (size_t column = row + 1; column < report->correlation_count; column++) {
            const double size = fabs(correlation(report, row, column));
            if (isnan(size))
                continue;
            size_t at = count;
            for (; at > 0 && pairs[at - 1].size < size; at--)
                pairs[at] = pairs[at - 1];
            pairs[at] = (struct pair){ row, column, size };
            if (count < PAIR_COUNT)
                count++;
        }
    return count;
}

static void add_pairs(struct plot_text *page, const struct fit_report *report)
{
    struct pair pairs[PAIR_COUNT + 1];
    const size_t count = pairs_find(report, pairs);
    plot_text_print(page,
                    "<p>Of %d parameters, the pairs that are told apart worst:</p>\n"
                    "<div class=\"wide\"><table class=\"cells\">\n",
                    (int)report->correlation_count);
    for (size_t i = 0; i < count; i++) {
        plot_text_print(page, "<tr><th>%s</th><th>%s</th>", report->correlation_names[pairs[i].row],
                        report->correlation_names[pairs[i].column]);
        add_cell(page, correlation(report, pairs[i].row, pairs[i].column));
        fit_page_add(page, "</tr>\n");
    }
    fit_page_add(page, "</table></div>\n");
}

void fit_page_add_correlations(struct plot_text *page, const struct fit_report *report)
{
    if (report->correlation_count == 0)
        return;
    fit_page_add(page, "<h2>Correlations</h2>\n<p class=\"small\">Near 1 or -1, two parameters can change "
                       "together with hardly a change in what is seen, and the target tells them apart "
                       "badly; near 0 it tells each by itself.</p>\n");
    if (report->correlation_count <= MATRIX_LIMIT)
        add_matrix(page, report);
    else
        add_pairs(page, report);
}
