#include "cli/cli.h"

#include "io/file.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { MAX_OPTIONS = 64, WIDTH = 80, HELP_COLUMN = 26 };

/* The options of a tool followed by those that every tool has. */
struct table {
    const struct cli_tool *tool;
    struct cli_option rows[MAX_OPTIONS];
    int count;
    bool is_help, is_version, is_man;
};

static void table_init(struct table *table, const struct cli_tool *tool, struct cli_common *common)
{
    const struct cli_option shared[] = {
        { .name = "json", .target = &common->json, .help = "Print the result as JSON on stdout." },
        { .name = "quiet",
          .letter = 'q',
          .target = &common->quiet,
          .help = "Print no progress and no notes." },
        { .name = "help", .letter = 'h', .target = &table->is_help, .help = "Print this text." },
        { .name = "version", .target = &table->is_version, .help = "Print the version." },
        { .name = "man", .target = &table->is_man, .help = "Print the man page, as roff." },
    };
    *table = (struct table){ .tool = tool };
    for (const struct cli_option *row = tool->options; row && row->name; row++)
        if (table->count < MAX_OPTIONS)
            table->rows[table->count++] = *row;
    for (size_t i = 0; i < sizeof shared / sizeof shared[0]; i++)
        if (table->count < MAX_OPTIONS)
            table->rows[table->count++] = shared[i];
}

/* ---- --help and --man ----------------------------------------------------------------------------- */

/* Print words from column on, broken at WIDTH, continued at indent; ends the line. */
static void print_wrapped(const char *text, size_t length, int column, int indent)
{
    bool is_line_start = true;
    for (const char *p = text, *end = text + length; p < end;) {
        size_t word = 0;
        while (p + word < end && p[word] != ' ')
            word++;
        if (!is_line_start && column + 1 + (int)word >= WIDTH) {
            printf("\n%*s", indent, "");
            column = indent;
            is_line_start = true;
        }
        if (word > 0) {
            column += printf("%s%.*s", is_line_start ? "" : " ", (int)word, p);
            is_line_start = false;
        }
        p += word;
        while (p < end && *p == ' ')
            p++;
    }
    putchar('\n');
}

static void print_help_row(const struct cli_option *row)
{
    int column =
        row->letter ? printf("  -%c, --%s", row->letter, row->name) : printf("      --%s", row->name);
    if (row->argument)
        column += printf(" %s", row->argument);
    if (column > HELP_COLUMN - 2) {
        putchar('\n');
        column = 0;
    }
    printf("%*s", HELP_COLUMN - column, "");
    print_wrapped(row->help, strlen(row->help), HELP_COLUMN, HELP_COLUMN);
}

static void print_help(const struct table *table)
{
    const struct cli_tool *tool = table->tool;
    const char *lead = "usage:";
    for (const char *line = tool->usage; *line; lead = "      ") {
        const size_t length = strcspn(line, "\n");
        const int column = printf("%s %s ", lead, tool->name);
        print_wrapped(line, length, column, column);
        line += length + (line[length] == '\n');
    }
    putchar('\n');
    print_wrapped(tool->summary, strlen(tool->summary), 0, 0);
    printf("\nOptions:\n");
    for (int i = 0; i < table->count; i++)
        print_help_row(&table->rows[i]);
    if (!tool->details)
        return;
    putchar('\n');
    for (const char *line = tool->details; *line;) {
        const size_t length = strcspn(line, "\n");
        if (line[0] == ' ') /* an example, kept as it is */
            printf("%.*s\n", (int)length, line);
        else
            print_wrapped(line, length, 0, 0);
        line += length + (line[length] == '\n');
    }
}

/* Text for roff: no character of it is an escape or a request. */
static void print_roff(const char *text, size_t length)
{
    if (length > 0 && (text[0] == '.' || text[0] == '\''))
        printf("\\&");
    for (size_t i = 0; i < length; i++) {
        if (text[i] == '\\')
            printf("\\e");
        else if (text[i] == '-')
            printf("\\-");
        else
            putchar(text[i]);
    }
}

static void print_roff_line(const char *text)
{
    print_roff(text, strlen(text));
    putchar('\n');
}

