/* lutgen/parallel.c: a loop whose rounds are shared out among threads. */
#include "check.h"

#include "lutgen/parallel.h"

#include <stdlib.h>

enum { COUNT_LIMIT = 5000 };

struct tally {
    int calls[COUNT_LIMIT];
    double values[COUNT_LIMIT];
};

/* Without a lock: only one thread may come to an index, which the thread sanitizer sees, too. */
static void count_call(void *context, int index)
{
    struct tally *const tally = context;
    tally->calls[index]++;
    tally->values[index] = sqrt(index);
}

/* Oracle: the loop itself; every index below count once, none beyond, whatever the number of threads. */
static void every_index_once(void **state)
{
    (void)state;
    static const int thread_counts[] = { 0, 1, 2, 3, 7, 64, 1000, -1 };
    static const int counts[] = { 0, 1, 2, 3, 63, 64, 65, COUNT_LIMIT };
    struct tally *const tally = malloc(sizeof *tally);
    assert_non_null(tally);
    for (size_t t = 0; t < sizeof thread_counts / sizeof *thread_counts; t++)
        for (size_t n = 0; n < sizeof counts / sizeof *counts; n++) {
            *tally = (struct tally){ 0 };
            lut_parallel_for(counts[n], thread_counts[t], count_call, tally);
            for (int i = 0; i < COUNT_LIMIT; i++) {
                assert_int_equal(tally->calls[i], i < counts[n]);
                assert_true(tally->values[i] == (i < counts[n] ? sqrt(i) : 0));
            }
        }
    free(tally);
}

static void run_inside(void *context, int index)
{
    struct tally *const tallies = context;
    lut_parallel_for(100, 3, count_call, &tallies[index]);
}

/* Oracle: the same, for loops within a loop. */
static void loops_may_stand_in_loops(void **state)
{
    (void)state;
    enum { OUTER = 5 };
    struct tally *const tallies = calloc(OUTER, sizeof *tallies);
    assert_non_null(tallies);
    lut_parallel_for(OUTER, 4, run_inside, tallies);
    for (int k = 0; k < OUTER; k++)
        for (int i = 0; i < 101; i++)
            assert_int_equal(tallies[k].calls[i], i < 100);
    free(tallies);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_index_once),
        cmocka_unit_test(loops_may_stand_in_loops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
