/* The list of a batch: which rows there are, and what each is given. */
#include "fit/batch_internal.h"

#include "io/csv.h"
#include "io/file.h"
#include "io/hash.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* ---- columns -------------------------------------------------------------------------------------- */

static const struct batch_column fixed_columns[] = {
    { .kind = BATCH_NAME, .name = "name" },
    { .kind = BATCH_SCENE, .name = "scene" },
    { .kind = BATCH_TARGET, .name = "target" },
};
enum { FIXED_COUNT = sizeof fixed_columns / sizeof fixed_columns[0] };

/* Options that take a value, but for those that say how the batch is run. */
static bool is_column(const struct cli_option *option)
{
    static const char *const own[] = { FIT_BATCH_OPTION, FIT_BATCH_FOLDER_OPTION, FIT_BATCH_SHARD_OPTION,
                                       FIT_BATCH_ROW_SECONDS_OPTION };
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++)
        if (strcmp(option->name, own[i]) == 0)
            return false;
    return option->kind != CLI_FLAG;
}

bool batch_column_is_several(const struct batch_column *column)
{
    return column->kind == BATCH_SCENE || column->kind == BATCH_TARGET ||
           (column->kind == BATCH_OPTION && column->option->kind == CLI_TEXTS);
}

static bool find_column(const struct cli_tool *tool, const struct io_csv_field *field,
                        struct batch_column *out)
{
    for (size_t i = 0; i < FIXED_COUNT; i++)
        if (io_csv_equals(field, fixed_columns[i].name)) {
            *out = fixed_columns[i];
            return true;
        }
    for (const struct cli_option *option = tool->options; option->name; option++)
        if (is_column(option) && io_csv_equals(field, option->name)) {
            *out = (struct batch_column){ .kind = BATCH_OPTION, .option = option, .name = option->name };
            return true;
        }
    return false;
}

/* "name, scene, target, eta, ...", as far as it fits. */
static const char *known_columns(const struct cli_tool *tool, char *out, size_t size)
{
    size_t length = (size_t)snprintf(out, size, "name, scene, target");
    for (const struct cli_option *option = tool->options; option->name; option++)
        if (is_column(option) && length + strlen(option->name) + 3 < size)
            length += (size_t)snprintf(out + length, size - length, ", %s", option->name);
    return out;
}

static bool name_column(struct batch_list *list, const struct cli_tool *tool, const struct io_csv *csv,
                        size_t field, dipole_status *status)
{
    const dipole_place place = io_csv_place(csv, csv->fields[field].start);
    struct batch_column *const column = &list->columns[field];
    char text[64], known[300];
    if (!find_column(tool, &csv->fields[field], column))
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "unknown column \"%s\", expected some of %s",
                           io_csv_printable(&csv->fields[field], text),
                           known_columns(tool, known, sizeof known));
    for (size_t i = 0; i < field; i++)
        if (strcmp(list->columns[i].name, column->name) == 0)
            return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                               "column \"%s\" is the second of its name, expected one", column->name);
    return true;
}

/* Index of the first column of a kind; column_count when there is none. */
static size_t column_of(const struct batch_list *list, enum batch_column_kind kind)
{
    size_t i = 0;
    while (i < list->column_count && list->columns[i].kind != kind)
        i++;
    return i;
}

static bool read_header(struct batch_list *list, const struct cli_tool *tool, struct io_csv *csv,
                        dipole_status *status)
{
    char known[300];
    const enum io_csv_next next = io_csv_next(csv, status);
    if (next == IO_CSV_FAILED)
        return false;
    if (next == IO_CSV_END) {
        const dipole_place place = { .source = csv->source };
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                           "has no header line, expected name and some of %s",
                           known_columns(tool, known, sizeof known) + strlen("name, "));
    }
    list->column_count = csv->field_count;
    for (size_t i = 0; i < csv->field_count; i++)
        if (!name_column(list, tool, csv, i, status))
            return false;
    const dipole_place place = io_csv_place(csv, csv->line_start);
    return column_of(list, BATCH_NAME) < list->column_count ||
           dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "the header has no column \"name\"");
}

/* ---- rows ----------------------------------------------------------------------------------------- */

/* Names are those of files: nothing that leads elsewhere or hides. */
static bool check_name(const struct io_csv *csv, const struct io_csv_field *field, dipole_status *status)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    bool is_good = field->length > 0 && field->length <= BATCH_NAME_LIMIT && field->text[0] != '.';
    for (size_t i = 0; i < field->length && is_good; i++)
        is_good = memchr(allowed, field->text[i], sizeof allowed - 1) != NULL;
    if (is_good)
        return true;
    const dipole_place place = io_csv_place(csv, field->start);
    char text[64];
    return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                       "name is \"%s\", expected 1 to %d of A-Z, a-z, 0-9, '.', '_' and '-', the first no "
                       "'.'",
                       io_csv_printable(field, text), BATCH_NAME_LIMIT);
}