static void print_man(const struct table *table)
{
    const struct cli_tool *tool = table->tool;
    printf(".TH ");
    for (const char *p = tool->name; *p; p++)
        putchar(toupper((unsigned char)*p));
    printf(" 1 \"\" \"libdipole %s\" \"User Commands\"\n.SH NAME\n", dipole_version());
    print_roff(tool->name, strlen(tool->name));
    printf(" \\- ");
    print_roff_line(tool->summary);
    printf(".SH SYNOPSIS\n");
    for (const char *line = tool->usage; *line;) {
        const size_t length = strcspn(line, "\n");
        printf("%s.B ", line == tool->usage ? "" : ".br\n");
        print_roff_line(tool->name);
        print_roff(line, length);
        putchar('\n');
        line += length + (line[length] == '\n');
    }
    printf(".SH OPTIONS\n");
    for (int i = 0; i < table->count; i++) {
        const struct cli_option *row = &table->rows[i];
        printf(".TP\n");
        if (row->letter)
            printf("\\fB\\-%c\\fR, ", row->letter);
        printf("\\fB\\-\\-");
        print_roff(row->name, strlen(row->name));
        printf("\\fR");
        if (row->argument) {
            printf(" \\fI");
            print_roff(row->argument, strlen(row->argument));
            printf("\\fR");
        }
        putchar('\n');
        print_roff_line(row->help);
    }
    if (tool->details)
        printf(".SH DETAILS\n");
    bool is_example = false;
    for (const char *line = tool->details; line && *line;) {
        const size_t length = strcspn(line, "\n");
        if ((line[0] == ' ') != is_example) {
            is_example = !is_example;
            printf(is_example ? ".nf\n" : ".fi\n");
        }
        if (length == 0)
            printf(".PP\n");
        else {
            print_roff(line, length);
            putchar('\n');
        }
        line += length + (line[length] == '\n');
    }
    if (is_example)
        printf(".fi\n");
    printf(".SH EXIT STATUS\n0 done, 1 failed, 2 wrong usage.\n");
}

/* ---- values --------------------------------------------------------------------------------------- */

static void print_usage_error(const struct table *table, const char *format, ...) DIPOLE_PRINTF(2, 3);

static void print_usage_error(const struct table *table, const char *format, ...)
{
    char message[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    fprintf(stderr, "%s: %s\n", table->tool->name, message);
}

/* "1e-06 to 0.5": what an option's numbers may be. */
static const char *range_text(const struct cli_option *row, char out[96])
{
    if (isinf(row->max))
        snprintf(out, 96, ">= %g", row->min);
    else if (isinf(row->min))
        snprintf(out, 96, "<= %g", row->max);
    else
        snprintf(out, 96, "%.10g to %.10g", row->min, row->max);
    return out;
}

/* A whole string as a decimal number, whatever the locale. */
static bool parse_number(const char *text, size_t length, double *out)
{
    char buffer[128];
    if (length == 0 || length >= sizeof buffer || strspn(text, "0123456789+-.eE") < length)
        return false;
    memcpy(buffer, text, length);
    buffer[length] = '\0';
    const locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!c_locale)
        return false;
    char *end;
    const double value = strtod_l(buffer, &end, c_locale);
    freelocale(c_locale);
    if (*end != '\0' || !isfinite(value))
        return false;
    *out = value;
    return true;
}

static bool store_number(const struct cli_option *row, const char *text, size_t length, double *out)
{
    double value;
    if (!parse_number(text, length, &value) || !(value >= row->min && value <= row->max))
        return false;
    *out = value;
    return true;
}

/* Two whole numbers; with is_pair false one alone stands for both. */
static bool store_integers(const struct cli_option *row, const char *text, char separator, bool is_pair,
                           int out[2])
{
    const char *split = strchr(text, separator);
    if (is_pair && !split)
        return false;
    const size_t length = split ? (size_t)(split - text) : strlen(text);
    const char *second = split ? split + 1 : text;
    double low, high;
    if (!store_number(row, text, length, &low) || !store_number(row, second, strlen(second), &high))
        return false;
    if (low != floor(low) || high != floor(high) || fabs(low) > INT_MAX || fabs(high) > INT_MAX)
        return false;
    out[0] = (int)low;
    out[1] = (int)high;
    return true;
}

