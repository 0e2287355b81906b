/* Run a program of ours as a user does: what it printed and how it ended. */
#ifndef RUN_TOOL_H
#define RUN_TOOL_H

#include "tests/check.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

struct tool_run {
    int exit_code; /* -1 when a signal ended it */
    char *out;     /* stdout; run_tool frees what was there before */
    char err[8192];
};

static inline size_t read_pipe(int pipe_end, char *out, size_t size)
{
    size_t count = 0;
    for (ssize_t got = 1; got > 0 && count + 1 < size; count += (size_t)(got > 0 ? got : 0))
        got = read(pipe_end, out + count, size - 1 - count);
    out[count] = '\0';
    close(pipe_end);
    return count;
}

/* Files of the program may grow to file_limit bytes (0: any size), as on a full disk. arguments end with
 * NULL. */
static inline void run_tool_limited(struct tool_run *run, size_t file_limit, const char *tool,
                                    const char *const *arguments)
{
    enum { OUT_LIMIT = 4 << 20 };
    char program[4096];
    const char *argv[128] = { program };
    for (size_t i = 0; arguments[i]; i++) {
        assert_true(i + 2 < sizeof argv / sizeof *argv);
        argv[i + 1] = arguments[i];
    }
    snprintf(program, sizeof program, PROGRAM_FOLDER "/%s", tool);
    int out[2], err[2];
    assert_int_equal(pipe(out) | pipe(err), 0);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct rlimit limit = { .rlim_cur = file_limit, .rlim_max = file_limit };
        if (file_limit > 0)
            setrlimit(RLIMIT_FSIZE, &limit);
        dup2(out[1], STDOUT_FILENO);
        dup2(err[1], STDERR_FILENO);
        close(out[0]);
        close(err[0]);
        close(out[1]);
        close(err[1]);
        execv(program, (char *const *)(const void *)argv);
        _exit(127);
    }
    close(out[1]);
    close(err[1]);
    free(run->out);
    run->out = malloc(OUT_LIMIT);
    assert_non_null(run->out);
    read_pipe(out[0], run->out, OUT_LIMIT);
    read_pipe(err[0], run->err, sizeof run->err); /* fits into the pipe while stdout is read */
    int state = 0;
    assert_int_equal(waitpid(child, &state, 0), child);
    run->exit_code = WIFEXITED(state) ? WEXITSTATUS(state) : -1;
}

#define run_tool(run, tool, ...) run_tool_limited(run, 0, tool, (const char *const[]){ __VA_ARGS__, NULL })

/* Exit code and the whole of stderr; nothing on stdout when it failed. */
static inline void assert_failed(const struct tool_run *run, int exit_code, const char *err)
{
    assert_string_equal(run->err, err);
    assert_int_equal(run->exit_code, exit_code);
    assert_string_equal(run->out, "");
}

static inline void assert_done(const struct tool_run *run)
{
    assert_string_equal(run->err, "");
    assert_int_equal(run->exit_code, 0);
}

/* Set up and tear down: each test works in an empty folder of its own. */
static inline int enter_empty_folder(void **state)
{
    (void)state;
    return system("rm -rf empty && mkdir empty") == 0 ? chdir("empty") : -1;
}

static inline int leave_folder(void **state)
{
    (void)state;
    return chdir("..");
}

#define tool_test(f) cmocka_unit_test_setup_teardown(f, enter_empty_folder, leave_folder)

static inline void write_text(const char *path, const char *text)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

/* Entries of a folder, hidden ones included; -1 when it does not exist. */
static inline int count_entries(const char *path)
{
    DIR *const folder = opendir(path);
    if (!folder)
        return -1;
    int count = -2; /* . and .. */
    while (readdir(folder))
        count++;
    closedir(folder);
    return count;
}

#endif
