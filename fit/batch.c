/* A batch: what is left of a list, a row at a time. */
#include "fit/batch_internal.h"

#include "io/file.h"
#include "io/json.h"

#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* A failed row, kept for the summary. */
struct failure {
    const char *name;
    char *message; /* NULL without memory */
};

struct batch {
    const struct cli_tool *tool;
    const struct cli_common *common;
    const struct fit_batch_request *request;
    size_t shard_index, shard_count; /* count 0: no shards                        */
    const char *flags[64];           /* that every row is given                   */
    char flag_texts[64][64];
    size_t flag_count;
    char folder[PATH_MAX]; /* absolute                                  */
    struct batch_list *list;
    struct batch_results results;
    size_t mine_count, skipped_count, done_count, failed_count;
    struct failure *failures; /* room for mine_count                       */
};

/* ---- the command line ----------------------------------------------------------------------------- */

static const struct cli_option *find_option(const struct cli_tool *tool, const char *name)
{
    for (const struct cli_option *option = tool->options; option->name; option++)
        if (strcmp(option->name, name) == 0)
            return option;
    return NULL;
}

static bool is_own(const char *name)
{
    return strcmp(name, FIT_BATCH_OPTION) == 0 || strcmp(name, FIT_BATCH_FOLDER_OPTION) == 0 ||
           strcmp(name, FIT_BATCH_SHARD_OPTION) == 0 || strcmp(name, FIT_BATCH_ROW_SECONDS_OPTION) == 0;
}

/* An option beside those of the batch: a flag goes to all rows, a value has a column. */
static bool take_option(struct batch *batch, const char *name, dipole_status *status)
{
    const struct cli_option *const option = find_option(batch->tool, name);
    if (!option || is_own(name)) /* --json and --quiet are of all programs */
        return true;
    if (option->kind != CLI_FLAG)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "--%s is given with --batch, expected a column \"%s\" in the list", name, name);
    const size_t i = batch->flag_count++;
    snprintf(batch->flag_texts[i], sizeof batch->flag_texts[i], "--%s", name);
    batch->flags[i] = batch->flag_texts[i];
    return true;
}

static bool check_request(const struct fit_batch_request *request, dipole_status *status)
{
    if (!request->list_path)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "--%s is given without --batch LIST.csv",
                           request->shard ? FIT_BATCH_SHARD_OPTION : FIT_BATCH_ROW_SECONDS_OPTION);
    return request->folder ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                       "no --" FIT_BATCH_FOLDER_OPTION " (-o) FOLDER was given; try --help");
}

/* Read argv a second time, for what was given and not for what it was set to. */
static bool read_arguments(struct batch *batch, int argc, char **argv, dipole_status *status)
{
    enum { LIMIT = 64 };
    struct option options[LIMIT + 3] = { { 0 } };
    char letters[2 * LIMIT + 8] = "q";
    size_t count = 0, letter_count = 1;
    for (const struct cli_option *row = batch->tool->options; row->name && count < LIMIT; row++) {
        options[count++] =
            (struct option){ .name = row->name,
                             .has_arg = row->kind == CLI_FLAG ? no_argument : required_argument };
        if (row->letter) {
            letters[letter_count++] = row->letter;
            if (row->kind != CLI_FLAG)
                letters[letter_count++] = ':';
        }
    }
    options[count++] = (struct option){ .name = "json" };
    options[count] = (struct option){ .name = "quiet" };
    optind = 0;
    int index = 0;
    for (int code; (code = getopt_long(argc, argv, letters, options, &index)) != -1;) {
        const char *name = code == 0 ? options[index].name : "";
        for (const struct cli_option *row = batch->tool->options; code != 0 && row->name; row++)
            if (row->letter == code)
                name = row->name;
        if (batch->flag_count == sizeof batch->flags / sizeof batch->flags[0] ||
            !take_option(batch, name, status))
            return false;
    }
    if (optind < argc)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "\"%.100s\" is given with --batch, expected columns \"scene\" and \"target\" in "
                           "the list",
                           argv[optind]);
    const char *const shard = batch->request->shard;
    return !shard || batch_shard_parse(shard, &batch->shard_index, &batch->shard_count) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                       "--shard is \"%.100s\", expected I/N with 1 <= I <= N <= %zu", shard,
                       BATCH_ROW_LIMIT);
}

/* ---- what is done already ------------------------------------------------------------------------- */

static uint64_t inputs_of(struct batch *batch, struct batch_row *row)
{
    if (!row->has_inputs)
        row->inputs = batch_inputs_hash(batch->list, row, batch->flags, batch->flag_count);
    row->has_inputs = true;
    return row->inputs;
}

