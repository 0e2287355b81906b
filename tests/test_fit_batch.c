/* fit/batch*.c: lists, shards, what rows depend on, results, and fit --batch itself. */
#include "tests/run_tool.h"

#include "fit/batch_internal.h"
#include "io/exr.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

static const char *text_target;
static struct cli_texts texts_target;
static double number_target;
static bool flag_target;
static const struct cli_option options[] = {
    { .name = "output", .letter = 'o', .kind = CLI_TEXT, .target = &text_target },
    { .name = "start", .kind = CLI_TEXT, .target = &text_target },
    { .name = "exposure", .kind = CLI_FLAG, .target = &flag_target },
    { .name = "allow-path", .kind = CLI_TEXTS, .target = &texts_target },
    { .name = "eta", .kind = CLI_NUMBER, .target = &number_target },
    { .name = FIT_BATCH_OPTION, .kind = CLI_TEXT, .target = &text_target },
    { .name = NULL },
};
static const struct cli_tool tool = { .name = "fit", .options = options };

static bool parse(const char *text, struct batch_list **list, dipole_status *status)
{
    return batch_list_parse(text, strlen(text), "l.csv", &tool, list, status);
}

/* ---- lists ---------------------------------------------------------------------------------------- */

/* Oracle: the text itself. */
static void lists_are_read_as_they_stand(void **state)
{
    (void)state;
    static const char text[] = "\xef\xbb\xbf# mine\r\n"
                               "target, name ,scene,\"eta\",allow-path\r\n"
                               "\"a,1.exr\",B-2_.x,\"a \"\"b\"\".json\",1.3,\r\n"
                               "\r\n"
                               "a;b, -a ,c;d,,x;y";
    static const char *const cells[2][5] = { { "a,1.exr", "B-2_.x", "a \"b\".json", "1.3", "" },
                                             { "a;b", "-a", "c;d", "", "x;y" } };
    struct batch_list *list;
    dipole_status status;
    if (!parse(text, &list, &status))
        fail_msg("%d:%d: %s", status.line, status.column, status.message);
    assert_int_equal(list->column_count, 5);
    assert_int_equal(list->row_count, 2);
    assert_int_equal(list->columns[0].kind, BATCH_TARGET);
    assert_int_equal(list->columns[2].kind, BATCH_SCENE);
    assert_true(batch_column_is_several(&list->columns[0]) && batch_column_is_several(&list->columns[4]));
    assert_false(batch_column_is_several(&list->columns[3]));
    assert_string_equal(list->columns[3].option->name, "eta");
    for (size_t i = 0; i < 2; i++) {
        const char *cell = list->rows[i].cells;
        for (size_t k = 0; k < 5; k++, cell += strlen(cell) + 1)
            assert_string_equal(cell, cells[i][k]);
        assert_string_equal(list->rows[i].name, cells[i][1]);
        assert_ptr_equal(batch_list_find(list, cells[i][1]), &list->rows[i]);
    }
    assert_int_equal(list->rows[1].line, 5);
    assert_null(batch_list_find(list, "a"));
    batch_list_destroy(list);
}

#define NAMES "expected 1 to 128 of A-Z, a-z, 0-9, '.', '_' and '-', the first no '.'"
#define KNOWN "name, scene, target, start, allow-path, eta"