/* Say what the choices are; false. */
static bool print_choices(const struct table *table, const struct cli_option *row, const char *text)
{
    char expected[512] = "";
    size_t length = 0;
    for (int i = 0; row->choices[i]; i++) {
        const int count = snprintf(expected + length, sizeof expected - length, "%s%s", i > 0 ? ", " : "",
                                   row->choices[i]);
        if (count > 0 && length + (size_t)count < sizeof expected)
            length += (size_t)count;
    }
    print_usage_error(table, "--%s is \"%.100s\", expected one of %s%s", row->name, text, expected,
                      row->kind == CLI_CHOICES ? ", or several with commas between" : "");
    return false;
}

static bool store_choice(const struct table *table, const struct cli_option *row, const char *text)
{
    for (int i = 0; row->choices[i]; i++)
        if (strcmp(text, row->choices[i]) == 0) {
            *(int *)row->target = i;
            return true;
        }
    return print_choices(table, row, text);
}

static bool store_choices(const struct table *table, const struct cli_option *row, const char *text)
{
    unsigned chosen = 0;
    for (const char *p = text;; p++) {
        const size_t length = strcspn(p, ",");
        int i = 0;
        while (row->choices[i] &&
               (strlen(row->choices[i]) != length || strncmp(row->choices[i], p, length) != 0))
            i++;
        if (!row->choices[i]) {
            char name[101];
            snprintf(name, sizeof name, "%.*s", (int)(length < 100 ? length : 100), p);
            return print_choices(table, row, name);
        }
        chosen |= 1U << i;
        p += length;
        if (*p == '\0')
            break;
    }
    *(unsigned *)row->target = chosen;
    return true;
}

static bool store_numbers(const struct table *table, const struct cli_option *row, const char *text)
{
    struct cli_numbers *numbers = row->target;
    char range[96];
    numbers->count = 0;
    for (const char *p = text;; p++) {
        const size_t length = strcspn(p, ",");
        if (numbers->count == sizeof numbers->values / sizeof numbers->values[0]) {
            print_usage_error(table, "--%s has more than %zu numbers", row->name, numbers->count);
            return false;
        }
        if (!store_number(row, p, length, &numbers->values[numbers->count])) {
            print_usage_error(table, "--%s has \"%.*s\", expected numbers %s with commas between",
                              row->name, (int)(length < 100 ? length : 100), p, range_text(row, range));
            return false;
        }
        numbers->count++;
        p += length;
        if (*p == '\0')
            return true;
    }
}

/* Put the text of an option where its row says; what is wrong goes to stderr. */
static bool store(const struct table *table, const struct cli_option *row, const char *text)
{
    char range[96];
    if (row->kind == CLI_FLAG) { /* alone in having no text */
        *(bool *)row->target = true;
        return true;
    }
    if (text[0] == '\0') {
        print_usage_error(table, "--%s is empty, expected %s", row->name, row->argument);
        return false;
    }
    switch (row->kind) {
    case CLI_FLAG:
        break;
    case CLI_TEXT:
        *(const char **)row->target = text;
        return true;
    case CLI_NUMBER:
        if (store_number(row, text, strlen(text), row->target))
            return true;
        print_usage_error(table, "--%s is \"%.100s\", expected a number %s", row->name, text,
                          range_text(row, range));
        return false;
    case CLI_CHOICE:
        return store_choice(table, row, text);
    case CLI_CHOICES:
        return store_choices(table, row, text);
    case CLI_SIZE:
        if (store_integers(row, text, 'x', true, row->target))
            return true;
        print_usage_error(table, "--%s is \"%.100s\", expected WIDTHxHEIGHT, each %s", row->name, text,
                          range_text(row, range));
        return false;
    case CLI_RANGE: {
        int values[2];
        if (store_integers(row, text, ':', false, values) && values[0] <= values[1]) {
            memcpy(row->target, values, sizeof values);
            return true;
        }
        print_usage_error(table, "--%s is \"%.100s\", expected FIRST:LAST or one number, each %s",
                          row->name, text, range_text(row, range));
        return false;
    }
    case CLI_NUMBERS:
        return store_numbers(table, row, text);
    case CLI_TEXTS: {
        struct cli_texts *texts = row->target;
        if (texts->count == sizeof texts->values / sizeof texts->values[0]) {
            print_usage_error(table, "--%s is given more than %zu times", row->name, texts->count);
            return false;
        }
        texts->values[texts->count++] = text;
        return true;
    }
    }
    return false;
}