static bool output_path_of(const struct batch *batch, const char *name, char out[PATH_MAX])
{
    const int length = snprintf(out, PATH_MAX, "%s/%s.json", batch->folder, name);
    return length > 0 && length < PATH_MAX;
}

struct hash_text {
    char text[17];
};

static struct hash_text hash_print(uint64_t hash)
{
    struct hash_text out;
    snprintf(out.text, sizeof out.text, "%016" PRIx64, hash);
    return out;
}

static bool is_text(json_t *line, const char *key, const char *expected)
{
    const char *const text = json_string_value(json_object_get(line, key));
    return text && strcmp(text, expected) == 0;
}

/*
 * A row is done when a line says so whose inputs are those of now, and the file that it wrote is there as
 * it was written: lines of other inputs may be the later ones, in this file or another.
 */
static void look_at_line(void *context, json_t *line)
{
    struct batch *const batch = context;
    const char *const name = json_string_value(json_object_get(line, "name"));
    struct batch_row *const row = name ? batch_list_find(batch->list, name) : NULL;
    char path[PATH_MAX];
    uint64_t output;
    if (!row || !row->is_mine || row->is_done || !is_text(line, "status", "done") ||
        !output_path_of(batch, name, path) || !batch_file_hash(path, &output) ||
        !is_text(line, "output", hash_print(output).text))
        return;
    row->is_done = is_text(line, "inputs", hash_print(inputs_of(batch, row)).text);
}

/* Choose the rows of this shard, and among them those that are done. */
static bool look_back(struct batch *batch, dipole_status *status)
{
    size_t ignored = 0;
    for (size_t i = 0; i < batch->list->row_count; i++) {
        struct batch_row *const row = &batch->list->rows[i];
        row->is_mine =
            batch->shard_count == 0 || batch_shard_of(row->name, batch->shard_count) == batch->shard_index;
        batch->mine_count += row->is_mine;
    }
    if (!batch_results_read(batch->request->folder, look_at_line, batch, &ignored, status))
        return false;
    if (ignored > 0)
        cli_note(batch->tool, batch->common,
                 "%s: %zu line%s of results*.jsonl cannot be read and count%s "
                 "for nothing",
                 batch->request->folder, ignored, ignored == 1 ? "" : "s", ignored == 1 ? "s" : "");
    batch->failures = calloc(batch->mine_count + 1, sizeof *batch->failures);
    return batch->failures ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu rows", batch->mine_count);
}

/* ---- rows ----------------------------------------------------------------------------------------- */

/* NULL without memory. */
static json_t *result_line(struct batch *batch, struct batch_row *row, const char *output,
                           const struct batch_outcome *outcome)
{
    char now[32];
    const time_t seconds = time(NULL);
    struct tm parts;
    gmtime_r(&seconds, &parts);
    strftime(now, sizeof now, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return json_pack("{s:s, s:s, s:i, s:s, s:f, s:s, s:s, s:s?, s:O?}", "name", row->name, "status",
                     outcome->is_done ? "done" : "failed", "exit_code", outcome->exit_code, "message",
                     outcome->message, "seconds", round(1e3 * outcome->seconds) / 1e3, "finished", now,
                     "inputs", hash_print(inputs_of(batch, row)).text, "output", output, "fit",
                     outcome->fit);
}

/* Write down what became of a row, and count it. */
static bool record(struct batch *batch, struct batch_row *row, const char *output_path,
                   struct batch_outcome *outcome, dipole_status *status)
{
    uint64_t output;
    if (outcome->is_done && !batch_file_hash(output_path, &output)) {
        outcome->is_done = false;
        snprintf(outcome->message, sizeof outcome->message, "wrote no file");
    }
    const struct hash_text text = hash_print(outcome->is_done ? output : 0);
    json_t *const line = result_line(batch, row, outcome->is_done ? text.text : NULL, outcome);
    const bool done = line ? batch_results_append(&batch->results, line, status)
                           : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a result");
    json_decref(line);
    if (outcome->is_done)
        batch->done_count++;
    else
        batch->failures[batch->failed_count++] =
            (struct failure){ .name = row->name, .message = strdup(outcome->message) };
    return done;
}

static bool run_row(struct batch *batch, struct batch_row *row, dipole_status *status)
{
    char output_path[PATH_MAX];
    struct batch_outcome outcome;
    inputs_of(batch, row); /* before: what changes under way is done anew next time */
    if (!output_path_of(batch, row->name, output_path)) {
        const dipole_place place = { .source = batch->request->folder };
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "the path is too long");
    }
    if (!batch_row_run(batch->tool, batch->list, row, batch->flags, batch->flag_count, output_path,
                       batch->request->row_seconds, &outcome, status))
        return false;
    const bool done = outcome.is_interrupted || record(batch, row, output_path, &outcome, status);
    json_decref(outcome.fit);
    return done;
}

