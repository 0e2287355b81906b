#include "accuracy/reference.h"

#include "io/csv.h"
#include "io/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILE_SIZE_LIMIT ((size_t)1 << 20)

enum { COLUMN_LIMIT = 16 };

/* A table whose columns have the numbers of their places in a list of names; -1 are those that are not
 * read. */
struct table {
    struct io_csv csv;
    const struct io_csv_column *columns;
    size_t field_of[COLUMN_LIMIT];
    char *text;
    dipole_status *status;
};

/* The first required_count columns must be there. */
static bool table_open(const char *path, const struct io_csv_column *columns, size_t name_count,
                       size_t required_count, struct table *table, dipole_status *status)
{
    const dipole_place place = { .source = path };
    size_t size;
    table->columns = columns;
    table->status = status;
    if (!io_file_read(path, FILE_SIZE_LIMIT, &table->text, &size, status))
        return false;
    io_csv_init(&table->csv, table->text, size, path, 4096);
    if (!io_csv_read_header(&table->csv, columns, name_count, "expected those of the reference data",
                            table->field_of, COLUMN_LIMIT, status))
        return false;
    for (size_t i = 0; i < required_count; i++)
        if (table->field_of[i] == IO_CSV_FIELD_LIMIT)
            return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "has no column %s", columns[i].name);
    return true;
}

/* False at the end, and then *is_done says whether without failure. */
static bool table_next(struct table *table, bool has_room, bool *is_done)
{
    const enum io_csv_next next = io_csv_next(&table->csv, table->status);
    const dipole_place place = io_csv_place(&table->csv, table->csv.line_start);
    *is_done = next == IO_CSV_END;
    if (next != IO_CSV_LINE || !io_csv_check_width(&table->csv, table->status))
        return false;
    return has_room || dipole_fail(table->status, DIPOLE_BAD_VALUE, &place, "the table has too many rows");
}

/* A number from 0 to max; where the table has no such column *out stays. */
static bool get(const struct table *table, int column, double max, double *out)
{
    return table->field_of[column] == IO_CSV_FIELD_LIMIT ||
           io_csv_get_number(&table->csv, &table->csv.fields[table->field_of[column]],
                             table->columns[column].name, 0, max, out, table->status);
}

static void get_text(const struct table *table, int column, char *out, size_t size)
{
    const struct io_csv_field *const field = &table->csv.fields[table->field_of[column]];
    snprintf(out, size, "%.*s", (int)field->length, field->text);
}

/* ---- MCML ----------------------------------------------------------------------------------------- */

/* "n=1.4 sigma_a=0.2 sigma_s=2 g=0 d_mm=0.5; n=..." */
static size_t parse_layers(const char *text, struct accuracy_mc_layer *layers)
{
    size_t count = 0;
    for (const char *at = text; at && count < DIPOLE_LAYER_LIMIT; at = strchr(at, ';')) {
        struct accuracy_mc_layer *const layer = &layers[count++];
        char thickness[32];
        at += strspn(at, "; ");
        if (sscanf(at, "n=%lf sigma_a=%lf sigma_s=%lf g=%lf d_mm=%31[^; ]", &layer->eta,
                   &layer->sigma_a_per_mm, &layer->sigma_s_per_mm, &layer->g, thickness) != 5)
            return 0;
        layer->thickness_mm = strtod(thickness, NULL);
    }
    return count;
}

enum { R_LO = 0, R_HI, RD, RD_ERROR, TD, TD_ERROR };

static const struct io_csv_column ring_columns[] = {
    { "r_lo_mm", R_LO }, { "r_hi_mm", R_HI },           { "R_per_mm2", RD },  { "R_sem_per_mm2", RD_ERROR },
    { "T_per_mm2", TD }, { "T_sem_per_mm2", TD_ERROR }, { "R1_per_mm2", -1 }, { "T1_per_mm2", -1 },
};

static bool read_ring(const struct table *table, struct accuracy_reference_case *out)
{
    const size_t i = out->ring_count++;
    return get(table, R_LO, 1e9, &out->edges_mm[i]) && get(table, R_HI, 1e9, &out->edges_mm[i + 1]) &&
           get(table, RD, 1e9, &out->rd_per_mm2[i]) && get(table, RD_ERROR, 1e9, &out->rd_error[i]) &&
           get(table, TD, 1e9, &out->td_per_mm2[i]) && get(table, TD_ERROR, 1e9, &out->td_error[i]);
}

/* A case without a table of rings is one of which only totals are known. */
static bool read_rings(const char *folder, struct accuracy_reference_case *out, dipole_status *status)
{
    char path[4096];
    dipole_status inner = { 0 };
    snprintf(path, sizeof path, "%s/mcml/%s.csv", folder, out->name);
    struct table *const table = calloc(1, sizeof *table);
    if (!table)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for %s", path);
    bool done =
        table_open(path, ring_columns, sizeof ring_columns / sizeof *ring_columns, TD, table, &inner);
    const bool is_there = done || inner.code != DIPOLE_NOT_FOUND;
    bool is_whole = done;
    while (done && table_next(table, out->ring_count < ACCURACY_REFERENCE_RING_LIMIT, &is_whole))
        done = read_ring(table, out);
    done = !is_there || (done && is_whole);
    if (!done && status)
        *status = inner;
    free(table->text);
    free(table);
    return done;
}