/* Oracle: the messages as a user should read them. */
static void wrong_lists_are_refused_with_line_and_column(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int line, column;
        const char *message;
    } cases[] = {
        { "", 0, 0, "has no header line, expected name and some of scene, target, start, allow-path, eta" },
        { "name,scene,target\n", 0, 0, "has a header and no rows, expected at least one" },
        { "name,sigma\na,1\n", 1, 6, "unknown column \"sigma\", expected some of " KNOWN },
        { "name,exposure\na,1\n", 1, 6, "unknown column \"exposure\", expected some of " KNOWN },
        { "name,output\na,b\n", 1, 6, "unknown column \"output\", expected some of " KNOWN },
        { "name,batch\na,b\n", 1, 6, "unknown column \"batch\", expected some of " KNOWN },
        { "name,json\na,b\n", 1, 6, "unknown column \"json\", expected some of " KNOWN },
        { "name,\na,b\n", 1, 6, "unknown column \"\", expected some of " KNOWN },
        { "name,eta,name\n", 1, 10, "column \"name\" is the second of its name, expected one" },
        { "scene,target\na,b\n", 1, 1, "the header has no column \"name\"" },
        { "name,eta\na\n", 2, 1, "the line has 1 column, expected the 2 of the header" },
        { "name,eta\na,1,2\n", 2, 1, "the line has 3 columns, expected the 2 of the header" },
        { "name\nb\na\nc\na\nb\n", 5, 1, "name \"a\" stands in line 3, too, expected names that differ" },
        { "eta,name\n1,\n", 2, 3, "name is \"\", " NAMES },
        { "name\n../a\n", 2, 1, "name is \"../a\", " NAMES },
        { "name\n.a\n", 2, 1, "name is \".a\", " NAMES },
        { "name\n..\n", 2, 1, "name is \"..\", " NAMES },
        { "name\na/b\n", 2, 1, "name is \"a/b\", " NAMES },
        { "name\n\"a b\"\n", 2, 1, "name is \"a b\", " NAMES },
        { "name\n\xc3\xa4\n", 2, 1, "name is \"\xc3\xa4\", " NAMES },
        { "name,eta\na,\x1b[31m\n", 2, 3, "eta is \"?[31m\", which has a control character" },
        { "name,scene,target\na,b;c,d\n", 2, 1,
          "2 scenes and 1 target, expected as many of both, with ; between" },
        { "name,scene\na,b\n", 2, 1, "1 scene and 0 targets, expected as many of both, with ; between" },
        { "name,eta\na,\"1\nb,2\n", 2, 3, "the quote has no end on its line, expected another one" },
    };
    struct batch_list *list;
    for (size_t i = 0; i < COUNT(cases); i++) {
        dipole_status status = { 0 };
        if (parse(cases[i].text, &list, &status))
            fail_msg("read: %s", cases[i].text);
        assert_null(list);
        assert_string_equal(status.message, cases[i].message);
        assert_string_equal(status.source, "l.csv");
        assert_int_equal(status.line, cases[i].line);
        assert_int_equal(status.column, cases[i].column);
    }
    char text[256];
    snprintf(text, sizeof text, "name\n%0128d\n", 1);
    assert_true(parse(text, &list, NULL));
    batch_list_destroy(list);
    snprintf(text, sizeof text, "name\n%0129d\n", 1);
    assert_false(parse(text, &list, NULL));
    assert_false(batch_list_parse("name\na\0b\n", 9, "l.csv", &tool, &list, NULL));
}

/* Oracle: damage ends in a list or a message with a place, never in a crash (sanitizers). */
static void damaged_lists_end_in_a_message(void **state)
{
    (void)state;
    static const char text[] = "# by me\nname,scene,target,eta\na,\"b\"\"c\",d,1\r\nb,c;d,e;f,\n";
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < 20000; i++) {
        const size_t size = i % 2 ? sizeof text - 1 : random_bits(&rng) % sizeof text;
        char *const copy = malloc(size + 1); /* of its size, so that reading beyond is seen */
        assert_non_null(copy);
        memcpy(copy, text, size);
        copy[size] = '\0';
        for (uint64_t n = random_bits(&rng) % 4; n > 0 && size > 0; n--)
            copy[random_bits(&rng) % size] = (char)random_bits(&rng);
        struct batch_list *list;
        dipole_status status = { 0 };
        if (!batch_list_parse(copy, size, "l.csv", &tool, &list, &status))
            assert_true(status.message[0] && !list);
        batch_list_destroy(list);
        free(copy);
    }
}

/* A list of count rows, row0, row1, ..., as one text. */
static char *write_many(size_t count)
{
    char *const text = malloc(16 * count + 16), *end = text;
    assert_non_null(text);
    end += sprintf(end, "name,eta\n");
    for (size_t i = 0; i < count; i++)
        end += sprintf(end, "row%zu,\n", i);
    return text;
}

/* Oracle: the limit itself; of many rows each is found. */
static void sizes_are_bounded(void **state)
{
    (void)state;
    struct batch_list *list;
    dipole_status status;
    char *text = write_many(100000);
    assert_true(parse(text, &list, NULL));
    assert_int_equal(list->row_count, 100000);
    for (size_t i = 0; i < list->row_count; i++)
        assert_ptr_equal(batch_list_find(list, list->rows[i].name), &list->rows[i]);
    batch_list_destroy(list);
    free(text);
    text = write_many(BATCH_ROW_LIMIT + 1);
    assert_false(parse(text, &list, &status));
    assert_string_equal(status.message, "the list has more than 1000000 rows");
    assert_int_equal(status.line, BATCH_ROW_LIMIT + 2);
    free(text);
    text = malloc(20001);
    assert_non_null(text);
    memset(text, 'a', 20000);
    text[20000] = '\0';
    assert_false(parse(text, &list, &status));
    assert_string_equal(status.message, "the line has 20000 bytes, expected at most 16384");
    free(text);
}

/* ---- shards --------------------------------------------------------------------------------------- */

/* Oracles: numbers of another program, FNV-1a and SplitMix64 in Python, which may never change; the
 * binomial distribution, five standard deviations. By its name alone: more rows move none. */
