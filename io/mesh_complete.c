#include "io/mesh_complete.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static uint32_t little_endian_32(const unsigned char *bytes)
{
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* ---- PLY ----------------------------------------------------------------------------------------- */

enum { ELEMENT_LIMIT = 16, PROPERTY_LIMIT = 64 };

struct property {
    size_t count_bytes; /* of a list's length; 0 for a single number */
    size_t item_bytes;
};

struct element {
    uint64_t row_count;
    size_t property_count;
    struct property properties[PROPERTY_LIMIT];
};

struct ply_header {
    enum { PLY_ASCII = 0, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } format;
    size_t element_count;
    struct element elements[ELEMENT_LIMIT];
    size_t data_offset;
};

/* Size of a number by its type's name, 0 if there is no such type. */
static size_t type_bytes(const char *name)
{
    static const struct {
        const char *name;
        size_t bytes;
    } types[] = {
        { "char", 1 },  { "uchar", 1 },   { "int8", 1 },   { "uint8", 1 },
        { "short", 2 }, { "ushort", 2 },  { "int16", 2 },  { "uint16", 2 },
        { "int", 4 },   { "uint", 4 },    { "int32", 4 },  { "uint32", 4 },
        { "float", 4 }, { "float32", 4 }, { "double", 8 }, { "float64", 8 },
    };
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (strcmp(types[i].name, name) == 0)
            return types[i].bytes;
    return 0;
}

/* One line of the header; false if it means nothing here. */
static bool read_header_line(const char *line, struct ply_header *header)
{
    char first[32], second[32], third[32];
    unsigned long long count;
    if (sscanf(line, "format %31s", first) == 1) {
        header->format = strcmp(first, "ascii") == 0                  ? PLY_ASCII
                         : strcmp(first, "binary_little_endian") == 0 ? PLY_LITTLE_ENDIAN
                                                                      : PLY_BIG_ENDIAN;
        return true;
    }
    if (sscanf(line, "element %31s %llu", first, &count) == 2) {
        if (header->element_count == ELEMENT_LIMIT)
            return false;
        header->elements[header->element_count++] = (struct element){ .row_count = count };
        return true;
    }
    if (strncmp(line, "property", 8) != 0)
        return true;
    if (header->element_count == 0)
        return false;
    struct element *element = &header->elements[header->element_count - 1];
    if (element->property_count == PROPERTY_LIMIT)
        return false;
    struct property *property = &element->properties[element->property_count++];
    if (sscanf(line, "property list %31s %31s %31s", first, second, third) == 3) {
        property->count_bytes = type_bytes(first);
        property->item_bytes = type_bytes(second);
        return property->count_bytes > 0 && property->item_bytes > 0;
    }
    if (sscanf(line, "property %31s %31s", first, second) != 2)
        return false;
    property->count_bytes = 0;
    property->item_bytes = type_bytes(first);
    return property->item_bytes > 0;
}

enum header_outcome { HEADER_READ, HEADER_CUT, HEADER_UNKNOWN };

static enum header_outcome read_header(const unsigned char *data, size_t size, struct ply_header *header)
{
    *header = (struct ply_header){ 0 };
    if (size < 4 || memcmp(data, "ply", 3) != 0)
        return HEADER_UNKNOWN;
    for (size_t offset = 0; offset < size;) {
        char line[256] = "";
        size_t length = 0;
        while (offset < size && data[offset] != '\n' && data[offset] != '\r') {
            if (length < sizeof line - 1)
                line[length++] = (char)data[offset];
            offset++;
        }
        if (offset == size)
            return HEADER_CUT;
        offset += data[offset] == '\r' && offset + 1 < size && data[offset + 1] == '\n' ? 2 : 1;
        header->data_offset = offset;
        if (strncmp(line, "end_header", 10) == 0)
            return HEADER_READ;
        if (!read_header_line(line, header))
            return HEADER_UNKNOWN;
    }
    return HEADER_CUT;
}

/* A list's length as it stands in the file. */
static uint64_t list_length(const unsigned char *bytes, size_t count, bool is_big_endian)
{
    uint64_t value = 0;
    for (size_t i = 0; i < count; i++)
        value = value << 8 | bytes[is_big_endian ? i : count - 1 - i];
    return value;
}

/* Walk one row; false when it ends beyond the data. */
static bool skip_row(const struct element *element, bool is_big_endian, const unsigned char *data,
                     size_t size, size_t *offset)
{
    for (size_t i = 0; i < element->property_count; i++) {
        const struct property *property = &element->properties[i];
        uint64_t item_count = 1;
        if (property->count_bytes > size - *offset)
            return false;
        if (property->count_bytes > 0)
            item_count = list_length(data + *offset, property->count_bytes, is_big_endian);
        *offset += property->count_bytes;
        if (item_count > (size - *offset) / property->item_bytes)
            return false;
        *offset += (size_t)item_count * property->item_bytes;
    }
    return true;
}

/* Every row takes at least one byte, so the walk ends with the data, whatever the header claims. */
static bool has_binary_rows(const struct ply_header *header, const unsigned char *data, size_t size)
{
    size_t offset = header->data_offset;
    for (size_t i = 0; i < header->element_count; i++) {
        const struct element *element = &header->elements[i];
        for (uint64_t row = 0; element->property_count > 0 && row < element->row_count; row++)
            if (!skip_row(element, header->format == PLY_BIG_ENDIAN, data, size, &offset))
                return false;
    }
    return true;
}

/* In text a row is a line. */
static bool has_text_rows(const struct ply_header *header, const unsigned char *data, size_t size)
{
    uint64_t line_count = 0;
    bool is_blank = true;
    for (size_t offset = header->data_offset; offset < size; offset++) {
        const bool is_end = data[offset] == '\n' || data[offset] == '\r';
        line_count += is_blank && !is_end && !isspace(data[offset]);
        is_blank = is_end || (is_blank && isspace(data[offset]));
    }
    for (size_t i = 0; i < header->element_count; i++) {
        const struct element *element = &header->elements[i];
        if (element->property_count == 0)
            continue;
        if (element->row_count > line_count)
            return false;
        line_count -= element->row_count;
    }
    return true;
}

static bool is_complete_ply(const unsigned char *data, size_t size)
{
    struct ply_header header;
    switch (read_header(data, size, &header)) {
    case HEADER_CUT:
        return false;
    case HEADER_UNKNOWN:
        return true;
    case HEADER_READ:
        break;
    }
    return header.format == PLY_ASCII ? has_text_rows(&header, data, size)
                                      : has_binary_rows(&header, data, size);
}

/* ---- STL and 3DS --------------------------------------------------------------------------------- */

enum { STL_HEADER_BYTES = 84, STL_TRIANGLE_BYTES = 50, STL_TAIL_BYTES = 1024 };

/* Text begins with "solid", but so do the free headers of some binary files: those have zeros in them. */
static bool is_complete_stl(const unsigned char *data, size_t size)
{
    const size_t head = size < STL_HEADER_BYTES ? size : STL_HEADER_BYTES;
    const bool is_text =
        size >= 5 && strncasecmp((const char *)data, "solid", 5) == 0 && memchr(data, '\0', head) == NULL;
    if (!is_text)
        return size >= STL_HEADER_BYTES &&
               little_endian_32(data + 80) <= (size - STL_HEADER_BYTES) / STL_TRIANGLE_BYTES;
    const size_t tail = size < STL_TAIL_BYTES ? size : STL_TAIL_BYTES;
    for (size_t i = size - tail; i + 8 <= size; i++)
        if (strncasecmp((const char *)data + i, "endsolid", 8) == 0)
            return true;
    return false;
}

static bool is_complete_3ds(const unsigned char *data, size_t size)
{
    const bool is_3ds = size >= 2 && data[0] == 0x4d && data[1] == 0x4d;
    return !is_3ds || (size >= 6 && little_endian_32(data + 2) <= size);
}

bool io_mesh_is_complete(const unsigned char *data, size_t size, const char *extension)
{
    if (strcasecmp(extension, "ply") == 0)
        return is_complete_ply(data, size);
    if (strcasecmp(extension, "stl") == 0)
        return is_complete_stl(data, size);
    if (strcasecmp(extension, "3ds") == 0)
        return is_complete_3ds(data, size);
    return true;
}
