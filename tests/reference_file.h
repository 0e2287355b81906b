/* Reads tests/reference/NAME: lines that begin with # are comments, then a header line, then rows. */
#ifndef REFERENCE_FILE_H
#define REFERENCE_FILE_H

#include "check.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { REFERENCE_COLUMNS = 40 };

struct reference_file {
    FILE *file;
    char header_text[4096], row_text[4096];
    char *header[REFERENCE_COLUMNS], *row[REFERENCE_COLUMNS];
    int column_count;
};

static inline int reference_split(char *text, char **fields)
{
    int count = 0;
    bool is_quoted = false;
    text[strcspn(text, "\r\n")] = '\0';
    fields[count++] = text;
    for (char *c = text; *c != '\0'; c++) {
        if (*c == '"')
            is_quoted = !is_quoted;
        if (*c == ',' && !is_quoted && count < REFERENCE_COLUMNS) {
            *c = '\0';
            fields[count++] = c + 1;
        }
    }
    return count;
}

static inline bool reference_next(struct reference_file *reference)
{
    while (fgets(reference->row_text, sizeof reference->row_text, reference->file) != NULL)
        if (reference->row_text[0] != '#') {
            reference_split(reference->row_text, reference->row);
            return true;
        }
    fclose(reference->file);
    return false;
}

static inline void reference_open(struct reference_file *reference, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, SOURCE_FOLDER "/tests/reference/%s", name);
    reference->file = fopen(path, "r");
    assert_non_null(reference->file);
    do
        assert_non_null(fgets(reference->header_text, sizeof reference->header_text, reference->file));
    while (reference->header_text[0] == '#');
    reference->column_count = reference_split(reference->header_text, reference->header);
}

static inline const char *reference_text(const struct reference_file *reference, const char *column)
{
    for (int i = 0; i < reference->column_count; i++)
        if (strcmp(reference->header[i], column) == 0)
            return reference->row[i];
    fail_msg("no column %s", column);
    return NULL;
}

static inline double reference_number(const struct reference_file *reference, const char *column)
{
    return strtod(reference_text(reference, column), NULL);
}

#endif