static void shards_are_even_and_stay_as_they_are(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t count, shard;
    } pinned[] = { { "a", 8, 7 },
                   { "b", 8, 6 },
                   { "row1", 3, 1 },
                   { "row2", 1000, 611 },
                   { "sample-0001", 1000, 952 },
                   { "B-2_.x", 1000000, 485572 } };
    for (size_t i = 0; i < COUNT(pinned); i++)
        assert_int_equal(batch_shard_of(pinned[i].name, pinned[i].count), pinned[i].shard);
    enum { NAMES_COUNT = 10000, MOST = 64 };
    for (size_t count = 1; count <= MOST; count++) {
        size_t sizes[MOST] = { 0 };
        for (int i = 0; i < NAMES_COUNT; i++) {
            char name[32];
            snprintf(name, sizeof name, "sample-%04d", i);
            const size_t shard = batch_shard_of(name, count);
            assert_true(shard < count);
            sizes[shard]++;
        }
        const double p = 1.0 / (double)count, mean = NAMES_COUNT * p;
        for (size_t k = 0; k < count; k++)
            if (!(fabs((double)sizes[k] - mean) <= 5.0 * sqrt(mean * (1.0 - p))))
                fail_msg("shard %zu of %zu has %zu of %d names", k + 1, count, sizes[k], NAMES_COUNT);
    }
}

/* Oracle: the definition. */
static void shards_are_two_numbers(void **state)
{
    (void)state;
    static const char *const wrong[] = { "",
                                         "1",
                                         "0/3",
                                         "4/3",
                                         "1/0",
                                         "/3",
                                         "1/",
                                         "a/3",
                                         "1/3 ",
                                         " 1/3",
                                         "+1/3",
                                         "1/1000001",
                                         "1/3/3",
                                         "1.0/3",
                                         "-1/3",
                                         "1/-3",
                                         "99999999999999999999/99999999999999999999" };
    size_t index, count;
    for (size_t i = 0; i < COUNT(wrong); i++)
        if (batch_shard_parse(wrong[i], &index, &count))
            fail_msg("taken: %s", wrong[i]);
    assert_true(batch_shard_parse("3/8", &index, &count));
    assert_true(index == 2 && count == 8);
    assert_true(batch_shard_parse("1/1", &index, &count));
    assert_true(batch_shard_parse("1000000/1000000", &index, &count));
    assert_true(index == 999999 && count == 1000000);
}

/* ---- inputs --------------------------------------------------------------------------------------- */

static uint64_t inputs_of(const char *text, const char *flag)
{
    struct batch_list *list;
    dipole_status status;
    if (!parse(text, &list, &status))
        fail_msg("%s", status.message);
    assert_non_null(realpath(".", list->folder));
    const uint64_t hash = batch_inputs_hash(list, &list->rows[0], &flag, flag != NULL);
    batch_list_destroy(list);
    return hash;
}

/* Oracle: the definition; what a result depends on, and nothing else, is another hash. */
static void inputs_are_cells_and_the_files_they_lead_to(void **state)
{
    (void)state;
    static const char row[] = "name,scene,target,start\na,s.json,t.exr,skin1\n";
    write_text("s.json", "{ \"objects\": [{ \"mesh\": \"sub/m.obj\" }], \"material\": \"sub/m.json\" }");
    assert_int_equal(mkdir("sub", 0777), 0);
    write_text("sub/m.json", "{ \"table\": \"deep.exr\" }");
    write_text("sub/deep.exr", "1");
    write_text("sub/m.obj", "v 0 0 0");
    write_text("t.exr", "picture");
    const uint64_t hash = inputs_of(row, NULL);
    assert_true(inputs_of("target,name,start,eta,scene\nt.exr,b,skin1,,s.json\n", NULL) == hash);
    uint64_t others[16] = { hash };
    size_t count = 1;
    others[count++] = inputs_of("name,scene,target,start\na,s.json,t.exr,skin2\n", NULL);
    others[count++] = inputs_of("name,scene,target,start\na,s.json,t.exr,\n", NULL);
    others[count++] = inputs_of("name,scene,target,start,eta\na,s.json,t.exr,skin1,1.3\n", NULL);
    others[count++] = inputs_of("name,scene,target,start\na,s.json;s.json,t.exr;t.exr,skin1\n", NULL);
    others[count++] = inputs_of(row, "--exposure");
    static const char *const files[] = { "t.exr", "sub/m.obj", "sub/deep.exr", "sub/m.json", "s.json" };
    for (size_t i = 0; i < COUNT(files); i++) {
        write_text(files[i], "{ \"other\": 1 }");
        others[count++] = inputs_of(row, NULL);
    }
    assert_int_equal(unlink("t.exr"), 0);
    others[count++] = inputs_of(row, NULL);
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < i; k++)
            if (others[i] == others[k])
                fail_msg("inputs %zu and %zu have the same hash", i, k);
    /* a pipe, which would have the reader wait, is none of the contents; a circle ends */
    assert_int_equal(mkfifo("t.exr", 0666), 0);
    assert_true(inputs_of(row, NULL) == others[count - 1]);
    write_text("s.json", "[\"s.json\", \"s.json\"]");
    inputs_of(row, NULL);
}

/* ---- results -------------------------------------------------------------------------------------- */

static void count_line(void *context, json_t *line)
{
    int *const sum = context;
    *sum = 10 * *sum + (int)json_integer_value(json_object_get(line, "n"));
}

