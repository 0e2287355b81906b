/*
 * Draws curves from a table.
 * usage: bench_curves TABLE.csv OUT.svg TITLE X-TITLE Y-TITLE
 * The table's first line names the columns; the first column is x, each other one a curve. Both axes are
 * logarithmic; an empty cell is left out.
 */
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 12, ROWS = 256, NAME = 64 };

static char names[COLUMNS][NAME];
static double values[COLUMNS][ROWS];

/* Cut a line at its commas; returns how many cells. */
static size_t cut(char *line, char *cells[COLUMNS])
{
    size_t count = 0;
    line[strcspn(line, "\r\n")] = '\0';
    for (char *cell = line; cell && count < COLUMNS; count++) {
        char *const comma = strchr(cell, ',');
        if (comma)
            *comma = '\0';
        cells[count] = cell;
        cell = comma ? comma + 1 : NULL;
    }
    return count;
}

static bool read_table(const char *path, size_t *columns, size_t *rows)
{
    FILE *const file = fopen(path, "r");
    char line[4096], *cells[COLUMNS];
    *columns = *rows = 0;
    if (!file)
        return false;
    while (*rows < ROWS && fgets(line, sizeof line, file)) {
        const size_t count = cut(line, cells);
        if (*columns == 0) {
            *columns = count;
            for (size_t i = 0; i < count; i++)
                snprintf(names[i], NAME, "%s", cells[i]);
            continue;
        }
        for (size_t i = 0; i < *columns; i++)
            values[i][*rows] = i < count && cells[i][0] ? strtod(cells[i], NULL) : NAN;
        ++*rows;
    }
    fclose(file);
    return *columns > 1 && *rows > 0;
}

int main(int argc, char **argv)
{
    size_t columns, rows;
    if (argc != 6 || !read_table(argv[1], &columns, &rows)) {
        fputs("usage: bench_curves TABLE.csv OUT.svg TITLE X-TITLE Y-TITLE\n", stderr);
        return 2;
    }
    struct plot_series series[COLUMNS];
    for (size_t i = 1; i < columns; i++)
        series[i - 1] = (struct plot_series){ .label = names[i],
                                              .count = rows,
                                              .x = values[0],
                                              .y = values[i],
                                              .dash = (enum plot_dash)((i - 1) % 4) };
    const struct plot plot = { .title = argv[3],
                               .x = { .title = argv[4], .scale = PLOT_LOG },
                               .y = { .title = argv[5], .scale = PLOT_LOG },
                               .series = series,
                               .series_count = columns - 1 };
    char *svg = NULL;
    size_t size = 0;
    dipole_status status = { 0 };
    FILE *const file = plot_svg_create(&plot, &svg, &size, &status) ? fopen(argv[2], "w") : NULL;
    const bool done = file && fwrite(svg, 1, size, file) == size && fclose(file) == 0;
    if (!done)
        fprintf(stderr, "bench_curves: %s cannot be written: %s\n", argv[2], status.message);
    free(svg);
    return done ? 0 : 1;
}
