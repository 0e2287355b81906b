#include "tests/check.h"

#include "cli/cli.h"

#include <fcntl.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- a tool that has every kind of option ---------------------------------------------------------- */

static struct {
    bool deep;
    const char *out;
    double epsilon;
    int technique;
    unsigned formats;
    int size[2], frames[2];
    struct cli_numbers at;
    struct cli_texts allow;
} values;

static const char *const techniques[] = { "auto", "splat", "gather", NULL };
static const char *const formats[] = { "exr", "dds", "raw", "exr2", NULL };
static const struct cli_option options[] = {
    { .name = "deep", .letter = 'd', .target = &values.deep, .help = "Go deep." },
    { .name = "out",
      .letter = 'o',
      .kind = CLI_TEXT,
      .target = &values.out,
      .argument = "FILE",
      .help = "Where to." },
    { .name = "epsilon",
      .kind = CLI_NUMBER,
      .target = &values.epsilon,
      .argument = "E",
      .min = 1e-6,
      .max = 0.5,
      .help =
          "Relative error, from one in a million to a half, that is asked for (default 0.01, no unit)." },
    { .name = "technique",
      .kind = CLI_CHOICE,
      .target = &values.technique,
      .argument = "auto|splat|gather",
      .choices = techniques,
      .help = "How." },
    { .name = "format",
      .letter = 'f',
      .kind = CLI_CHOICES,
      .target = &values.formats,
      .argument = "FORMAT,...",
      .choices = formats,
      .help = "As what." },
    { .name = "size",
      .kind = CLI_SIZE,
      .target = values.size,
      .argument = "WxH",
      .min = 1,
      .max = 16384,
      .help = "Pixels." },
    { .name = "frames",
      .kind = CLI_RANGE,
      .target = values.frames,
      .argument = "A:B",
      .min = 0,
      .max = 9999,
      .help = "Frames." },
    { .name = "at",
      .kind = CLI_NUMBERS,
      .target = &values.at,
      .argument = "R,R",
      .min = 0.0,
      .max = INFINITY,
      .help = "Distances in mm." },
    { .name = "allow", .kind = CLI_TEXTS, .target = &values.allow, .argument = "FOLDER", .help = "More." },
    { 0 },
};
static const struct cli_tool tool = {
    .name = "tool",
    .summary = "Does .things and 'more' - or not",
    .usage = "FILE [OPTIONS]\n--old FILE",
    .details =
        "First paragraph of what there is to know about this tool, long enough that it must be broken.\n\n"
        "  tool --epsilon 0.1 x.json\n\nLast \\one.",
    .options = options,
    .operand_min = 1,
    .operand_max = 2,
};

/* Run the tool as a process would; what it prints and its exit code are left here. */
static char out_text[8192], err_text[8192];

static void read_text(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "r");
    text[fread(text, 1, size - 1, file)] = '\0';
    fclose(file);
}

