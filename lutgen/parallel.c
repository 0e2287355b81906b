#include "lutgen/parallel.h"

#include <pthread.h> /* and not C11 threads, which the thread sanitizer does not know */
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>

enum { THREAD_LIMIT = 64 };

struct loop {
    int count;
    void (*body)(void *context, int index);
    void *context;
    atomic_int next;
};

static void *work(void *argument)
{
    struct loop *const loop = argument;
    for (int i = atomic_fetch_add(&loop->next, 1); i < loop->count; i = atomic_fetch_add(&loop->next, 1))
        loop->body(loop->context, i);
    return NULL;
}

/* Those that this process may run on, which a batch system may have made fewer than there are. */
static long processor_count(void)
{
    cpu_set_t allowed;
    if (sched_getaffinity(0, sizeof allowed, &allowed) == 0)
        return CPU_COUNT(&allowed);
    return sysconf(_SC_NPROCESSORS_ONLN);
}

void lut_parallel_for(int count, int thread_count, void (*body)(void *context, int index), void *context)
{
    struct loop loop = { .count = count, .body = body, .context = context };
    const long processors = thread_count > 0 ? thread_count : processor_count();
    const int wanted = (int)(processors < THREAD_LIMIT ? processors : THREAD_LIMIT);
    pthread_t threads[THREAD_LIMIT];
    int started = 0;
    while (started < wanted - 1 && started < count - 1 &&
           pthread_create(&threads[started], NULL, work, &loop) == 0)
        started++;
    work(&loop);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
}
