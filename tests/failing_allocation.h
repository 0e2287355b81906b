/* Allocation number refused_call fails: the linker sends calls here (--wrap=malloc, calloc, realloc). */
#ifndef FAILING_ALLOCATION_H
#define FAILING_ALLOCATION_H

#include <stdlib.h>

static int call_count;   /* allocations asked for */
static int refused_call; /* which of them fails, from 1; 0 for none */

/* NOLINTBEGIN(bugprone-reserved-identifier): the names are the linker's. */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);

void *__wrap_malloc(size_t size)
{
    return ++call_count == refused_call ? NULL : __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
    return ++call_count == refused_call ? NULL : __real_calloc(count, size);
}

void *__wrap_realloc(void *old, size_t size)
{
    return ++call_count == refused_call ? NULL : __real_realloc(old, size);
}
/* NOLINTEND(bugprone-reserved-identifier) */

#endif
