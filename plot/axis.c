#include "plot/axis.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

bool plot_value_is_drawable(enum plot_scale scale, double value)
{
    return isfinite(value) && (scale == PLOT_LINEAR || value > 0);
}

static double power_of_ten(int exponent)
{
    return pow(10, exponent);
}

static int floor_log10(double value)
{
    int exponent = (int)floor(log10(value));
    if (power_of_ten(exponent + 1) <= value)
        exponent++;
    return exponent;
}

/* The step 1, 2 or 5 times 10^exponent that puts at most limit intervals into span. */
static void step_find(double span, int limit, long *mantissa, int *exponent)
{
    const double least = span / limit * (1 - 1e-12);
    *exponent = floor_log10(least);
    const double scaled = least / power_of_ten(*exponent);
    *mantissa = scaled <= 1 ? 1 : scaled <= 2 ? 2 : scaled <= 5 ? 5 : 10;
    if (*mantissa == 10) {
        *mantissa = 1;
        ++*exponent;
    }
}

/* Largest of 1, 2, 5 x 10^k that is <= value, or smallest that is >= value. */
static double round_log(double value, bool is_up)
{
    static const double steps[] = { 1, 2, 5, 10 };
    const double base = power_of_ten(floor_log10(value));
    double result = base;
    for (int i = 0; i < 4; i++) {
        const double step = base * steps[i];
        if (is_up && step >= value * (1 - 1e-12))
            return step;
        if (!is_up && step <= value * (1 + 1e-12))
            result = step;
    }
    return result;
}

struct plot_range plot_range_round(enum plot_scale scale, double low, double high)
{
    struct plot_range range = { .scale = scale };
    if (scale == PLOT_LOG) {
        if (low > high)
            return (struct plot_range){ .scale = scale, .min = 0.1, .max = 10 };
        /* Ends of the range of doubles would have no round number beyond them. */
        range.min = round_log(fmin(fmax(low, 1e-290), 1e290), false);
        range.max = round_log(fmin(fmax(high, 1e-290), 1e290), true);
        if (!(range.min < range.max)) {
            range.min /= 2;
            range.max *= 2;
        }
        return range;
    }
    if (low > high)
        return (struct plot_range){ .scale = scale, .min = 0, .max = 1 };
    low = fmin(fmax(low, -1e290), 1e290);
    high = fmin(fmax(high, -1e290), 1e290);
    if (high - low <= 1e-9 * fmax(fabs(low), fabs(high))) {
        const double half = low == 0 ? 1 : fabs(low) / 10;
        low -= half;
        high += half;
    }
    long mantissa;
    int exponent;
    step_find(high - low, 8, &mantissa, &exponent);
    const double step = (double)mantissa * power_of_ten(exponent);
    range.min = floor(low / step + 1e-9) * step;
    range.max = ceil(high / step - 1e-9) * step;
    return range;
}

double plot_range_position(const struct plot_range *range, double value)
{
    if (!plot_value_is_drawable(range->scale, value))
        return NAN;
    if (range->scale == PLOT_LOG)
        return (log(value) - log(range->min)) / (log(range->max) - log(range->min));
    return (value - range->min) / (range->max - range->min);
}

static void add_tick(struct plot_ticks *out, long mantissa, int exponent, bool has_label)
{
    if (out->count < PLOT_TICK_LIMIT)
        out->ticks[out->count++] = (struct plot_tick){ .value = (double)mantissa * power_of_ten(exponent),
                                                       .mantissa = mantissa,
                                                       .exponent = exponent,
                                                       .has_label = has_label };
}

static void place_linear(const struct plot_range *range, int label_limit, struct plot_ticks *out)
{
    long mantissa;
    int exponent;
    step_find(range->max - range->min, label_limit, &mantissa, &exponent);
    const double step = (double)mantissa * power_of_ten(exponent);
    const double first = ceil(range->min / step - 1e-9), last = floor(range->max / step + 1e-9);
    /* A range far narrower than its distance from 0 has no ticks that doubles could tell apart. */
    if (fabs(first) > 1e12 || fabs(last) > 1e12)
        return;
    for (long i = (long)first; i <= (long)last; i++)
        add_tick(out, i * mantissa, exponent, true);
}