static int read_digits(size_t *ignored)
{
    int digits = 0;
    assert_true(batch_results_read(".", count_line, &digits, ignored, NULL));
    return digits;
}

static void append(struct batch_results *results, int n)
{
    json_t *const line = json_pack("{s:i}", "n", n);
    assert_true(batch_results_append(results, line, NULL));
    json_decref(line);
}

/* Oracle: what was appended; one process at a time; a line without its end loses itself alone. */
static void results_are_only_added_to(void **state)
{
    (void)state;
    struct batch_results results, other;
    dipole_status status;
    size_t ignored;
    assert_true(batch_results_open(".", 0, 0, &results, NULL));
    append(&results, 1);
    append(&results, 2);
    assert_false(batch_results_open(".", 0, 0, &other, &status));
    assert_string_equal(status.source, "./results.jsonl");
    assert_string_equal(status.message, "another process is at work on these rows, expected one at a time");
    assert_true(batch_results_open(".", 2, 10, &other, NULL)); /* of other rows */
    assert_string_equal(other.path, "./results.3-of-10.jsonl");
    append(&other, 9);
    batch_results_close(&other);
    batch_results_close(&results);
    assert_int_equal(read_digits(&ignored), 912);
    assert_int_equal(ignored, 0);

    const int file = open("results.jsonl", O_WRONLY | O_APPEND);
    assert_int_equal(write(file, "{\"n\": 3, \"na", 12), 12);
    close(file);
    assert_int_equal(read_digits(&ignored), 912);
    assert_int_equal(ignored, 1);
    assert_true(batch_results_open(".", 0, 0, &results, NULL));
    append(&results, 4);
    append(&results, 5);
    batch_results_close(&results);
    assert_int_equal(read_digits(&ignored), 91245);
    assert_int_equal(ignored, 1);

    /* others' files, and a line beyond the limit */
    write_text("results.txt", "{\"n\": 6}\n");
    write_text("result.jsonl", "{\"n\": 6}\n");
    assert_int_equal(
        system("head -c 5000000 /dev/zero | tr '\\0' 7 >results.x.jsonl && echo >>results.x.jsonl && "
               "echo '{\"n\": 8}' >>results.x.jsonl"),
        0);
    assert_int_equal(read_digits(&ignored), 912458);
    assert_int_equal(ignored, 2);
}

/* ---- one row -------------------------------------------------------------------------------------- */

/* This test program again, as the row of a batch whose tool is called "row": prints what it was given, and
 * ends as --start says. */
static int be_row(int argc, char **argv)
{
    const char *end = "";
    for (int i = 1; i < argc; i++)
        if (strncmp(argv[i], "--start=", 8) == 0)
            end = argv[i] + 8;
    if (strcmp(end, "silent") == 0)
        return 3;
    if (strcmp(end, "mute") == 0)
        return 0;
    if (strcmp(end, "bytes") == 0) {
        fputs("first\nrow: \xff\x01 \"last\"\n\n", stderr);
        return 1;
    }
    if (strcmp(end, "abort") == 0) {
        fputs("row: at its end", stderr);
        abort();
    }
    for (int i = 0; i < 30000 && strcmp(end, "talk") == 0; i++)
        fputs("0123456789012345678901234567890123456789\n", stderr);
    for (int i = 0; i < 30000 && strcmp(end, "print") == 0; i++)
        puts("{\"0123456789012345678901234567890123456789\"}");
    json_t *const arguments = json_array(), *const root = json_pack("{s:o}", "arguments", arguments);
    for (int i = 1; i < argc; i++)
        json_array_append_new(arguments, json_string(argv[i]));
    json_dumpf(root, stdout, JSON_COMPACT);
    json_decref(root);
    return strcmp(end, "talk") == 0;
}

static struct batch_outcome run_row(const char *text, const char *flag)
{
    static const struct cli_tool row_tool = { .name = "row", .options = options };
    struct batch_list *list;
    struct batch_outcome outcome;
    assert_true(parse(text, &list, NULL));
    strcpy(list->folder, "/");
    assert_true(batch_row_run(&row_tool, list, &list->rows[0], &flag, flag != NULL, "/out.json", 0,
                              &outcome, NULL));
    batch_list_destroy(list);
    return outcome;
}

/* Oracle: the definition; no cell is taken for an option. */
static void rows_are_given_what_their_cells_say(void **state)
{
    (void)state;
    struct batch_outcome outcome = run_row("target,eta,name,allow-path,scene,start\n"
                                           "a;--json,-1,x,c=1;-d,\"e, f;-g\",\n",
                                           "--exposure");
    assert_true(outcome.is_done);
    char *const text = json_dumps(outcome.fit, JSON_COMPACT);
    assert_string_equal(text, "{\"arguments\":[\"--exposure\",\"--eta=-1\",\"--allow-path=c=1\","
                              "\"--allow-path=-d\",\"--output=/out.json\",\"--json\",\"--quiet\",\"--\","
                              "\"e, f\",\"a\",\"-g\",\"--json\"]}");
    free(text);
    json_decref(outcome.fit);
    outcome = run_row("name\nx\n", NULL);
    assert_true(outcome.is_done);
    assert_int_equal(json_array_size(json_object_get(outcome.fit, "arguments")), 4);
    json_decref(outcome.fit);
}

