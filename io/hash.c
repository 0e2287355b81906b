#include "io/hash.h"

#include <string.h>

#define FNV_PRIME UINT64_C(0x100000001b3)

void io_hash_bytes(uint64_t *hash, const void *data, size_t size)
{
    const unsigned char *const bytes = data;
    for (size_t i = 0; i < size; i++)
        *hash = (*hash ^ bytes[i]) * FNV_PRIME;
}

void io_hash_text(uint64_t *hash, const char *text)
{
    io_hash_bytes(hash, text, strlen(text) + 1);
}