static void place_log(const struct plot_range *range, int label_limit, struct plot_ticks *out)
{
    const double low = range->min * (1 - 1e-9), high = range->max * (1 + 1e-9);
    const int first = floor_log10(low) + 1, last = floor_log10(high);
    const int decade_count = last - first + 1;
    const int stride = decade_count > label_limit ? (decade_count + label_limit - 1) / label_limit : 1;
    const bool is_short = decade_count < 2;
    for (int exponent = first - 1; exponent <= last; exponent++)
        for (int mantissa = 1; mantissa <= 9; mantissa++) {
            const double value = mantissa * power_of_ten(exponent);
            const bool is_decade = mantissa == 1;
            if (value < low || value > high || (stride > 1 && !is_decade))
                continue;
            const bool has_label =
                is_decade ? exponent % stride == 0 : is_short && (mantissa == 2 || mantissa == 5);
            add_tick(out, mantissa, exponent, has_label);
        }
}

static size_t label_count(const struct plot_ticks *ticks)
{
    size_t count = 0;
    for (size_t i = 0; i < ticks->count; i++)
        count += ticks->ticks[i].has_label;
    return count;
}

void plot_ticks_place(const struct plot_range *range, int label_limit, struct plot_ticks *out)
{
    assert(range->min < range->max && label_limit >= 2);
    out->count = 0;
    if (range->scale == PLOT_LOG)
        place_log(range, label_limit, out);
    if (range->scale == PLOT_LINEAR || label_count(out) < 2) {
        out->count = 0;
        place_linear(range, label_limit, out);
    }
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < out->count; i++)
        if (out->ticks[i].has_label && out->ticks[i].mantissa != 0) {
            least = fmin(least, fabs(out->ticks[i].value));
            most = fmax(most, fabs(out->ticks[i].value));
        }
    out->has_powers =
        range->scale == PLOT_LOG ? least < 0.9e-2 || most > 1.1e3 : least < 0.9e-4 || most > 0.9e5;
}

#define MINUS "−"
#define TIMES "×"

/* mantissa x 10^exponent in plain decimals; integers throughout, so no locale. */
static void decimal_print(long mantissa, int exponent, char *out, size_t size)
{
    char digits[24];
    snprintf(digits, sizeof digits, "%ld", labs(mantissa));
    const char *const sign = mantissa < 0 ? MINUS : "";
    int length = 0;
    while (digits[length])
        length++;
    if (exponent >= 0) {
        snprintf(out, size, "%s%s%.*s", sign, digits, exponent, "000000000");
    } else if (length > -exponent) {
        snprintf(out, size, "%s%.*s.%s", sign, length + exponent, digits, digits + length + exponent);
    } else {
        snprintf(out, size, "%s0.%.*s%s", sign, -exponent - length, "0000000000000000", digits);
    }
}

void plot_tick_label_init(const struct plot_ticks *ticks, const struct plot_tick *tick,
                          struct plot_tick_label *out)
{
    *out = (struct plot_tick_label){ { 0 }, { 0 } };
    if (tick->mantissa == 0) {
        snprintf(out->base, sizeof out->base, "0");
        return;
    }
    if (!ticks->has_powers) {
        decimal_print(tick->mantissa, tick->exponent, out->base, sizeof out->base);
        return;
    }
    long mantissa = tick->mantissa;
    int exponent = tick->exponent, shift = 0;
    while (mantissa % 10 == 0) {
        mantissa /= 10;
        exponent++;
    }
    for (long rest = labs(mantissa); rest >= 10; rest /= 10)
        shift++;
    exponent += shift;
    snprintf(out->exponent, sizeof out->exponent, "%s%d", exponent < 0 ? MINUS : "", abs(exponent));
    if (mantissa == 1) {
        snprintf(out->base, sizeof out->base, "10");
        return;
    }
    char digits[24];
    decimal_print(mantissa, -shift, digits, sizeof digits);
    snprintf(out->base, sizeof out->base, "%s" TIMES "10", digits);
}