/* Oracle: exact words; what is printed is bounded, and no pipe that is full stops a row. */
static void rows_may_end_in_any_way(void **state)
{
    (void)state;
    static const struct {
        const char *end;
        int exit_code;
        const char *message;
    } cases[] = {
        { "silent", 3, "ended with exit code 3 and no message" },
        { "mute", 0, "printed no result" },
        { "print", 0, "printed too much" },
        { "bytes", 1, "?? \"last\"" },
        { "abort", 128 + SIGABRT, "was ended by signal 6 (ABRT): at its end" },
        { "talk", 1, "0123456789012345678901234567890123456789" },
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char text[64];
        snprintf(text, sizeof text, "name,start\nx,%s\n", cases[i].end);
        const struct batch_outcome outcome = run_row(text, NULL);
        assert_false(outcome.is_done || outcome.is_interrupted);
        assert_string_equal(outcome.message, cases[i].message);
        assert_int_equal(outcome.exit_code, cases[i].exit_code);
        assert_int_equal(outcome.fit != NULL, strcmp(cases[i].end, "talk") == 0);
        json_decref(outcome.fit);
    }
}

/* ---- fit --batch ---------------------------------------------------------------------------------- */

static const char scene[] =
    "{ \"camera\": { \"eye\": [5, 10, 48], \"target\": [0, 0, 0], \"fov_y_deg\": 38, \"size\": [48, 36] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [-0.5, -0.6, -0.6], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"sphere\", \"detail\": 32, \"transform\": { \"scale\": 12 },\n"
    "                \"material\": \"skin1\" }] }\n";

/* in/scene.json and a picture of it, in/picture.exr, drawn once. */
static void make_inputs(void)
{
    struct tool_run run = { 0 };
    assert_int_equal(mkdir("in", 0777), 0);
    write_text("in/scene.json", scene);
    if (access("../picture.exr", R_OK) != 0) {
        run_tool(&run, "render", "in/scene.json", "-q", "--epsilon", "0.05", "-o", "../picture.exr");
        assert_int_equal(run.exit_code, 0);
    }
    assert_int_equal(system("cp ../picture.exr in/"), 0);
    free(run.out);
}

static int remove_picture(void **state)
{
    (void)state;
    unlink("picture.exr");
    return 0;
}

/* The lines of out/results.jsonl, or of another file, as an array. */
static json_t *read_lines(const char *path)
{
    char line[8192];
    json_t *const lines = json_array();
    FILE *const file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file)) {
        json_t *const value = json_loads(line, 0, NULL);
        if (value)
            json_array_append_new(lines, value);
    }
    fclose(file);
    return lines;
}

static const char *text_at(json_t *lines, size_t i, const char *key)
{
    const char *const text = json_string_value(json_object_get(json_array_get(lines, i), key));
    return text ? text : "";
}

/* "name status, name status, ..." of the lines. */
static const char *states(json_t *lines, char out[1024])
{
    size_t length = 0;
    out[0] = '\0';
    for (size_t i = 0; i < json_array_size(lines); i++)
        length += (size_t)snprintf(out + length, 1024 - length, "%s%s %s", i ? ", " : "",
                                   text_at(lines, i, "name"), text_at(lines, i, "status"));
    return out;
}

static void assert_states(const char *expected)
{
    char found[1024];
    json_t *const lines = read_lines("out/results.jsonl");
    assert_string_equal(states(lines, found), expected);
    json_decref(lines);
}