static size_t count_parts(const struct io_csv_field *field)
{
    size_t count = field->length > 0;
    for (size_t i = 0; i < field->length; i++)
        count += field->text[i] == BATCH_SEPARATOR;
    return count;
}

/* Cells go to programs as arguments, which end with a zero byte. */
static bool check_cell(const struct io_csv *csv, const struct batch_list *list, size_t column,
                       dipole_status *status)
{
    const struct io_csv_field *const field = &csv->fields[column];
    char text[64];
    for (size_t i = 0; i < field->length; i++)
        if ((unsigned char)field->text[i] < 0x20 || field->text[i] == 0x7f) {
            const dipole_place place = io_csv_place(csv, field->start);
            return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                               "%s is \"%s\", which has a control character", list->columns[column].name,
                               io_csv_printable(field, text));
        }
    return true;
}

static bool check_row(const struct io_csv *csv, const struct batch_list *list, dipole_status *status)
{
    if (csv->field_count != list->column_count) {
        const dipole_place place = io_csv_place(csv, csv->line_start);
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                           "the line has %zu column%s, expected the %zu of the header", csv->field_count,
                           csv->field_count == 1 ? "" : "s", list->column_count);
    }
    for (size_t i = 0; i < list->column_count; i++)
        if (!check_cell(csv, list, i, status))
            return false;
    const size_t scene = column_of(list, BATCH_SCENE), target = column_of(list, BATCH_TARGET);
    const size_t scene_count = scene < list->column_count ? count_parts(&csv->fields[scene]) : 0,
                 target_count = target < list->column_count ? count_parts(&csv->fields[target]) : 0;
    if (scene_count != target_count) {
        const dipole_place place = io_csv_place(csv, csv->line_start);
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "%zu scene%s and %zu target%s, expected as many of both, with %c between",
                           scene_count, scene_count == 1 ? "" : "s", target_count,
                           target_count == 1 ? "" : "s", BATCH_SEPARATOR);
    }
    return check_name(csv, &csv->fields[column_of(list, BATCH_NAME)], status);
}

/* Cells follow one another in list->text, which has room for all: each is followed by a comma or the end of
 * a line in the file, where here its zero byte is. */
static void keep_row(const struct io_csv *csv, struct batch_list *list, char **text)
{
    struct batch_row *const row = &list->rows[list->row_count++];
    *row = (struct batch_row){ .cells = *text, .line = csv->line_number };
    for (size_t i = 0; i < list->column_count; i++) {
        if (list->columns[i].kind == BATCH_NAME)
            row->name = *text;
        memcpy(*text, csv->fields[i].text, csv->fields[i].length);
        *text += csv->fields[i].length;
        *(*text)++ = '\0';
    }
}

static bool read_rows(struct batch_list *list, size_t capacity, struct io_csv *csv, dipole_status *status)
{
    char *text = list->text;
    for (;;) {
        const enum io_csv_next next = io_csv_next(csv, status);
        if (next == IO_CSV_FAILED)
            return false;
        if (next == IO_CSV_END)
            break;
        if (list->row_count == capacity) {
            const dipole_place place = io_csv_place(csv, csv->line_start);
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "the list has more than %zu rows",
                               capacity);
        }
        if (!check_row(csv, list, status))
            return false;
        keep_row(csv, list, &text);
    }
    const dipole_place place = { .source = csv->source };
    return list->row_count > 0 ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place, "has a header and no rows, expected at least one");
}

/* ---- names ---------------------------------------------------------------------------------------- */

/* By name, then by line. */
static int compare_rows(const void *a, const void *b)
{
    const struct batch_row *const left = *(struct batch_row *const *)a, *const right =
                                                                            *(struct batch_row *const *)b;
    const int order = strcmp(left->name, right->name);
    return order ? order : (left->line > right->line) - (left->line < right->line);
}

