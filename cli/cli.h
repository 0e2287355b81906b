/*
 * What all command-line tools share: one option table that parses, prints --help and writes the man
 * page; reports of failures; progress.
 */
#ifndef CLI_H
#define CLI_H

#include "libdipole/dipole.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum cli_exit { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_USAGE = 2 };

enum cli_kind {
    CLI_FLAG = 0, /* target: bool *                                                */
    CLI_TEXT,     /* target: const char **                                         */
    CLI_NUMBER,   /* target: double *, min..max                                    */
    CLI_CHOICE,   /* target: int *, index into choices                             */
    CLI_CHOICES,  /* target: unsigned *, comma separated, bit i for choices[i]     */
    CLI_SIZE,     /* target: int[2], WxH, each min..max                            */
    CLI_RANGE,    /* target: int[2], A:B or A, each min..max, A <= B               */
    CLI_NUMBERS,  /* target: struct cli_numbers *, comma separated, each min..max  */
    CLI_TEXTS,    /* target: struct cli_texts *, the option may be repeated        */
};

struct cli_numbers {
    double values[4096];
    size_t count;
};

struct cli_texts {
    const char *values[256];
    size_t count;
};

/* One option. A table of these ends with a row whose name is NULL. */
struct cli_option {
    const char *name; /* long name without dashes                       */
    char letter;      /* short name, 0 for none                         */
    enum cli_kind kind;
    void *target;
    const char *argument; /* how --help shows the value, NULL for flags     */
    const char *help;     /* one sentence, unit and default included        */
    double min, max;
    const char *const *choices; /* ends with NULL                                 */
};

struct cli_tool {
    const char *name;                 /* "dipole"                                       */
    const char *summary;              /* one line                                       */
    const char *usage;                /* what follows the name: "MATERIAL.json [...]"   */
    const char *details;              /* paragraphs after the options; NULL for none    */
    const struct cli_option *options; /* beside --help, --version, --man, --json, -q    */
    int operand_min, operand_max;
};

/* What every tool has. */
struct cli_common {
    bool json;  /* --json: the result as JSON on stdout        */
    bool quiet; /* -q, --quiet: no progress, no notes          */
};

enum cli_outcome { CLI_RUN = 0, CLI_STOP_DONE, CLI_STOP_USAGE };

/*
 * Parse argv. Operands are left in *operands (pointing into argv) and *operand_count.
 * --help, --version and --man are answered on stdout (CLI_STOP_DONE); a wrong option, value or number of
 * operands gets one line on stderr (CLI_STOP_USAGE).
 */
enum cli_outcome cli_parse(const struct cli_tool *tool, int argc, char **argv, struct cli_common *common,
                           char ***operands, int *operand_count);

/* Print "tool: FILE:LINE:COL: message" to stderr; returns code. */
int cli_report(const struct cli_tool *tool, const dipole_status *status, enum cli_exit code);

/* Print "tool: note: ..." to stderr unless quiet. */
void cli_note(const struct cli_tool *tool, const struct cli_common *common, const char *format, ...)
    DIPOLE_PRINTF(3, 4);

/* Progress on stderr, only when that is a terminal and not quiet: "tool: what 40 % (12 s left)".
 * fraction 0 starts the clock, 1 clears the line. */
struct cli_progress {
    const struct cli_tool *tool;
    bool is_shown;
    double start_s, shown_s;
};
void cli_progress_start(struct cli_progress *progress, const struct cli_tool *tool,
                        const struct cli_common *common);
void cli_progress_show(struct cli_progress *progress, const char *what, double fraction);

/* Flush stdout and say whether everything printed arrived (a full disk behind a pipe). */
bool cli_stdout_finish(dipole_status *status);

/* Monotonic clock. */
double cli_now_s(void);

/*
 * Call first. SIGXFSZ and SIGPIPE are ignored, so that a full disk or a closed pipe is an error code.
 * SIGHUP, SIGINT and SIGTERM still end the program, whose status says so, but remove the temporary files of
 * io_file_write() before; where they were ignored they still are.
 */
void cli_start(void);

#endif
