#include "lutgen/parallel.h"

#include <stdatomic.h>
#include <threads.h>
#include <unistd.h>

enum { THREAD_LIMIT = 64 };

struct loop {
    int count;
    void (*body)(void *context, int index);
    void *context;
    atomic_int next;
};

static int work(void *argument)
{
    struct loop *const loop = argument;
    for (int i = atomic_fetch_add(&loop->next, 1); i < loop->count; i = atomic_fetch_add(&loop->next, 1))
        loop->body(loop->context, i);
    return 0;
}

void lut_parallel_for(int count, int thread_count, void (*body)(void *context, int index), void *context)
{
    struct loop loop = { .count = count, .body = body, .context = context };
    const long processors = thread_count > 0 ? thread_count : sysconf(_SC_NPROCESSORS_ONLN);
    const int wanted = (int)(processors < THREAD_LIMIT ? processors : THREAD_LIMIT);
    thrd_t threads[THREAD_LIMIT];
    int started = 0;
    while (started < wanted - 1 && started < count - 1 &&
           thrd_create(&threads[started], work, &loop) == thrd_success)
        started++;
    work(&loop);
    for (int i = 0; i < started; i++)
        thrd_join(threads[i], NULL);
}
