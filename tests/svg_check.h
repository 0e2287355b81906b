/* What must hold of every SVG we write. */
#ifndef SVG_CHECK_H
#define SVG_CHECK_H

#include "plot/plot.h"
#include "tests/check.h"

#include <stdlib.h>
#include <string.h>

static inline size_t count_of(const char *text, const char *part)
{
    size_t count = 0;
    for (const char *p = strstr(text, part); p; p = strstr(p + 1, part))
        count++;
    return count;
}

/* Every tag is closed in order, every & begins a known entity, attributes are quoted, one root. */
static inline void assert_well_formed(const char *svg)
{
    char open[32][32];
    int depth = 0, root_count = 0;
    for (const char *p = svg; *p;) {
        if (*p == '&')
            assert_true(!strncmp(p, "&amp;", 5) || !strncmp(p, "&lt;", 4) || !strncmp(p, "&gt;", 4) ||
                        !strncmp(p, "&quot;", 6));
        if (*p != '<') {
            assert_true(depth > 0 || *p == '\n');
            p++;
            continue;
        }
        const bool is_end = p[1] == '/';
        const char *name = p + 1 + is_end;
        const size_t length = strspn(name, "abcdefghijklmnopqrstuvwxyz");
        assert_in_range(length, 1, 31);
        bool is_quoted = false;
        for (p = name + length; is_quoted || *p != '>'; p++) {
            assert_true(*p && *p != '<');
            is_quoted ^= *p == '"';
        }
        const bool is_empty = p[-1] == '/';
        p++;
        if (is_end) {
            assert_true(depth-- > 0);
            assert_true(strlen(open[depth]) == length && !strncmp(open[depth], name, length));
        } else if (!is_empty) {
            root_count += depth == 0;
            assert_true(depth < 32);
            snprintf(open[depth++], sizeof *open, "%.*s", (int)length, name);
        }
    }
    assert_int_equal(depth, 0);
    assert_int_equal(root_count, 1);
}

static inline void assert_drawable(const char *svg)
{
    unsigned char *png = NULL;
    size_t size = 0;
    dipole_status status = { 0 };
    const bool is_done = plot_png_create(svg, strlen(svg), 1, &png, &size, &status);
    if (!is_done)
        print_error("%s\n", status.message);
    assert_true(is_done);
    free(png);
}

#endif
