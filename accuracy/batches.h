/* Independent batches of a Monte Carlo: streams of random numbers, and statistics over them. */
#ifndef ACCURACY_BATCHES_H
#define ACCURACY_BATCHES_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* xoshiro256++ of Blackman and Vigna: the same on every machine. */
struct accuracy_stream {
    uint64_t s[4];
};

/* Stream number index of a seed. SplitMix64 fills the state, as the generator's authors advise. */
static inline struct accuracy_stream accuracy_stream_of(uint64_t seed, uint64_t index)
{
    struct accuracy_stream stream;
    uint64_t mix = seed + index * 0xd1342543de82ef95u;
    for (int i = 0; i < 4; i++) {
        uint64_t z = mix += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        stream.s[i] = z ^ (z >> 31);
    }
    return stream;
}

static inline uint64_t accuracy_bits(struct accuracy_stream *stream)
{
    uint64_t *const s = stream->s;
    const uint64_t sum = s[0] + s[3];
    const uint64_t result = ((sum << 23) | (sum >> 41)) + s[0], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = (s[3] << 45) | (s[3] >> 19);
    return result;
}

/* 0 < value <= 1: its logarithm is finite. */
static inline double accuracy_uniform(struct accuracy_stream *stream)
{
    return (double)((accuracy_bits(stream) >> 11) + 1) * 0x1p-53;
}

/* Mean of a column over count rows that are row_length apart, and one standard error of that mean. */
static inline void accuracy_judge(const double *column, size_t count, size_t row_length, double *mean,
                                  double *error)
{
    const double n = (double)count;
    double sum = 0, deviation2 = 0;
    for (size_t i = 0; i < count; i++)
        sum += column[i * row_length];
    *mean = sum / n;
    for (size_t i = 0; i < count; i++)
        deviation2 += (column[i * row_length] - *mean) * (column[i * row_length] - *mean);
    *error = sqrt(deviation2 / (n * (n - 1)));
}

#endif
