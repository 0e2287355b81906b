#include "renderer/shadow_taps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define GOLDEN_ANGLE_RAD 2.39996322972865332223

/* Rounds after which a set of 25 no longer gets better, and points of the disc that are shared out. */
enum { ROUNDS = 20, POINTS_MIN = 4096, POINTS_PER_TAP = 128 };

/* How much of a share that is missing is given at once, as distance^2. */
#define GIVEN 0.25

void render_shadow_spiral(int count, double (*places)[2])
{
    for (int i = 0; i < count; i++) {
        const double radius = sqrt((i + 0.5) / count), angle = i * GOLDEN_ANGLE_RAD;
        places[i][0] = radius * cos(angle);
        places[i][1] = radius * sin(angle);
    }
}

/* What one tap has: how much more it takes than what is nearest to it, and the sum of its points. */
struct share {
    double more, count, sum[2];
};

/* Points of equal areas: the two-dimensional golden sequence, bent to the disc. */
static void point_of_disc(int index, double point[2])
{
    const double radius = sqrt(fmod(0.5 + index * 0.75487766624669276, 1));
    const double angle = 2 * PI * fmod(0.5 + index * 0.56984029099805327, 1);
    point[0] = radius * cos(angle);
    point[1] = radius * sin(angle);
}

static int owner_of(const double point[2], int count, const double (*places)[2], const struct share *shares)
{
    int owner = 0;
    double least = INFINITY;
    for (int i = 0; i < count; i++) {
        const double x = point[0] - places[i][0], y = point[1] - places[i][1];
        const double away = x * x + y * y - shares[i].more;
        if (away < least) {
            least = away;
            owner = i;
        }
    }
    return owner;
}

/* Share the points out, and put each tap in the middle of its own; what has too few takes more. */
static void relax(int count, int point_count, const double (*points)[2], double (*places)[2],
                  struct share *shares)
{
    for (int i = 0; i < count; i++)
        shares[i].count = shares[i].sum[0] = shares[i].sum[1] = 0;
    for (int p = 0; p < point_count; p++) {
        struct share *const share = &shares[owner_of(points[p], count, (const double(*)[2])places, shares)];
        share->count++;
        share->sum[0] += points[p][0];
        share->sum[1] += points[p][1];
    }
    for (int i = 0; i < count; i++) {
        shares[i].more += GIVEN * (1.0 / count - shares[i].count / point_count);
        for (int k = 0; k < 2 && shares[i].count > 0; k++)
            places[i][k] = shares[i].sum[k] / shares[i].count;
    }
}

bool render_shadow_taps(int count, double (*places)[2], dipole_status *status)
{
    render_shadow_spiral(count, places);
    if (count > RENDER_SHADOW_RELAXED_LIMIT)
        return true;
    const int wanted = POINTS_PER_TAP * count, point_count = wanted > POINTS_MIN ? wanted : POINTS_MIN;
    struct share *const shares = calloc((size_t)count, sizeof *shares);
    double(*const points)[2] = malloc((size_t)point_count * sizeof *points);
    const bool done = (shares && points) ||
                      dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d taps", count);
    for (int p = 0; done && p < point_count; p++)
        point_of_disc(p, points[p]);
    for (int round = 0; done && round < ROUNDS; round++)
        relax(count, point_count, (const double(*)[2])points, places, shares);
    free(shares);
    free(points);
    return done;
}