enum { NAME = 0, LAYERS, SPECULAR, R, R_SEM, UNSCATTERED_UP, T, T_SEM, UNSCATTERED_DOWN };

static const struct io_csv_column case_columns[] = {
    { "case", NAME },   { "layers", LAYERS }, { "Rsp", SPECULAR },
    { "R", R },         { "R_sem", R_SEM },   { "R0", UNSCATTERED_UP },
    { "T", T },         { "T_sem", T_SEM },   { "T0", UNSCATTERED_DOWN },
    { "photons", -1 },  { "batches", -1 },    { "first_seed", -1 },
    { "R1", -1 },       { "T1", -1 },         { "A", -1 },
    { "R_beyond", -1 }, { "T_beyond", -1 },   { "balance", -1 },
};

static bool read_case(const struct table *table, struct accuracy_reference_case *out)
{
    char layers[1024];
    const dipole_place place = io_csv_place(&table->csv, table->csv.line_start);
    get_text(table, NAME, out->name, sizeof out->name);
    get_text(table, LAYERS, layers, sizeof layers);
    out->stack.layer_count = parse_layers(layers, out->stack.layers);
    if (out->stack.layer_count == 0)
        return dipole_fail(table->status, DIPOLE_BAD_SYNTAX, &place,
                           "layers is \"%s\", expected n=... d_mm=...", layers);
    return get(table, SPECULAR, 1, &out->specular) && get(table, R, 1, &out->reflected) &&
           get(table, R_SEM, 1, &out->reflected_error) &&
           get(table, UNSCATTERED_UP, 1, &out->unscattered_reflected) &&
           get(table, T, 1, &out->transmitted) && get(table, T_SEM, 1, &out->transmitted_error) &&
           get(table, UNSCATTERED_DOWN, 1, &out->unscattered_transmitted);
}

static bool read_cases(const char *folder, struct table *table, struct accuracy_reference *out)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/mcml_totals.csv", folder);
    bool done = table_open(path, case_columns, sizeof case_columns / sizeof *case_columns,
                           UNSCATTERED_DOWN + 1, table, table->status);
    bool is_whole = done;
    while (done && table_next(table, out->case_count < ACCURACY_REFERENCE_CASE_LIMIT, &is_whole)) {
        struct accuracy_reference_case *const at = &out->cases[out->case_count++];
        done = read_case(table, at) && read_rings(folder, at, table->status);
    }
    return done && is_whole;
}

/* ---- adding and doubling -------------------------------------------------------------------------- */

enum { ALBEDO = 0, G, ETA, TAU, TOTAL_R, TOTAL_T, UNSCATTERED_R, UNSCATTERED_T, ERR };

static const struct io_csv_column slab_columns[] = {
    { "albedo", ALBEDO },
    { "g", G },
    { "n_slab", ETA },
    { "tau", TAU },
    { "R_total", TOTAL_R },
    { "T_total", TOTAL_T },
    { "R_unscattered", UNSCATTERED_R },
    { "T_unscattered", UNSCATTERED_T },
    { "err", ERR },
    { "R_diffuse_inc", -1 },
    { "T_diffuse_inc", -1 },
    { "quad_pts", -1 },
};

static bool read_slab(const struct table *table, struct accuracy_reference_slab *out)
{
    struct accuracy_mc_layer *const layer = &out->stack.layers[0];
    double albedo = 0;
    out->stack.layer_count = 1;
    layer->thickness_mm = INFINITY; /* sigma_t is 1/mm */
    const bool done = get(table, ALBEDO, 1, &albedo) && get(table, G, 1, &layer->g) &&
                      get(table, ETA, 10, &layer->eta) &&
                      (io_csv_equals(&table->csv.fields[table->field_of[TAU]], "inf") ||
                       get(table, TAU, 1e9, &layer->thickness_mm)) &&
                      get(table, TOTAL_R, 1, &out->total_r) && get(table, TOTAL_T, 1, &out->total_t) &&
                      get(table, UNSCATTERED_R, 1, &out->unscattered_r) &&
                      get(table, UNSCATTERED_T, 1, &out->unscattered_t) && get(table, ERR, 1, &out->error);
    layer->sigma_a_per_mm = 1 - albedo;
    layer->sigma_s_per_mm = albedo;
    return done;
}

static bool read_slabs(const char *folder, struct table *table, struct accuracy_reference *out)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/adding_doubling.csv", folder);
    bool done = table_open(path, slab_columns, sizeof slab_columns / sizeof *slab_columns, ERR + 1, table,
                           table->status);
    bool is_whole = done;
    while (done && table_next(table, out->slab_count < ACCURACY_REFERENCE_SLAB_LIMIT, &is_whole))
        done = read_slab(table, &out->slabs[out->slab_count++]);
    return done && is_whole;
}

bool accuracy_reference_read(const char *folder, struct accuracy_reference **out, dipole_status *status)
{
    struct accuracy_reference *const reference = calloc(1, sizeof *reference);
    struct table *const cases = calloc(1, sizeof *cases), *const slabs = calloc(1, sizeof *slabs);
    bool done = (reference && cases && slabs) ||
                dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for reference data");
    if (done) {
        cases->status = slabs->status = status;
        done = read_cases(folder, cases, reference) && read_slabs(folder, slabs, reference);
        free(cases->text);
        free(slabs->text);
    }
    free(cases);
    free(slabs);
    *out = done ? reference : NULL;
    if (!done)
        free(reference);
    return done;
}
