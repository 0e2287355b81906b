#include "plot/text.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void plot_text_add(struct plot_text *text, const void *bytes, size_t size)
{
    if (text->has_failed)
        return;
    if (text->capacity - text->size <= size) {
        const size_t capacity = 2 * (text->size + size) + 4096;
        char *const data = realloc(text->data, capacity);
        if (!data) {
            text->has_failed = true;
            return;
        }
        text->data = data;
        text->capacity = capacity;
    }
    memcpy(text->data + text->size, bytes, size);
    text->size += size;
    text->data[text->size] = '\0';
}

static void add_string(struct plot_text *text, const char *s)
{
    plot_text_add(text, s, strlen(s));
}

static void add_int(struct plot_text *text, long value)
{
    char digits[32];
    snprintf(digits, sizeof digits, "%ld", value);
    add_string(text, digits);
}

/* In hundredths, as integers: printf would use the decimal point of the locale. */
static void add_number(struct plot_text *text, double value)
{
    const long hundredths = lround(fmin(fmax(value, -1e7), 1e7) * 100);
    const long part = labs(hundredths) % 100;
    if (hundredths < 0)
        add_string(text, "-");
    add_int(text, labs(hundredths) / 100);
    if (part != 0) {
        char digits[4] = { '.', (char)('0' + part / 10), (char)('0' + part % 10), '\0' };
        if (part % 10 == 0)
            digits[2] = '\0';
        add_string(text, digits);
    }
}

size_t plot_text_character_size(const char *s)
{
    const unsigned char *const b = (const unsigned char *)s;
    if (b[0] < 0x80)
        return b[0] >= 0x20 || b[0] == '\t' || b[0] == '\n' || b[0] == '\r' ? 1 : 0;
    const size_t size = b[0] >= 0xf0 ? 4 : b[0] >= 0xe0 ? 3 : 2;
    static const unsigned long smallest[5] = { 0, 0, 0x80, 0x800, 0x10000 };
    unsigned long code = b[0] & (0x7fu >> size);
    if (b[0] < 0xc2 || b[0] > 0xf4)
        return 0;
    for (size_t i = 1; i < size; i++) {
        if ((b[i] & 0xc0) != 0x80)
            return 0;
        code = code << 6 | (b[i] & 0x3f);
    }
    const bool is_surrogate = code >= 0xd800 && code <= 0xdfff;
    const bool is_noncharacter = code == 0xfffe || code == 0xffff;
    return code < smallest[size] || code > 0x10ffff || is_surrogate || is_noncharacter ? 0 : size;
}

static void add_escaped(struct plot_text *text, const char *s)
{
    while (*s) {
        const size_t size = plot_text_character_size(s);
        if (size == 0)
            add_string(text, "\xef\xbf\xbd");
        else if (*s == '&')
            add_string(text, "&amp;");
        else if (*s == '<')
            add_string(text, "&lt;");
        else if (*s == '>')
            add_string(text, "&gt;");
        else if (*s == '"')
            add_string(text, "&quot;");
        else
            plot_text_add(text, s, size);
        s += size ? size : 1;
    }
}

void plot_text_print(struct plot_text *text, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    while (*format) {
        const size_t literal = strcspn(format, "%");
        plot_text_add(text, format, literal);
        format += literal;
        if (!*format)
            break;
        switch (format[1]) {
        case 'd':
            add_int(text, va_arg(arguments, int));
            break;
        case 'f':
            add_number(text, va_arg(arguments, double));
            break;
        case '%':
            plot_text_add(text, "%", 1);
            break;
        default:
            assert(format[1] == 's');
            add_escaped(text, va_arg(arguments, const char *));
        }
        format += 2;
    }
    va_end(arguments);
}

double plot_text_width_px(const char *s, size_t size, double font_px)
{
    /* 0.6 em: the mean of DejaVu Sans, the widest of the usual fonts, over words and digits. */
    double width_em = 0;
    for (size_t i = 0; i < size; i++)
        if (((unsigned char)s[i] & 0xc0) != 0x80)
            width_em += 0.6;
    return width_em * font_px;
}

void plot_text_destroy(struct plot_text *text)
{
    free(text->data);
    *text = (struct plot_text){ 0 };
}