/* Rows until all are done or a signal comes. */
static bool run_rows(struct batch *batch, dipole_status *status)
{
    struct cli_progress progress;
    cli_progress_start(&progress, batch->tool, batch->common);
    bool done = true;
    size_t seen_count = 0, run_count = 0;
    for (size_t i = 0; i < batch->list->row_count && done && !batch_signal(); i++) {
        struct batch_row *const row = &batch->list->rows[i];
        if (!row->is_mine)
            continue;
        seen_count++;
        if (row->is_done) {
            batch->skipped_count++;
            continue;
        }
        char what[BATCH_NAME_LIMIT + 64];
        snprintf(what, sizeof what, "%.40s, row %zu of %zu", row->name, seen_count, batch->mine_count);
        cli_progress_show(&progress, what,
                          run_count == 0 ? 0.0 : (double)(seen_count - 1) / (double)batch->mine_count);
        run_count++;
        done = run_row(batch, row, status);
    }
    cli_progress_show(&progress, "done", 1.0);
    return done;
}

/* ---- the summary ---------------------------------------------------------------------------------- */

static const char *message_of(const struct failure *failure)
{
    return failure->message ? failure->message : "";
}

static bool print_json(const struct batch *batch, dipole_status *status)
{
    json_t *const failed = json_array();
    bool done = failed;
    for (size_t i = 0; i < batch->failed_count && done; i++) {
        json_t *const entry = json_pack("{s:s, s:s}", "name", batch->failures[i].name, "message",
                                        message_of(&batch->failures[i]));
        done = entry && json_array_append_new(failed, entry) == 0;
    }
    json_t *const root =
        done ? json_pack("{s:I, s:I, s:O, s:s}", "done", (json_int_t)batch->done_count, "skipped",
                         (json_int_t)batch->skipped_count, "failed", failed, "results", batch->results.path)
             : NULL;
    char *const text = root ? io_json_format(root) : NULL;
    if (text)
        fputs(text, stdout);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the summary");
    done = text;
    free(text);
    json_decref(root);
    json_decref(failed);
    return done;
}

static bool print_summary(const struct batch *batch, dipole_status *status)
{
    if (batch->common->json) {
        if (!print_json(batch, status))
            return false;
    } else {
        printf("    done  skipped   failed\n    rows     rows     rows\n%8zu %8zu %8zu\n",
               batch->done_count, batch->skipped_count, batch->failed_count);
        for (size_t i = 0; i < batch->failed_count; i++)
            printf("failed: %s: %s\n", batch->failures[i].name, message_of(&batch->failures[i]));
        printf("results: %s\n", batch->results.path);
    }
    return cli_stdout_finish(status);
}

/* ---- a batch -------------------------------------------------------------------------------------- */

static bool prepare(struct batch *batch, dipole_status *status)
{
    const struct fit_batch_request *const request = batch->request;
    const dipole_place place = { .source = request->folder };
    if (!batch_list_read(request->list_path, batch->tool, &batch->list, status) ||
        !io_folder_make(request->folder, status))
        return false;
    if (!realpath(request->folder, batch->folder))
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "the folder cannot be used");
    return batch_results_open(request->folder, batch->shard_index, batch->shard_count, &batch->results,
                              status) &&
           look_back(batch, status);
}

static void finish(struct batch *batch)
{
    for (size_t i = 0; i < batch->failed_count; i++)
        free(batch->failures[i].message);
    free(batch->failures);
    batch_results_close(&batch->results);
    batch_list_destroy(batch->list);
}

int fit_batch_run(const struct cli_tool *tool, const struct cli_common *common, int argc, char **argv,
                  const struct fit_batch_request *request)
{
    dipole_status status = { 0 };
    struct batch batch = { .tool = tool, .common = common, .request = request, .results.file = -1 };
    if (!check_request(request, &status) || !read_arguments(&batch, argc, argv, &status))
        return cli_report(tool, &status, EXIT_USAGE);
    batch_signals_take();
    const bool done = prepare(&batch, &status) && run_rows(&batch, &status);
    const bool is_interrupted = done && batch_signal();
    if (is_interrupted)
        fprintf(stderr,
                "%s: interrupted; %zu row%s done now, %zu skipped, %zu failed, all kept in %s: the same "
                "command goes on with the rest\n",
                tool->name, batch.done_count, batch.done_count == 1 ? "" : "s", batch.skipped_count,
                batch.failed_count, batch.results.path);
    const bool is_told = done && (is_interrupted || print_summary(&batch, &status));
    const bool is_good = is_told && batch.failed_count == 0;
    if (!is_told)
        cli_report(tool, &status, EXIT_FAILED);
    finish(&batch);
    if (batch_signal())
        batch_signal_end();
    return is_good ? EXIT_DONE : EXIT_FAILED;
}