static int in_child(void (*work)(void))
{
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        alarm(60); /* ends a child that waits for ever */
        dup2(open("out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
        dup2(open("err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
        work();
    }
    int result;
    waitpid(child, &result, 0);
    read_text("out.txt", out_text, sizeof out_text);
    read_text("err.txt", err_text, sizeof err_text);
    return WIFEXITED(result) ? WEXITSTATUS(result) : -1;
}

static char *arguments[32];
static int argument_count;

static enum cli_outcome parse(struct cli_common *common, char ***operands, int *operand_count)
{
    memset(&values, 0, sizeof values);
    return cli_parse(&tool, argument_count, arguments, common, operands, operand_count);
}

static void set_arguments(const char *line)
{
    static char buffer[1024];
    snprintf(buffer, sizeof buffer, "tool %s", line);
    argument_count = 0;
    for (char *word = strtok(buffer, " "); word; word = strtok(NULL, " "))
        arguments[argument_count++] = word;
    arguments[argument_count] = NULL;
}

static void run(void)
{
    struct cli_common common;
    char **operands;
    int operand_count;
    const enum cli_outcome outcome = parse(&common, &operands, &operand_count);
    fflush(stdout);
    _exit(outcome == CLI_RUN ? 77 : outcome == CLI_STOP_DONE ? EXIT_DONE : EXIT_USAGE);
}

/* ---- what is right --------------------------------------------------------------------------------- */

/* Oracle: the values on the command line. */
static void values_arrive(void **state)
{
    (void)state;
    struct cli_common common;
    char **operands;
    int count;
    set_arguments("a.json -do x.exr --epsilon=2.5e-3 --technique splat --size 800x600 --frames 3:17 --at "
                  "0,.5,1e2 --allow p --allow=q --json -q b.json");
    assert_int_equal(parse(&common, &operands, &count), CLI_RUN);
    assert_true(values.deep && common.json && common.quiet);
    assert_string_equal(values.out, "x.exr");
    assert_true(values.epsilon == 2.5e-3);
    assert_int_equal(values.technique, 1);
    assert_true(values.size[0] == 800 && values.size[1] == 600);
    assert_true(values.frames[0] == 3 && values.frames[1] == 17);
    assert_int_equal(values.at.count, 3);
    assert_true(values.at.values[0] == 0.0 && values.at.values[1] == 0.5 && values.at.values[2] == 100.0);
    assert_int_equal(values.allow.count, 2);
    assert_string_equal(values.allow.values[1], "q");
    assert_int_equal(count, 2);
    assert_string_equal(operands[0], "a.json");
    assert_string_equal(operands[1], "b.json");

    set_arguments("--frames 5 -- --deep");
    assert_int_equal(parse(&common, &operands, &count), CLI_RUN);
    assert_true(values.frames[0] == 5 && values.frames[1] == 5 && !values.deep && !common.json &&
                !common.quiet);
    assert_string_equal(operands[0], "--deep");
}

/* Oracle: a bit for each name, whatever their order; of an option that is repeated the last counts. */
static void choices_are_bits(void **state)
{
    (void)state;
    static const struct {
        const char *arguments;
        unsigned formats;
    } cases[] = {
        { "x", 0 },
        { "x --format exr", 1 },
        { "x --format raw", 4 },
        { "x -f raw,exr", 5 },
        { "x -fdds,exr2,exr,raw", 15 },
        { "x --format=exr2", 8 }, /* not "exr", with which it begins */
        { "x --format=dds,dds,dds", 2 },
        { "x --format exr,dds --format raw", 4 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct cli_common common;
        char **operands;
        int count;
        set_arguments(cases[i].arguments);
        assert_int_equal(parse(&common, &operands, &count), CLI_RUN);
        assert_int_equal(values.formats, cases[i].formats);
    }
}

/* Oracle: a locale with decimal commas changes nothing. */
static void numbers_do_not_follow_the_locale(void **state)
{
    (void)state;
    struct cli_common common;
    char **operands;
    int count;
    if (!setlocale(LC_ALL, "de_DE.UTF-8"))
        skip();
    set_arguments("x --epsilon 0.25");
    const enum cli_outcome outcome = parse(&common, &operands, &count);
    setlocale(LC_ALL, "C");
    assert_int_equal(outcome, CLI_RUN);
    assert_true(values.epsilon == 0.25);
}

/* ---- what is wrong --------------------------------------------------------------------------------- */

/* Oracle: exit code 2, nothing on stdout, and one line as a user should read it. */
static void wrong_usage_is_one_line_and_code_2(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *message;
    } cases[] = {
        { "", "tool: 0 operands, expected 1 to 2: tool FILE [OPTIONS]\n" },
        { "a b c", "tool: 3 operands, expected 1 to 2: tool FILE [OPTIONS]\n" },
        { "a --nonsense",
          "tool: unknown or ambiguous option --nonsense, expected one that tool --help lists\n" },
        { "a -x", "tool: unknown option -x, expected one that tool --help lists\n" },
        { "a -dx", "tool: unknown option -x, expected one that tool --help lists\n" },
        { "a --de=3", "tool: --deep takes no value, found \"--de=3\"\n" },
        { "a --epsilon", "tool: --epsilon has no value, expected --epsilon E\n" },
        { "a -o", "tool: --out has no value, expected --out FILE\n" },
        { "a --out=", "tool: --out is empty, expected FILE\n" },
        { "a --epsilon=", "tool: --epsilon is empty, expected E\n" },
        { "a --epsilon 0", "tool: --epsilon is \"0\", expected a number 1e-06 to 0.5\n" },
        { "a --epsilon nan", "tool: --epsilon is \"nan\", expected a number 1e-06 to 0.5\n" },
        { "a --epsilon 0x1p-3", "tool: --epsilon is \"0x1p-3\", expected a number 1e-06 to 0.5\n" },
        { "a --epsilon 0.1mm", "tool: --epsilon is \"0.1mm\", expected a number 1e-06 to 0.5\n" },
        { "a --epsilon 1e999", "tool: --epsilon is \"1e999\", expected a number 1e-06 to 0.5\n" },
        { "a --epsilon 0,1", "tool: --epsilon is \"0,1\", expected a number 1e-06 to 0.5\n" },
        { "a --technique magic", "tool: --technique is \"magic\", expected one of auto, splat, gather\n" },
        { "a --format ex", "tool: --format is \"ex\", expected one of exr, dds, raw, exr2, or several with "
                           "commas between\n" },
        { "a --format exr22", "tool: --format is \"exr22\", expected one of exr, dds, raw, exr2, or "
                              "several with commas between\n" },
        { "a --format EXR", "tool: --format is \"EXR\", expected one of exr, dds, raw, exr2, or several "
                            "with commas between\n" },
        { "a --format exr,png", "tool: --format is \"png\", expected one of exr, dds, raw, exr2, or "
                                "several with commas between\n" },
        { "a --format exr,,dds",
          "tool: --format is \"\", expected one of exr, dds, raw, exr2, or several with commas between\n" },
        { "a --format exr,",
          "tool: --format is \"\", expected one of exr, dds, raw, exr2, or several with commas between\n" },
        { "a --format ,exr",
          "tool: --format is \"\", expected one of exr, dds, raw, exr2, or several with commas between\n" },
        { "a --format=", "tool: --format is empty, expected FORMAT,...\n" },
        { "a -f", "tool: --format has no value, expected --format FORMAT,...\n" },
        { "a --size 800", "tool: --size is \"800\", expected WIDTHxHEIGHT, each 1 to 16384\n" },
        { "a --size 800x", "tool: --size is \"800x\", expected WIDTHxHEIGHT, each 1 to 16384\n" },
        { "a --size 800x600x3", "tool: --size is \"800x600x3\", expected WIDTHxHEIGHT, each 1 to 16384\n" },
        { "a --size 1.5x2", "tool: --size is \"1.5x2\", expected WIDTHxHEIGHT, each 1 to 16384\n" },
        { "a --size 0x0", "tool: --size is \"0x0\", expected WIDTHxHEIGHT, each 1 to 16384\n" },
        { "a --frames 7:3",
          "tool: --frames is \"7:3\", expected FIRST:LAST or one number, each 0 to 9999\n" },
        { "a --at 1,,2", "tool: --at has \"\", expected numbers >= 0 with commas between\n" },
        { "a --at 1,-2,3", "tool: --at has \"-2\", expected numbers >= 0 with commas between\n" },
        { "a --at 1,inf", "tool: --at has \"inf\", expected numbers >= 0 with commas between\n" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        set_arguments(cases[i].arguments);
        const int code = in_child(run);
        assert_string_equal(err_text, cases[i].message);
        assert_int_equal(code, EXIT_USAGE);
        assert_string_equal(out_text, "");
    }
}

/* Oracle: the documented limit on how many numbers there may be. */
static void too_many_numbers_are_refused(void **state)
{
    (void)state;
    enum { LIMIT = sizeof values.at.values / sizeof values.at.values[0] };
    for (int count = LIMIT; count <= LIMIT + 1; count++) {
        char *list = malloc((size_t)count * 2);
        for (int i = 0; i < count; i++)
            memcpy(list + 2 * i, "1,", 2);
        list[2 * count - 1] = '\0';
        set_arguments("x --at");
        arguments[argument_count++] = list;
        arguments[argument_count] = NULL;
        assert_int_equal(in_child(run), count == LIMIT ? 77 : EXIT_USAGE);
        assert_string_equal(err_text, count == LIMIT ? "" : "tool: --at has more than 4096 numbers\n");
        free(list);
    }
}

/* ---- help ------------------------------------------------------------------------------------------ */

/* Oracle: the text as a user should read it; no line is wider than a terminal. */
static void help_is_made_from_the_table(void **state)
{
    (void)state;
    set_arguments("--help");
    assert_int_equal(in_child(run), EXIT_DONE);
    assert_string_equal(err_text, "");
    assert_string_equal(out_text,
                        "usage: tool FILE [OPTIONS]\n"
                        "       tool --old FILE\n"
                        "\n"
                        "Does .things and 'more' - or not\n"
                        "\n"
                        "Options:\n"
                        "  -d, --deep              Go deep.\n"
                        "  -o, --out FILE          Where to.\n"
                        "      --epsilon E         Relative error, from one in a million to a half, that\n"
                        "                          is asked for (default 0.01, no unit).\n"
                        "      --technique auto|splat|gather\n"
                        "                          How.\n"
                        "  -f, --format FORMAT,...\n"
                        "                          As what.\n"
                        "      --size WxH          Pixels.\n"
                        "      --frames A:B        Frames.\n"
                        "      --at R,R            Distances in mm.\n"
                        "      --allow FOLDER      More.\n"
                        "      --json              Print the result as JSON on stdout.\n"
                        "  -q, --quiet             Print no progress and no notes.\n"
                        "  -h, --help              Print this text.\n"
                        "      --version           Print the version.\n"
                        "      --man               Print the man page, as roff.\n"
                        "\n"
                        "First paragraph of what there is to know about this tool, long enough that it\n"
                        "must be broken.\n"
                        "\n"
                        "  tool --epsilon 0.1 x.json\n"
                        "\n"
                        "Last \\one.\n");
}

/* Oracle: --help answers whatever stands after it, and what is wrong before it is still wrong. */
static void help_wins_over_what_follows(void **state)
{
    (void)state;
    set_arguments("--help --nonsense");
    assert_int_equal(in_child(run), EXIT_DONE);
    set_arguments("--epsilon x --help");
    assert_int_equal(in_child(run), EXIT_USAGE);
}

/* Oracle: the version that the library was linked with. */
static void version_is_the_librarys(void **state)
{
    (void)state;
    set_arguments("--version");
    assert_int_equal(in_child(run), EXIT_DONE);
    assert_string_equal(out_text, "tool (libdipole) " DIPOLE_VERSION "\n");
}

/* Oracle: the rules of roff: requests stand alone, text is escaped, every option appears. */
static void man_page_is_roff(void **state)
{
    (void)state;
    set_arguments("--man");
    assert_int_equal(in_child(run), EXIT_DONE);
    static const char *const parts[] = {
        ".TH TOOL 1 \"\" \"libdipole ",
        DIPOLE_VERSION,
        "\" \"User Commands\"\n",
        ".SH NAME\ntool \\- Does .things and 'more' \\- or not\n",
        ".SH SYNOPSIS\n.B tool\nFILE [OPTIONS]\n.br\n.B tool\n\\-\\-old FILE\n",
        ".TP\n\\fB\\-o\\fR, \\fB\\-\\-out\\fR \\fIFILE\\fR\nWhere to.\n",
        ".TP\n\\fB\\-f\\fR, \\fB\\-\\-format\\fR \\fIFORMAT,...\\fR\nAs what.\n",
        ".TP\n\\fB\\-\\-man\\fR\n",
        ".nf\n  tool \\-\\-epsilon 0.1 x.json\n.fi\n.PP\nLast \\eone.\n",
        ".SH EXIT STATUS\n",
    };
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        assert_non_null(strstr(out_text, parts[i]));
}

/* ---- reports --------------------------------------------------------------------------------------- */

static dipole_status reported;

static void report(void)
{
    _exit(cli_report(&tool, &reported, EXIT_FAILED));
}

/* Oracle: STYLE's form of a message. */
static void a_report_names_the_place(void **state)
{
    (void)state;
    reported = (dipole_status){ .line = 12, .column = 18, .source = "skin.json", .message = "g is 2" };
    assert_int_equal(in_child(report), EXIT_FAILED);
    assert_string_equal(err_text, "tool: skin.json:12:18: g is 2\n");
    reported.line = 0;
    assert_int_equal(in_child(report), EXIT_FAILED);
    assert_string_equal(err_text, "tool: skin.json: g is 2\n");
    reported.source[0] = '\0';
    assert_int_equal(in_child(report), EXIT_FAILED);
    assert_string_equal(err_text, "tool: g is 2\n");
}

static struct cli_common noted;

static void note_and_progress(void)
{
    struct cli_progress progress;
    cli_note(&tool, &noted, "%d samples", 3);
    cli_progress_start(&progress, &tool, &noted);
    for (double fraction = 0.0; fraction <= 1.0; fraction += 0.25)
        cli_progress_show(&progress, "bake", fraction);
    _exit(0);
}

/* Oracle: a note is a line that --quiet silences; progress is for terminals, which a file is not. */
static void notes_are_quietened_and_progress_needs_a_terminal(void **state)
{
    (void)state;
    noted = (struct cli_common){ 0 };
    in_child(note_and_progress);
    assert_string_equal(err_text, "tool: note: 3 samples\n");
    noted.quiet = true;
    in_child(note_and_progress);
    assert_string_equal(err_text, "");
}

static void show_on_terminal(void)
{
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    char text[512];
    if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0)
        _exit(99);
    const int line = open(ptsname(terminal), O_RDWR | O_NOCTTY);
    dup2(line, STDERR_FILENO);
    close(line);
    struct cli_progress progress;
    cli_progress_start(&progress, &tool, &(struct cli_common){ 0 });
    cli_progress_show(&progress, "bake", 0.0);
    cli_progress_show(&progress, "bake", 0.01); /* too soon to be shown */
    cli_progress_show(&progress, "bake", 1.0);
    close(STDERR_FILENO); /* what was written stays readable, in as many pieces as the terminal likes */
    for (ssize_t length; (length = read(terminal, text, sizeof text)) > 0;)
        fwrite(text, 1, (size_t)length, stdout);
    fflush(stdout);
    _exit(0);
}

/* Oracle: one line that is drawn and cleared again. */
static void progress_is_drawn_on_a_terminal(void **state)
{
    (void)state;
    const int code = in_child(show_on_terminal);
    if (code == 99)
        skip();
    char expected[512];
    snprintf(expected, sizeof expected, "\r%-79s\r%79s\r", "tool: bake 0 %", "");
    assert_int_equal(code, 0);
    assert_string_equal(out_text, expected);
}

/* Oracle: /dev/full refuses every byte. */
static void print_to_full(void)
{
    dipole_status status;
    dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO);
    printf("result\n");
    _exit(cli_stdout_finish(&status) ? 0 : cli_report(&tool, &status, EXIT_FAILED));
}

static void print_to_closed_pipe(void)
{
    int ends[2];
    dipole_status status;
    if (pipe(ends) != 0)
        _exit(99);
    close(ends[0]);
    dup2(ends[1], STDOUT_FILENO);
    cli_start();
    printf("result\n");
    _exit(cli_stdout_finish(&status) ? 0 : cli_report(&tool, &status, EXIT_FAILED));
}

static void print_well(void)
{
    printf("result\n");
    _exit(cli_stdout_finish(NULL) ? 0 : 1);
}

/* Oracle: wait(2): a signal ends the program and the status names it, as without us; one that was ignored
 * still is. */
static void signals_end_the_program_as_before(void **state)
{
    (void)state;
    static const int numbers[] = { SIGHUP, SIGINT, SIGTERM };
    for (int i = 0; i < 6; i++) {
        const int number = numbers[i % 3];
        const bool is_ignored = i >= 3;
        const pid_t child = fork();
        if (child == 0) {
            signal(number, is_ignored ? SIG_IGN : SIG_DFL);
            cli_start();
            raise(number);
            _exit(5);
        }
        int result = 0;
        assert_int_equal(waitpid(child, &result, 0), child);
        assert_int_equal(WIFSIGNALED(result) ? WTERMSIG(result) : 0, is_ignored ? 0 : number);
        assert_true(!is_ignored || WEXITSTATUS(result) == 5);
    }
}

static void *raise_term(void *unused)
{
    raise(SIGTERM);
    for (;;)
        pause();
    return unused;
}

/* Oracle: as above, when another thread than the main one gets the signal. */
static void signals_to_any_thread_end_the_program(void **state)
{
    (void)state;
    const pid_t child = fork();
    if (child == 0) {
        pthread_t thread;
        cli_start();
        if (pthread_create(&thread, NULL, raise_term, NULL) != 0)
            _exit(5);
        pthread_join(thread, NULL);
        _exit(6);
    }
    int result = 0;
    assert_int_equal(waitpid(child, &result, 0), child);
    assert_true(WIFSIGNALED(result) && WTERMSIG(result) == SIGTERM);
}

/* Oracle: what could not be printed is a failure, not a signal and not success. */
static void lost_output_is_a_failure(void **state)
{
    (void)state;
    assert_int_equal(in_child(print_to_full), EXIT_FAILED);
    assert_string_equal(err_text, "tool: stdout: cannot be written: No space left on device\n");
    assert_int_equal(in_child(print_to_closed_pipe), EXIT_FAILED);
    assert_string_equal(err_text, "tool: stdout: cannot be written: Broken pipe\n");
    assert_int_equal(in_child(print_well), 0);
    assert_string_equal(out_text, "result\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_arrive),
        cmocka_unit_test(choices_are_bits),
        cmocka_unit_test(numbers_do_not_follow_the_locale),
        cmocka_unit_test(wrong_usage_is_one_line_and_code_2),
        cmocka_unit_test(too_many_numbers_are_refused),
        cmocka_unit_test(help_is_made_from_the_table),
        cmocka_unit_test(help_wins_over_what_follows),
        cmocka_unit_test(version_is_the_librarys),
        cmocka_unit_test(man_page_is_roff),
        cmocka_unit_test(a_report_names_the_place),
        cmocka_unit_test(notes_are_quietened_and_progress_needs_a_terminal),
        cmocka_unit_test(progress_is_drawn_on_a_terminal),
        cmocka_unit_test(signals_end_the_program_as_before),
        cmocka_unit_test(signals_to_any_thread_end_the_program),
        cmocka_unit_test(lost_output_is_a_failure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