/* Oracles: exact words; the fit block is that of the file, which a single run writes, too. */
static void rows_are_done_once_and_failed_ones_again(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    make_inputs();
    write_text("in/list.csv", "name,scene,target,start\n"
                              "one,scene.json,picture.exr,\n"
                              "lost,scene.json,lost.exr,\n"
                              "two,scene.json,picture.exr,skin1\n");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_string_equal(run.err, "");
    assert_string_equal(run.out, "    done  skipped   failed\n    rows     rows     rows\n"
                                 "       2        0        1\n"
                                 "failed: lost: lost.exr: cannot be read: No such file or directory\n"
                                 "results: out/results.jsonl\n");
    assert_int_equal(run.exit_code, 1);
    assert_int_equal(count_entries("out"), 3);
    assert_states("one done, lost failed, two done");
    json_t *const lines = read_lines("out/results.jsonl");
    json_t *const first = json_array_get(lines, 0), *const written =
                                                        json_load_file("out/one.json", 0, NULL);
    assert_int_equal(json_object_size(first), 9);
    assert_true(json_equal(json_object_get(first, "fit"), json_object_get(written, "fit")));
    assert_int_equal(json_integer_value(json_object_get(first, "exit_code")), 0);
    assert_string_equal(text_at(lines, 0, "message"), "");
    assert_string_equal(text_at(lines, 1, "message"),
                        "lost.exr: cannot be read: No such file or directory");
    assert_true(json_is_null(json_object_get(json_array_get(lines, 1), "fit")));
    assert_int_equal(json_integer_value(json_object_get(json_array_get(lines, 1), "exit_code")), 1);
    json_decref(lines);
    json_decref(written);

    /* again: what failed alone, as JSON */
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out", "--json");
    assert_int_equal(run.exit_code, 1);
    assert_string_equal(run.out,
                        "{\n  \"done\": 0,\n  \"skipped\": 2,\n  \"failed\": [\n    {\n"
                        "      \"name\": \"lost\",\n      \"message\": \"lost.exr: cannot be read: No "
                        "such file or directory\"\n    }\n  ],\n"
                        "  \"results\": \"out/results.jsonl\"\n}\n");
    assert_int_equal(system("cp in/picture.exr in/lost.exr"), 0);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out", "--json");
    assert_done(&run);
    assert_states("one done, lost failed, two done, lost failed, lost done");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_done(&run);
    assert_non_null(strstr(run.out, "       0        3        0\n"));

    /* a result that was lost, one that was changed, and another cell; then nothing */
    assert_int_equal(unlink("out/one.json"), 0);
    write_text("out/two.json", "{}");
    write_text("in/list.csv", "name,start,scene,target\n"
                              "new,,scene.json,picture.exr\n"
                              "lost,skin2,scene.json,lost.exr\n"
                              "two,skin1,scene.json,picture.exr\n"
                              "one,,scene.json,picture.exr\n");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_done(&run);
    assert_states("one done, lost failed, two done, lost failed, lost done, new done, lost done, two done, "
                  "one done");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_done(&run);
    assert_non_null(strstr(run.out, "       0        4        0\n"));

    /* another scene, which all of them name; then the first one again, whose results are gone */
    write_text("in/list.csv", "name,scene,target\none,scene.json,picture.exr\n");
    assert_int_equal(system("sed -i 's/irradiance\": 3 /irradiance\": 3.1 /' in/scene.json"), 0);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_non_null(strstr(run.out, "       1        0        0\n"));
    write_text("in/scene.json", scene);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_non_null(strstr(run.out, "       1        0        0\n"));
    free(run.out);
}

/* Oracle: the rows of shards are disjoint and together all; each goes to a file of its own; what one
 * command has done is done for any other number of shards. */
static void shards_share_a_folder(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    make_inputs();
    FILE *const list = fopen("in/list.csv", "w");
    assert_non_null(list);
    fputs("name,scene,target\n", list);
    for (int i = 0; i < 6; i++)
        fprintf(list, "row%d,scene.json,picture.exr\n", i);
    assert_int_equal(fclose(list), 0);
    size_t count = 0;
    for (int i = 1; i <= 3; i++) {
        char shard[16], path[64];
        snprintf(shard, sizeof shard, "%d/3", i);
        snprintf(path, sizeof path, "out/results.%d-of-3.jsonl", i);
        run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out", "--shard", shard);
        assert_done(&run);
        json_t *const lines = read_lines(path);
        for (size_t k = 0; k < json_array_size(lines); k++)
            assert_int_equal(batch_shard_of(text_at(lines, k, "name"), 3), i - 1);
        count += json_array_size(lines);
        json_decref(lines);
    }
    assert_int_equal(count, 6);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_done(&run);
    assert_non_null(strstr(run.out, "       0        6        0\n"));
    free(run.out);
}

/* Oracle: exact words, exit code, and no folder made. */
static void wrong_use_is_refused_before_any_work(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    write_text("l.csv", "name,scene,target\na,s.json,t.exr\n");
    write_text("twice.csv", "name,scene,target\na,s.json,t.exr\na,s.json,t.exr\n");
    write_text("strange.csv", "name,strange\na,1\n");
    run_tool(&run, "fit", "--batch", "l.csv");
    assert_failed(&run, 2, "fit: no --output (-o) FOLDER was given; try --help\n");
    run_tool(&run, "fit", "--shard", "1/2", "-o", "out");
    assert_failed(&run, 2, "fit: --shard is given without --batch LIST.csv\n");
    run_tool(&run, "fit", "--row-seconds", "1", "-o", "out");
    assert_failed(&run, 2, "fit: --row-seconds is given without --batch LIST.csv\n");
    run_tool(&run, "fit", "--batch", "l.csv", "-o", "out", "--shard", "3/2");
    assert_failed(&run, 2, "fit: --shard is \"3/2\", expected I/N with 1 <= I <= N <= 1000000\n");
    run_tool(&run, "fit", "--batch", "l.csv", "-o", "out", "--start", "skin1");
    assert_failed(&run, 2, "fit: --start is given with --batch, expected a column \"start\" in the list\n");
    run_tool(&run, "fit", "--batch", "l.csv", "-qo", "out", "s.json");
    assert_failed(&run, 2,
                  "fit: \"s.json\" is given with --batch, expected columns \"scene\" and \"target\" in the "
                  "list\n");
    run_tool(&run, "fit", "--batch", "twice.csv", "-o", "out");
    assert_failed(&run, 1,
                  "fit: twice.csv:3:1: name \"a\" stands in line 2, too, expected names that differ\n");
    run_tool(&run, "fit", "--batch", "none.csv", "-o", "out");
    assert_failed(&run, 1, "fit: none.csv: cannot be read: No such file or directory\n");
    run_tool(&run, "fit", "--batch", "strange.csv", "-o", "out");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.err,
                           "fit: strange.csv:1:6: unknown column \"strange\", expected some of name, "
                           "scene, target, profile, "));
    assert_int_equal(count_entries("."), 3);
    free(run.out);
}