static bool sort_names(struct batch_list *list, const char *source, dipole_status *status)
{
    const struct batch_row *first = NULL, *again = NULL; /* the pair that ends first in the file */
    for (size_t i = 0; i < list->row_count; i++)
        list->by_name[i] = &list->rows[i];
    qsort(list->by_name, list->row_count, sizeof(struct batch_row *), compare_rows);
    for (size_t i = 1; i < list->row_count; i++) {
        const struct batch_row *const left = list->by_name[i - 1], *const right = list->by_name[i];
        if (strcmp(left->name, right->name) == 0 && (!again || right->line < again->line)) {
            first = left;
            again = right;
        }
    }
    const dipole_place place = { .source = source, .line = again ? again->line : 0, .column = 1 };
    return !again || dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                                 "name \"%s\" stands in line %d, too, expected names that differ",
                                 again->name, first->line);
}

struct batch_row *batch_list_find(const struct batch_list *list, const char *name)
{
    size_t low = 0, high = list->row_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        const int order = strcmp(list->by_name[middle]->name, name);
        if (order == 0)
            return list->by_name[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

size_t batch_shard_of(const char *name, size_t count)
{
    uint64_t z = IO_HASH_START;
    io_hash_text(&z, name);
    /* SplitMix64's last steps: names that differ in their last character alone differ in all bits */
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (size_t)((z ^ (z >> 31)) % count);
}

/* Digits alone, 1 to BATCH_ROW_LIMIT, up to end. */
static bool parse_count(const char *text, char end, size_t *out)
{
    const size_t length = strspn(text, "0123456789");
    if (length == 0 || length > 7 || text[length] != end)
        return false;
    *out = (size_t)strtoul(text, NULL, 10);
    return *out >= 1 && *out <= BATCH_ROW_LIMIT;
}

bool batch_shard_parse(const char *text, size_t *index_out, size_t *count_out)
{
    size_t number;
    const char *const slash = strchr(text, '/');
    if (!slash || !parse_count(text, '/', &number) || !parse_count(slash + 1, '\0', count_out) ||
        number > *count_out)
        return false;
    *index_out = number - 1;
    return true;
}

/* ---- lists ---------------------------------------------------------------------------------------- */

void batch_list_destroy(struct batch_list *list)
{
    if (!list)
        return;
    free(list->rows);
    free(list->by_name);
    free(list->text);
    free(list);
}

static bool parse(struct batch_list *list, const struct cli_tool *tool, struct io_csv *csv,
                  dipole_status *status)
{
    if (!read_header(list, tool, csv, status))
        return false;
    const size_t line_count = io_csv_count_lines(csv);
    const size_t capacity = line_count < BATCH_ROW_LIMIT ? line_count : BATCH_ROW_LIMIT;
    list->rows = malloc(capacity * sizeof *list->rows);
    list->by_name = malloc(capacity * sizeof(struct batch_row *));
    list->text = malloc((size_t)(csv->end - csv->next) + 1);
    if (!list->rows || !list->by_name || !list->text)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu rows", capacity);
    return read_rows(list, capacity, csv, status) && sort_names(list, csv->source, status);
}

bool batch_list_parse(const char *text, size_t size, const char *source, const struct cli_tool *tool,
                      struct batch_list **out, dipole_status *status)
{
    *out = NULL;
    struct batch_list *list = calloc(1, sizeof *list);
    struct io_csv *const csv = malloc(sizeof *csv);
    bool done = false;
    if (list && csv) {
        io_csv_init(csv, text, size, source, IO_CSV_LINE_LIMIT);
        done = parse(list, tool, csv, status);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to read %.100s", source);
    }
    free(csv);
    if (done)
        *out = list;
    else
        batch_list_destroy(list);
    return done;
}

/* The folder that the list is in, absolute. */
static bool find_folder(const char *path, char out[PATH_MAX], dipole_status *status)
{
    char folder[PATH_MAX];
    const char *const slash = strrchr(path, '/');
    const dipole_place place = { .source = path };
    const size_t length = slash ? (size_t)(slash - path) + 1 : 1;
    if (length >= sizeof folder)
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "its path is too long");
    memcpy(folder, slash ? path : ".", length);
    folder[length] = '\0';
    return realpath(folder, out) || dipole_fail(status, DIPOLE_IO_FAILED, &place,
                                                "its folder cannot be used: %s", strerrordesc_np(errno));
}

bool batch_list_read(const char *path, const struct cli_tool *tool, struct batch_list **out,
                     dipole_status *status)
{
    *out = NULL;
    char *text = NULL;
    size_t size = 0;
    bool done = io_file_read(path, BATCH_LIST_SIZE_LIMIT, &text, &size, status) &&
                batch_list_parse(text, size, path, tool, out, status);
    free(text);
    if (done && !find_folder(path, (*out)->folder, status)) {
        batch_list_destroy(*out);
        *out = NULL;
        done = false;
    }
    return done;
}
