/* One row: this program again, as a process of its own, so that no crash, full memory or hang of a row
 * touches the rest. */
#include "fit/batch_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* Most that a row may print: a fit block has a few thousand bytes. */
#define OUT_LIMIT ((size_t)1 << 20)

/* From SIGTERM, at which a row removes its temporary files, to SIGKILL. */
#define GRACE_S 5.0

/* Between the signal at which a row ends and that for the batch, if both are sent to. */
#define SIGNAL_GAP_S 5.0

/* ---- signals -------------------------------------------------------------------------------------- */

static volatile sig_atomic_t signal_number;

static void take_signal(int number)
{
    signal_number = number;
}

static const int ending_signals[] = { SIGHUP, SIGINT, SIGTERM };
enum { ENDING_COUNT = sizeof ending_signals / sizeof ending_signals[0] };

void batch_signals_take(void)
{
    for (size_t i = 0; i < ENDING_COUNT; i++) {
        struct sigaction action;
        /* One that is ignored stays so: nohup, and what a script starts in the background. */
        if (sigaction(ending_signals[i], NULL, &action) != 0 || action.sa_handler == SIG_IGN)
            continue;
        action = (struct sigaction){ .sa_handler = take_signal }; /* what waits is interrupted */
        sigemptyset(&action.sa_mask);
        sigaction(ending_signals[i], &action, NULL);
    }
}

int batch_signal(void)
{
    return signal_number;
}