/* Oracle: no line of results is longer than the disk has room for; what was torn is done again. */
static void a_full_disk_loses_a_line_at_most(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    make_inputs();
    write_text("in/list.csv",
               "name,scene,target\none,scene.json,picture.exr\ntwo,scene.json,picture.exr\n");
    run_tool_limited(&run, 100, "fit",
                     (const char *const[]){ "--batch", "in/list.csv", "-o", "out", NULL });
    assert_failed(&run, 1, "fit: out/results.jsonl: cannot be written: No space left on device\n");
    assert_int_equal(count_entries("out"), 1);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_string_equal(run.err,
                        "fit: note: out: 1 line of results*.jsonl cannot be read and counts for nothing\n");
    assert_int_equal(run.exit_code, 0);
    assert_states("one done, two done");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out", "-q");
    assert_done(&run);
    free(run.out);
}

/* ---- rows that do not end by themselves ----------------------------------------------------------- */

/* A list whose row "never" waits for a pipe that nobody writes to, between two that are done. */
static void make_endless(void)
{
    make_inputs();
    assert_int_equal(mkfifo("in/never.exr", 0666), 0);
    write_text("in/list.csv", "name,scene,target\none,scene.json,picture.exr\nnever,scene.json,never.exr\n"
                              "two,scene.json,picture.exr\n");
}

static pid_t start_batch(void)
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        if (!freopen("batch.out", "w", stdout) || !freopen("batch.err", "w", stderr))
            _exit(126);
        execl(PROGRAM_FOLDER "/fit", "fit", "--batch", "in/list.csv", "-o", "out", (char *)NULL);
        _exit(127);
    }
    return child;
}

/* The process that runs the row "never", once there is one. */
static pid_t wait_for_row(pid_t batch)
{
    char path[64], command[4096];
    snprintf(path, sizeof path, "/proc/%d/task/%d/children", (int)batch, (int)batch);
    for (int i = 0; i < 60000; i++, usleep(1000)) {
        int row = 0;
        FILE *const children = fopen(path, "r");
        if (!children || fscanf(children, "%d", &row) != 1)
            row = 0;
        if (children)
            fclose(children);
        if (row == 0)
            continue;
        char command_path[64];
        snprintf(command_path, sizeof command_path, "/proc/%d/cmdline", row);
        FILE *const line = fopen(command_path, "r");
        const size_t size = line ? fread(command, 1, sizeof command, line) : 0;
        if (line)
            fclose(line);
        if (size > 0 && memmem(command, size, "never.exr", 9))
            return row;
    }
    fail_msg("the row does not start");
    return 0;
}

static int wait_for(pid_t process)
{
    int state = 0;
    assert_int_equal(waitpid(process, &state, 0), process);
    return state;
}

static void assert_text(const char *path, const char *expected)
{
    char text[4096];
    FILE *const file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(text, expected);
}

/* Oracle: exact words; the rest is done. */
static void a_row_that_is_killed_is_told_and_the_rest_done(void **state)
{
    (void)state;
    make_endless();
    const pid_t batch = start_batch();
    kill(wait_for_row(batch), SIGKILL);
    const int end = wait_for(batch);
    assert_true(WIFEXITED(end) && WEXITSTATUS(end) == 1);
    assert_text("batch.err", "");
    assert_text("batch.out", "    done  skipped   failed\n    rows     rows     rows\n"
                             "       2        0        1\n"
                             "failed: never: was ended by signal 9 (KILL)\nresults: out/results.jsonl\n");
    assert_states("one done, never failed, two done");
    json_t *const lines = read_lines("out/results.jsonl");
    assert_int_equal(json_integer_value(json_object_get(json_array_get(lines, 1), "exit_code")), 137);
    json_decref(lines);
}

