/* Many fits by one command: a list with a row for each, done one after the other, each in a process of its
 * own. docs/batch.md describes list, results and restarts. */
#ifndef FIT_BATCH_H
#define FIT_BATCH_H

#include "cli/cli.h"

/* What fit was asked for beside what all of its rows share. */
struct fit_batch_request {
    const char *list_path; /* --batch; NULL: an error, said by fit_batch_run   */
    const char *folder;    /* --output: results go there; made if it is absent; NULL: the same */
    const char *shard;     /* --shard, "i/n"; NULL: all rows                   */
    double row_seconds;    /* --row-seconds: a row is ended after these; 0: no limit */
};

/* Names of the options in tool->options that request holds: no columns. */
#define FIT_BATCH_OPTION "batch"
#define FIT_BATCH_FOLDER_OPTION "output"
#define FIT_BATCH_SHARD_OPTION "shard"
#define FIT_BATCH_ROW_SECONDS_OPTION "row-seconds"

/* For the end of the program's details. */
#define FIT_BATCH_DETAILS                                                                                  \
    "A batch: --batch names a list, a CSV file with a header line. Each row is a fit: its name, scene "    \
    "and "                                                                                                 \
    "target (several with ; between), and options that take a value, each in the column of its name; an "  \
    "empty cell is an option that is not given. Paths in it are relative to the list. Each row is done "   \
    "by "                                                                                                  \
    "a process of its own and leaves FOLDER/NAME.json, and a line in FOLDER/results.jsonl.\n"              \
    "\n"                                                                                                   \
    "The same command goes on where it was ended: rows that are done are skipped unless their cells, or "  \
    "files that they name, have changed; rows that failed are tried again. --shard I/N does the rows "     \
    "whose names belong to part I of N, for N machines that share the folder.\n"                           \
    "\n"                                                                                                   \
    "  fit --batch list.csv -o found --shard 3/8\n"

/* Whether the command line asks for a batch, or for what only a batch has. */
static inline bool fit_batch_is_asked(const struct fit_batch_request *request)
{
    return request->list_path || request->shard || request->row_seconds > 0;
}

/*
 * Do what is left of the list. The columns are name, scene, target and the options in tool->options that
 * take a value; argv, which cli_parse has read, may hold flags, which every row is given, and nothing else.
 * Prints a summary, as JSON with common->json, or what is wrong. Returns the exit code: EXIT_DONE, all rows
 * are; EXIT_FAILED, the list cannot be used or rows have failed; EXIT_USAGE. A signal that ends the program
 * ends the running row before, and leaves the others' results.
 */
int fit_batch_run(const struct cli_tool *tool, const struct cli_common *common, int argc, char **argv,
                  const struct fit_batch_request *request);

#endif
