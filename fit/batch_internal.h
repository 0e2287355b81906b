/* What the batch_*.c files share. */
#ifndef FIT_BATCH_INTERNAL_H
#define FIT_BATCH_INTERNAL_H

#include "fit/batch.h"

#include <jansson.h>
#include <limits.h>
#include <stdint.h>

/* ---- the list (batch_list.c) ---------------------------------------------------------------------- */

#define BATCH_ROW_LIMIT ((size_t)1000000)
#define BATCH_LIST_SIZE_LIMIT ((size_t)256 << 20)
enum { BATCH_NAME_LIMIT = 128, BATCH_COLUMN_LIMIT = 64, BATCH_PATH_LIMIT = 4096 };

/* Between the parts of a cell that holds several. */
#define BATCH_SEPARATOR ';'

struct batch_column {
    enum batch_column_kind { BATCH_NAME = 0, BATCH_SCENE, BATCH_TARGET, BATCH_OPTION } kind;
    const struct cli_option *option; /* of BATCH_OPTION */
    const char *name;
};

struct batch_row {
    const char *name;
    const char *cells; /* one text for each column of the list, one behind the end of the other */
    int line;
    uint64_t inputs; /* hash, once has_inputs */
    bool has_inputs, is_mine, is_done;
};

struct batch_list {
    char folder[PATH_MAX]; /* of the list, absolute: what paths in cells are relative to */
    struct batch_column columns[BATCH_COLUMN_LIMIT];
    size_t column_count;
    struct batch_row *rows;
    size_t row_count;
    struct batch_row **by_name; /* sorted */
    char *text;                 /* that cells point into */
};

/* Read a list whole. Fails with line and column where the list as such is wrong: columns, names, the number
 * of cells, quotes, limits. End it with batch_list_destroy. */
DIPOLE_CHECKED bool batch_list_read(const char *path, const struct cli_tool *tool, struct batch_list **out,
                                    dipole_status *status);
/* The same of a text, without list->folder. */
DIPOLE_CHECKED bool batch_list_parse(const char *text, size_t size, const char *source,
                                     const struct cli_tool *tool, struct batch_list **out,
                                     dipole_status *status);
void batch_list_destroy(struct batch_list *list);

/* NULL when there is none. */
struct batch_row *batch_list_find(const struct batch_list *list, const char *name);

/* Whether a cell of this column holds several texts, with BATCH_SEPARATOR between. */
bool batch_column_is_several(const struct batch_column *column);

/* Which of count shards (0 ... count - 1) a row is in: by its name alone. */
size_t batch_shard_of(const char *name, size_t count);

/* "i/n", 1 <= i <= n <= BATCH_ROW_LIMIT; index_out counts from 0. */
bool batch_shard_parse(const char *text, size_t *index_out, size_t *count_out);

/* ---- inputs (batch_inputs.c) ---------------------------------------------------------------------- */

/*
 * Hash of what a row's result depends on: its cells, but for the name, whatever the order of the columns;
 * flags; the contents of files that cells name, and of files that these name if they are JSON, and so on.
 */
uint64_t batch_inputs_hash(const struct batch_list *list, const struct batch_row *row,
                           const char *const *flags, size_t flag_count);

/* Hash of a regular file's contents; false when there is none that can be read. */
bool batch_file_hash(const char *path, uint64_t *out);

/* ---- one row (batch_row.c) ------------------------------------------------------------------------ */

/* What became of a row. */
struct batch_outcome {
    bool is_done, is_interrupted; /* neither: failed                                     */
    int exit_code;                /* 128 and the signal's number when one ended it       */
    double seconds;
    char message[512]; /* UTF-8, one line; "" when done                       */
    json_t *fit;       /* the block that it printed, or NULL; json_decref     */
};

/*
 * Run this program anew for a row, in the list's folder, with its result going to output_path (absolute),
 * and wait for it, row_seconds at most (0: without limit). Fails only where no process can be made.
 */
DIPOLE_CHECKED bool batch_row_run(const struct cli_tool *tool, const struct batch_list *list,
                                  const struct batch_row *row, const char *const *flags, size_t flag_count,
                                  const char *output_path, double row_seconds,
                                  struct batch_outcome *outcome, dipole_status *status);

/* From now on SIGHUP, SIGINT and SIGTERM end the running row, and only then the program. */
void batch_signals_take(void);
/* The signal that came, or 0. */
int batch_signal(void);
/* End as the signal would have ended the program. */
void batch_signal_end(void);

/* ---- results (batch_results.c) -------------------------------------------------------------------- */

/* A file of results that is locked and open for appending. */
struct batch_results {
    int file; /* -1: not open */
    char path[PATH_MAX];
    bool is_torn; /* its last line has no end */
};

/* Open and lock folder/results.jsonl, or with shards results.I-of-N.jsonl. Fails when another process has
 * it. End it with batch_results_close. */
DIPOLE_CHECKED bool batch_results_open(const char *folder, size_t shard_index, size_t shard_count,
                                       struct batch_results *out, dipole_status *status);
void batch_results_close(struct batch_results *results);

/* Append a value as one line, on disk when this returns. A line that could not be written whole is kept
 * apart from the next. */
DIPOLE_CHECKED bool batch_results_append(struct batch_results *results, json_t *line,
                                         dipole_status *status);

/*
 * Give each line of folder/results*.jsonl to visit. What is no JSON object, such as the last line of a
 * process that was ended, is left out and counted in *ignored_out.
 */
typedef void batch_visit(void *context, json_t *line);
DIPOLE_CHECKED bool batch_results_read(const char *folder, batch_visit *visit, void *context,
                                       size_t *ignored_out, dipole_status *status);

#endif