/* ---- parsing -------------------------------------------------------------------------------------- */

/* What getopt returns for row i: its letter, or a number above all letters. */
enum { FIRST_CODE = 256 };

static int row_of_code(const struct table *table, int code)
{
    for (int i = 0; i < table->count; i++)
        if (code == FIRST_CODE + i || (table->rows[i].letter && code == table->rows[i].letter))
            return i;
    return -1;
}

static void print_option_error(const struct table *table, int problem, const char *argument)
{
    const int i = row_of_code(table, optopt);
    const struct cli_option *row = i >= 0 ? &table->rows[i] : NULL;
    const char *tool = table->tool->name;
    if (problem == ':' && row)
        print_usage_error(table, "--%s has no value, expected --%s %s", row->name, row->name,
                          row->argument);
    else if (row)
        print_usage_error(table, "--%s takes no value, found \"%.100s\"", row->name, argument);
    else if (optopt > 0 && optopt < FIRST_CODE)
        print_usage_error(table, "unknown option -%c, expected one that %s --help lists", optopt, tool);
    else
        print_usage_error(table, "unknown or ambiguous option %.100s, expected one that %s --help lists",
                          argument, tool);
}

static bool check_operand_count(const struct table *table, int count)
{
    const struct cli_tool *tool = table->tool;
    if (count >= tool->operand_min && count <= tool->operand_max)
        return true;
    const int usage_length = (int)strcspn(tool->usage, "\n");
    char expected[64];
    if (tool->operand_max == INT_MAX)
        snprintf(expected, sizeof expected, "at least %d", tool->operand_min);
    else if (tool->operand_min == tool->operand_max)
        snprintf(expected, sizeof expected, "%d", tool->operand_min);
    else
        snprintf(expected, sizeof expected, "%d to %d", tool->operand_min, tool->operand_max);
    print_usage_error(table, "%d operand%s, expected %s: %s %.*s", count, count == 1 ? "" : "s", expected,
                      tool->name, usage_length, tool->usage);
    return false;
}

enum cli_outcome cli_parse(const struct cli_tool *tool, int argc, char **argv, struct cli_common *common,
                           char ***operands, int *operand_count)
{
    struct table table;
    *common = (struct cli_common){ 0 };
    table_init(&table, tool, common);

    struct option long_options[MAX_OPTIONS + 1] = { 0 };
    char letters[2 * MAX_OPTIONS + 2] = ":";
    char *letter = letters + 1;
    for (int i = 0; i < table.count; i++) {
        const struct cli_option *row = &table.rows[i];
        long_options[i] =
            (struct option){ .name = row->name,
                             .has_arg = row->kind == CLI_FLAG ? no_argument : required_argument,
                             .val = FIRST_CODE + i };
        if (row->letter) {
            *letter++ = row->letter;
            if (row->kind != CLI_FLAG)
                *letter++ = ':';
        }
    }

    opterr = 0;
    optind = 0; /* getopt starts anew */
    for (;;) {
        const int code = getopt_long(argc, argv, letters, long_options, NULL);
        if (code == -1)
            break;
        if (code == '?' || code == ':') {
            print_option_error(&table, code, argv[optind - 1]);
            return CLI_STOP_USAGE;
        }
        if (!store(&table, &table.rows[row_of_code(&table, code)], optarg))
            return CLI_STOP_USAGE;
        if (table.is_help)
            print_help(&table);
        else if (table.is_version)
            printf("%s (libdipole) %s\n", tool->name, dipole_version());
        else if (table.is_man)
            print_man(&table);
        else
            continue;
        return CLI_STOP_DONE;
    }
    *operands = argv + optind;
    *operand_count = argc - optind;
    return check_operand_count(&table, *operand_count) ? CLI_RUN : CLI_STOP_USAGE;
}