void batch_signal_end(void)
{
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

/* ---- arguments ------------------------------------------------------------------------------------ */

struct arguments {
    char **values; /* ends with NULL, once something was added */
    size_t count, capacity;
    bool is_short_of_memory;
};

static void add(struct arguments *arguments, const char *format, ...) DIPOLE_PRINTF(2, 3);

static void add(struct arguments *arguments, const char *format, ...)
{
    if (arguments->count + 2 > arguments->capacity) {
        const size_t capacity = 2 * arguments->capacity + 16;
        char **const more = realloc((void *)arguments->values, capacity * sizeof *more);
        if (!more) {
            arguments->is_short_of_memory = true;
            return;
        }
        arguments->values = more;
        arguments->capacity = capacity;
    }
    char *text;
    va_list list;
    va_start(list, format);
    const bool is_made = vasprintf(&text, format, list) >= 0;
    va_end(list);
    if (!is_made) {
        arguments->is_short_of_memory = true;
        return;
    }
    arguments->values[arguments->count++] = text;
    arguments->values[arguments->count] = NULL;
}

static void arguments_free(struct arguments *arguments)
{
    for (size_t i = 0; i < arguments->count; i++)
        free(arguments->values[i]);
    free((void *)arguments->values);
}

/* Length of the part of a cell that begins at p. */
static size_t part_length(const char *p)
{
    return strcspn(p, (const char[]){ BATCH_SEPARATOR, '\0' });
}

static const char *next_part(const char *p)
{
    p += part_length(p);
    return p + (*p != '\0');
}

static void add_option(struct arguments *arguments, const struct batch_column *column, const char *cell)
{
    if (!batch_column_is_several(column)) {
        if (cell[0])
            add(arguments, "--%s=%s", column->name, cell);
        return;
    }
    for (const char *p = cell; *p; p = next_part(p))
        add(arguments, "--%s=%.*s", column->name, (int)part_length(p), p);
}

/* Values stand behind "=" and operands behind "--", so that none is taken for an option. */
static void collect(struct arguments *arguments, const struct cli_tool *tool, const struct batch_list *list,
                    const struct batch_row *row, const char *const *flags, size_t flag_count,
                    const char *output_path)
{
    const char *scene = "", *target = "", *cell = row->cells;
    add(arguments, "%s", tool->name);
    for (size_t i = 0; i < flag_count; i++)
        add(arguments, "%s", flags[i]);
    for (size_t i = 0; i < list->column_count; i++, cell += strlen(cell) + 1) {
        const struct batch_column *const column = &list->columns[i];
        if (column->kind == BATCH_SCENE)
            scene = cell;
        else if (column->kind == BATCH_TARGET)
            target = cell;
        else if (column->kind == BATCH_OPTION)
            add_option(arguments, column, cell);
    }
    add(arguments, "--" FIT_BATCH_FOLDER_OPTION "=%s", output_path);
    add(arguments, "--json");
    add(arguments, "--quiet");
    add(arguments, "--");
    for (; *scene && *target; scene = next_part(scene), target = next_part(target)) {
        add(arguments, "%.*s", (int)part_length(scene), scene);
        add(arguments, "%.*s", (int)part_length(target), target);
    }
}

/* ---- the process ---------------------------------------------------------------------------------- */

/* What it printed: the beginning of stdout and the end of stderr. */
struct printed {
    char *out;
    size_t out_length;
    bool is_long;
    char err[2048];
    size_t err_length;
};

/* In the new process: become the program. Only what is safe between fork and exec. */
static _Noreturn void become(char *const *argv, const char *folder, int out, int err, pid_t parent)
{
    for (size_t i = 0; i < ENDING_COUNT; i++) {
        struct sigaction action;
        if (sigaction(ending_signals[i], NULL, &action) == 0 && action.sa_handler == take_signal)
            signal(ending_signals[i], SIG_DFL);
    }
    /* Ctrl-C on a terminal reaches both; the batch ends its row by a signal that leaves nothing half-done
     */
    signal(SIGINT, SIG_IGN);
    /* not to outlive the batch, even where that is killed */
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (getppid() == parent && nothing >= 0 && dup2(nothing, STDIN_FILENO) >= 0 &&
        dup2(out, STDOUT_FILENO) >= 0 && dup2(err, STDERR_FILENO) >= 0 && chdir(folder) == 0)
        execv("/proc/self/exe", argv);
    const char *const reason = strerrordesc_np(errno);
    dprintf(err, "the program cannot be run: %s\n", reason ? reason : "unknown error");
    _exit(127);
}

static void close_both(int ends[2])
{
    close(ends[0]);
    close(ends[1]);
}

/* Start it; the ends to read from do not block. */
static bool start(char *const *argv, const char *folder, pid_t *child, int *out_end, int *err_end,
                  dipole_status *status)
{
    int out[2], err[2];
    const pid_t parent = getpid();
    const bool has_out = pipe2(out, O_CLOEXEC) == 0;
    const bool has_both = has_out && pipe2(err, O_CLOEXEC) == 0;
    *child = has_both ? fork() : -1;
    if (*child == 0)
        become(argv, folder, out[1], err[1], parent);
    const char *const reason = strerrordesc_np(errno);
    if (*child < 0) {
        if (has_out)
            close_both(out);
        if (has_both)
            close_both(err);
        return dipole_fail(status, DIPOLE_IO_FAILED, NULL, "no process can be made: %s",
                           reason ? reason : "unknown error");
    }
    close(out[1]);
    close(err[1]);
    fcntl(out[0], F_SETFL, O_NONBLOCK);
    fcntl(err[0], F_SETFL, O_NONBLOCK);
    *out_end = out[0];
    *err_end = err[0];
    return true;
}

static void keep_out(struct printed *printed, const char *piece, size_t size)
{
    const size_t room = OUT_LIMIT - printed->out_length;
    printed->is_long = printed->is_long || size > room;
    const size_t kept = size < room ? size : room;
    memcpy(printed->out + printed->out_length, piece, kept);
    printed->out_length += kept;
}

static void keep_err(struct printed *printed, const char *piece, size_t size)
{
    const size_t limit = sizeof printed->err;
    if (size > limit) {
        piece += size - limit;
        size = limit;
    }
    const size_t room = limit - printed->err_length, lost = size > room ? size - room : 0;
    memmove(printed->err, printed->err + lost, printed->err_length - lost);
    memcpy(printed->err + printed->err_length - lost, piece, size);
    printed->err_length += size - lost;
}

/* Take what there is to be read; the end is closed, and then -1, when nothing more will come. */
static void drain(int *end, struct printed *printed,
                  void (*keep)(struct printed *printed, const char *piece, size_t size))
{
    char piece[4096];
    while (*end >= 0) {
        const ssize_t count = read(*end, piece, sizeof piece);
        if (count > 0) {
            keep(printed, piece, (size_t)count);
        } else if (count < 0 && errno == EINTR) {
            continue;
        } else if (count < 0 && errno == EAGAIN) {
            return;
        } else {
            close(*end);
            *end = -1;
        }
    }
}

/* Why it was told to end. */
enum ending { ENDING_NONE = 0, ENDING_SIGNAL, ENDING_TIME };

/*
 * Whether a row was ended by a signal that is meant for the batch, too: terminals and Slurm signal one
 * process after another, and the row may hear of it, and end, before the batch does.
 */
static bool is_ended_from_outside(int state)
{
    bool is_ending = false;
    for (size_t i = 0; i < ENDING_COUNT; i++)
        is_ending = is_ending || (WIFSIGNALED(state) && WTERMSIG(state) == ending_signals[i]);
    const double start_s = cli_now_s();
    while (is_ending && !batch_signal() && cli_now_s() - start_s < SIGNAL_GAP_S)
        poll(NULL, 0, 10);
    return is_ending && batch_signal();
}

/* Wait for the process, not for others that may still hold its stdout. Returns its state for WIFEXITED. */
static int follow(pid_t child, int out, int err, double row_seconds, struct printed *printed,
                  enum ending *ending)
{
    const double start_s = cli_now_s();
    double kill_s = 0;
    int state = 0;
    *ending = ENDING_NONE;
    for (;;) {
        const double now_s = cli_now_s();
        if (*ending != ENDING_NONE) {
            if (now_s > kill_s)
                kill(child, SIGKILL);
        } else if (batch_signal() || (row_seconds > 0 && now_s - start_s > row_seconds)) {
            *ending = batch_signal() ? ENDING_SIGNAL : ENDING_TIME;
            kill_s = now_s + GRACE_S;
            kill(child, SIGTERM);
        }
        struct pollfd ends[2] = { { .fd = out, .events = POLLIN }, { .fd = err, .events = POLLIN } };
        poll(ends, 2, out < 0 && err < 0 ? 2 : 100); /* what is closed is left out */
        const bool is_over = waitpid(child, &state, WNOHANG) == child;
        drain(&out, printed, keep_out);
        drain(&err, printed, keep_err);
        if (is_over)
            break;
    }
    if (out >= 0)
        close(out);
    if (err >= 0)
        close(err);
    if (*ending == ENDING_NONE && is_ended_from_outside(state))
        *ending = ENDING_SIGNAL;
    return state;
}

/* ---- the outcome ---------------------------------------------------------------------------------- */

/* The last line on stderr, without the program's name: UTF-8, no control characters. */
static void last_line(const struct printed *printed, const char *tool_name, char *out, size_t size)
{
    size_t end = printed->err_length;
    while (end > 0 && strchr("\r\n", printed->err[end - 1]))
        end--;
    size_t start = end;
    while (start > 0 && printed->err[start - 1] != '\n')
        start--;
    const size_t name = strlen(tool_name);
    if (end - start > name + 2 && memcmp(printed->err + start, tool_name, name) == 0 &&
        memcmp(printed->err + start + name, ": ", 2) == 0)
        start += name + 2;
    size_t length = 0;
    for (size_t i = start; i < end && length + 1 < size; i++) {
        const unsigned char c = (unsigned char)printed->err[i];
        out[length++] = c < 0x20 || c == 0x7f ? '?' : printed->err[i];
    }
    out[length] = '\0';
    json_t *const text = json_stringn(out, length);
    for (size_t i = 0; i < length && !text; i++) /* no UTF-8 */
        if ((unsigned char)out[i] >= 0x80)
            out[i] = '?';
    json_decref(text);
}

static void judge(const struct printed *printed, int state, enum ending ending, double row_seconds,
                  const char *tool_name, struct batch_outcome *outcome)
{
    char line[sizeof outcome->message - 64];
    last_line(printed, tool_name, line, sizeof line);
    const bool was_killed = WIFSIGNALED(state);
    outcome->exit_code = was_killed ? 128 + WTERMSIG(state) : WEXITSTATUS(state);
    outcome->fit = printed->is_long ? NULL : json_loadb(printed->out, printed->out_length, 0, NULL);
    if (!json_is_object(outcome->fit)) {
        json_decref(outcome->fit);
        outcome->fit = NULL;
    }
    outcome->is_done = outcome->exit_code == 0 && outcome->fit;
    outcome->is_interrupted = ending == ENDING_SIGNAL && !outcome->is_done;
    char *const message = outcome->message;
    const size_t size = sizeof outcome->message;
    if (outcome->is_done)
        message[0] = '\0';
    else if (ending == ENDING_TIME)
        snprintf(message, size, "took more than %g s and was ended", row_seconds);
    else if (was_killed)
        snprintf(message, size, "was ended by signal %d (%s)%s%s", WTERMSIG(state),
                 sigabbrev_np(WTERMSIG(state)) ? sigabbrev_np(WTERMSIG(state)) : "unknown",
                 line[0] ? ": " : "", line);
    else if (outcome->exit_code == 0)
        snprintf(message, size, "printed %s", printed->is_long ? "too much" : "no result");
    else if (line[0])
        snprintf(message, size, "%s", line);
    else
        snprintf(message, size, "ended with exit code %d and no message", outcome->exit_code);
}

bool batch_row_run(const struct cli_tool *tool, const struct batch_list *list, const struct batch_row *row,
                   const char *const *flags, size_t flag_count, const char *output_path, double row_seconds,
                   struct batch_outcome *outcome, dipole_status *status)
{
    *outcome = (struct batch_outcome){ 0 };
    struct arguments arguments = { 0 };
    struct printed printed = { .out = malloc(OUT_LIMIT) };
    collect(&arguments, tool, list, row, flags, flag_count, output_path);
    pid_t child = -1;
    int out = -1, err = -1;
    bool done = printed.out && !arguments.is_short_of_memory;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to run a row");
    const double start_s = cli_now_s();
    done = done && start(arguments.values, list->folder, &child, &out, &err, status);
    if (done) {
        enum ending ending;
        const int state = follow(child, out, err, row_seconds, &printed, &ending);
        outcome->seconds = cli_now_s() - start_s;
        judge(&printed, state, ending, row_seconds, tool->name, outcome);
    }
    arguments_free(&arguments);
    free(printed.out);
    return done;
}