/* Oracle: exact words; the row never ends by itself. */
static void a_row_may_take_so_long_and_no_longer(void **state)
{
    (void)state;
    struct tool_run run = { 0 };
    make_endless();
    write_text("in/list.csv", "name,scene,target\nnever,scene.json,never.exr\n");
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out", "--row-seconds", "0.2");
    assert_int_equal(run.exit_code, 1);
    assert_non_null(strstr(run.out, "failed: never: took more than 0.2 s and was ended\n"));
    assert_states("never failed");
    free(run.out);
}

/* Oracle: exact words; a second process is refused meanwhile; what was done is kept, and skipped after. */
static void an_interrupted_batch_goes_on(void **state)
{
    (void)state;
    static const int numbers[] = { SIGINT, SIGTERM };
    struct tool_run run = { 0 };
    make_endless();
    for (size_t i = 0; i < COUNT(numbers); i++) {
        const pid_t batch = start_batch(), row = wait_for_row(batch);
        run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
        assert_failed(&run, 1,
                      "fit: out/results.jsonl: another process is at work on these rows, expected one at a "
                      "time\n");
        kill(batch, numbers[i]);
        const int end = wait_for(batch);
        assert_true(WIFSIGNALED(end) && WTERMSIG(end) == numbers[i]);
        assert_int_equal(kill(row, 0), -1);
        assert_text("batch.out", "");
        assert_text("batch.err",
                    i == 0 ? "fit: interrupted; 1 row done now, 0 skipped, 0 failed, all kept in "
                             "out/results.jsonl: the same command goes on with the rest\n"
                           : "fit: interrupted; 0 rows done now, 1 skipped, 0 failed, all kept in "
                             "out/results.jsonl: the same command goes on with the rest\n");
        assert_states("one done");
        assert_int_equal(count_entries("out"), 2);
    }
    assert_int_equal(system("rm in/never.exr && cp in/picture.exr in/never.exr"), 0);
    run_tool(&run, "fit", "--batch", "in/list.csv", "-o", "out");
    assert_done(&run);
    assert_states("one done, never done, two done");
    free(run.out);
}

/* Wait for a process that is not ours. One that ended, and that nobody waited for, has no command line. */
static void wait_for_end_of(pid_t process)
{
    char path[64], text[16];
    snprintf(path, sizeof path, "/proc/%d/cmdline", (int)process);
    for (int i = 0; i < 60000; i++, usleep(1000)) {
        FILE *const file = fopen(path, "r");
        const bool is_over = !file || fread(text, 1, sizeof text, file) == 0;
        if (file)
            fclose(file);
        if (is_over)
            return;
    }
    fail_msg("process %d does not end", (int)process);
}

/* Oracle: the same words when the row hears of the signal first, as under Slurm: it is not a failed one. */
static void a_row_may_be_interrupted_before_its_batch(void **state)
{
    (void)state;
    make_endless();
    const pid_t batch = start_batch(), row = wait_for_row(batch);
    kill(row, SIGTERM);
    wait_for_end_of(row);
    kill(batch, SIGTERM);
    const int end = wait_for(batch);
    assert_true(WIFSIGNALED(end) && WTERMSIG(end) == SIGTERM);
    assert_text("batch.err", "fit: interrupted; 1 row done now, 0 skipped, 0 failed, all kept in "
                             "out/results.jsonl: the same command goes on with the rest\n");
    assert_states("one done");
}

/* Oracle: a row ends with its batch, even where that has no time to end it. */
static void no_row_outlives_its_batch(void **state)
{
    (void)state;
    make_endless();
    const pid_t batch = start_batch(), row = wait_for_row(batch);
    kill(batch, SIGKILL);
    wait_for(batch);
    wait_for_end_of(row);
}

int main(int argc, char **argv)
{
    if (strcmp(argv[0], "row") == 0)
        return be_row(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_are_read_as_they_stand),
        cmocka_unit_test(wrong_lists_are_refused_with_line_and_column),
        cmocka_unit_test(damaged_lists_end_in_a_message),
        cmocka_unit_test(sizes_are_bounded),
        cmocka_unit_test(shards_are_even_and_stay_as_they_are),
        cmocka_unit_test(shards_are_two_numbers),
        tool_test(inputs_are_cells_and_the_files_they_lead_to),
        tool_test(results_are_only_added_to),
        cmocka_unit_test(rows_are_given_what_their_cells_say),
        cmocka_unit_test(rows_may_end_in_any_way),
        tool_test(rows_are_done_once_and_failed_ones_again),
        tool_test(shards_share_a_folder),
        tool_test(wrong_use_is_refused_before_any_work),
        tool_test(a_full_disk_loses_a_line_at_most),
        tool_test(a_row_that_is_killed_is_told_and_the_rest_done),
        tool_test(a_row_may_take_so_long_and_no_longer),
        tool_test(an_interrupted_batch_goes_on),
        tool_test(a_row_may_be_interrupted_before_its_batch),
        tool_test(no_row_outlives_its_batch),
    };
    return cmocka_run_group_tests(tests, remove_picture, NULL);
}