/* ---- reports -------------------------------------------------------------------------------------- */

int cli_report(const struct cli_tool *tool, const dipole_status *status, enum cli_exit code)
{
    char place[sizeof status->source + 32] = "";
    if (status->source[0] && status->line > 0)
        snprintf(place, sizeof place, "%s:%d:%d: ", status->source, status->line, status->column);
    else if (status->source[0])
        snprintf(place, sizeof place, "%s: ", status->source);
    fprintf(stderr, "%s: %s%s\n", tool->name, place, status->message);
    return (int)code;
}

void cli_note(const struct cli_tool *tool, const struct cli_common *common, const char *format, ...)
{
    if (common->quiet)
        return;
    char message[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    fprintf(stderr, "%s: note: %s\n", tool->name, message);
}

bool cli_stdout_finish(dipole_status *status)
{
    const bool is_lost = ferror(stdout);
    errno = 0;
    if (fflush(stdout) == 0 && !is_lost)
        return true;
    const char *reason = errno ? strerrordesc_np(errno) : NULL;
    const dipole_place place = { .source = "stdout" };
    return dipole_fail(status, DIPOLE_IO_FAILED, &place, "cannot be written: %s",
                       reason ? reason : "some of the output was lost");
}

/*
 * Leave no half-written file, then end as the signal would have ended the program without us. On the main
 * thread, which writes the files: one that it is about to make is then not made any more.
 */
static void end_by_signal(int number)
{
    if (gettid() != getpid()) {
        tgkill(getpid(), getpid(), number);
        return;
    }
    io_file_remove_temporaries();
    signal(number, SIG_DFL);
    sigset_t numbers;
    sigemptyset(&numbers);
    sigaddset(&numbers, number);
    sigprocmask(SIG_UNBLOCK, &numbers, NULL);
    raise(number);
}

void cli_start(void)
{
    static const int numbers[] = { SIGHUP, SIGINT, SIGTERM };
    signal(SIGXFSZ, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        struct sigaction action = { 0 };
        /* One that is ignored stays so: nohup, and what a script starts in the background. */
        if (sigaction(numbers[i], NULL, &action) != 0 || action.sa_handler == SIG_IGN)
            continue;
        action = (struct sigaction){ .sa_handler = end_by_signal, .sa_flags = SA_RESTART };
        sigfillset(&action.sa_mask); /* one of them at a time */
        sigaction(numbers[i], &action, NULL);
    }
}

/* ---- progress ------------------------------------------------------------------------------------- */

double cli_now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void cli_progress_start(struct cli_progress *progress, const struct cli_tool *tool,
                        const struct cli_common *common)
{
    *progress = (struct cli_progress){ .tool = tool,
                                       .is_shown = !common->quiet && isatty(STDERR_FILENO),
                                       .start_s = cli_now_s() };
}

void cli_progress_show(struct cli_progress *progress, const char *what, double fraction)
{
    if (!progress->is_shown)
        return;
    const double now_s = cli_now_s();
    if (fraction <= 0.0)
        progress->start_s = now_s;
    if (fraction >= 1.0) {
        fprintf(stderr, "\r%*s\r", WIDTH - 1, "");
        return;
    }
    if (fraction > 0.0 && now_s - progress->shown_s < 0.1) /* a terminal is slow, and so is the reader */
        return;
    progress->shown_s = now_s;
    const double elapsed_s = now_s - progress->start_s;
    char line[WIDTH], left[32] = "";
    if (fraction > 0.0 && elapsed_s > 1.0)
        snprintf(left, sizeof left, " (%.0f s left)", elapsed_s * (1.0 - fraction) / fraction);
    snprintf(line, sizeof line, "%s: %s %.0f %%%s", progress->tool->name, what, 100.0 * fraction, left);
    fprintf(stderr, "\r%-*s", WIDTH - 1, line);
}
