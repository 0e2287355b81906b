/* FNV-1a, 64 bit: tells whether something changed. No protection against who means to deceive. */
#ifndef IO_HASH_H
#define IO_HASH_H

#include <stddef.h>
#include <stdint.h>

#define IO_HASH_START UINT64_C(0xcbf29ce484222325)

/* Begin with *hash = IO_HASH_START. */
void io_hash_bytes(uint64_t *hash, const void *data, size_t size);
void io_hash_text(uint64_t *hash, const char *text); /* with its end */

#endif
