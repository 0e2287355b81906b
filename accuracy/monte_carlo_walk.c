/* Light after its first scattering, one photon at a time. docs/theory.md T77. */
#include "accuracy/monte_carlo_parts.h"

#include <math.h>

/* Photons below this part of their first power play Russian roulette, and survive as often. */
#define ROULETTE 0.2

/* No light is followed for longer. */
enum { EVENT_LIMIT = 1 << 20 };

struct photon {
    double x_mm, y_mm, z_mm; /* z from the top of its layer */
    double ux, uy, uz;
    double left;             /* to the next scattering, in mean free paths */
    double weight, absorbed; /* absorbed: in this layer, not yet counted */
    int layer;
};

/* ---- random numbers ------------------------------------------------------------------------------- */

/* Exponential with mean 1, above 0, by the ziggurat of Marsaglia and Tsang 2000: no logarithm, mostly. */
static inline double draw_exponential(const struct mc_walk *walk, struct accuracy_stream *stream)
{
    double start = 0;
    for (;;) {
        const uint64_t bits = accuracy_bits(stream); /* the lowest choose a level, the rest a place */
        const int i = (int)(bits % ZIGGURAT_LEVELS);
        const double x = ((double)(bits >> 11) + 0.5) * 0x1p-53 * walk->level[i];
        if (x < walk->level[i + 1])
            return start + x;
        if (i == 0) /* the tail is an exponential again */
            start += walk->level[1];
        else if (walk->height[i] + accuracy_uniform(stream) * (walk->height[i + 1] - walk->height[i]) <
                 exp(-x))
            return start + x;
    }
}

/* A point in the unit disc, uniform; returns its distance from the middle, squared, above 0. That is
 * uniform, too, and independent of the angle. 32 bits a coordinate are enough for a direction. */
static inline double draw_disc(struct accuracy_stream *stream, double *x, double *y)
{
    double r2;
    do {
        const uint64_t bits = accuracy_bits(stream);
        *x = ((double)(int32_t)(uint32_t)bits + 0.5) * 0x1p-31;
        *y = ((double)(int32_t)(uint32_t)(bits >> 32) + 0.5) * 0x1p-31;
        r2 = *x * *x + *y * *y;
    } while (r2 >= 1);
    return r2;
}

/* ---- events --------------------------------------------------------------------------------------- */

/* Henyey and Greenstein's deflection, written so that nothing cancels at small g. T77 */
static inline void scatter(double g, struct accuracy_stream *stream, struct photon *photon)
{
    double a, b;
    const double r2 = draw_disc(stream, &a, &b);
    const double c = 1 - 2 * r2;
    if (g == 0) { /* all directions alike: no axis is needed */
        const double across = 2 * sqrt(1 - r2);
        photon->ux = a * across;
        photon->uy = b * across;
        photon->uz = c;
        return;
    }
    const double inverse = 1 / (1 + g * c), t = (1 - g * g) * inverse;
    const double cosine = 0.5 * (g + (g + c) * (1 + t) * inverse), sine2 = (1 - cosine) * (1 + cosine);
    const double sine = sine2 > 0 ? sqrt(sine2 / r2) : 0; /* of a point in the disc */
    /* Two axes across the old direction, by Duff et al. 2017. */
    const double ux = photon->ux, uy = photon->uy, uz = photon->uz, sign = copysign(1, uz);
    const double p = -1 / (sign + uz), q = ux * uy * p;
    a *= sine;
    b *= sine;
    const double x = cosine * ux + a * (1 + sign * ux * ux * p) + b * q;
    const double y = cosine * uy + a * sign * q + b * (sign + uy * uy * p);
    const double z = cosine * uz - a * sign * ux - b * uy;
    /* A length that is off by rounding would be off by ever more: a Newton step to 1. */
    const double scale = 1.5 - 0.5 * (x * x + y * y + z * z);
    photon->ux = scale * x;
    photon->uy = scale * y;
    photon->uz = scale * z;
}

/* Add what is absorbed in the layer that a photon leaves. */
static void flush_absorbed(struct photon *photon, struct mc_tally *tally)
{
    tally->powers->absorbed[photon->layer] += photon->absorbed;
    photon->absorbed = 0;
}

static void leave(const struct mc_walk *walk, const struct photon *photon, bool is_top,
                  struct mc_tally *tally)
{
    *(is_top ? &tally->powers->reflected : &tally->powers->transmitted) += photon->weight;
    const double r2_mm2 = photon->x_mm * photon->x_mm + photon->y_mm * photon->y_mm;
    const size_t count = walk->ring_count;
    if (count == 0 || !(r2_mm2 >= walk->edges2_mm2[0] && r2_mm2 < walk->edges2_mm2[count]))
        return;
    size_t lo = 0, hi = count;
    while (hi - lo > 1) {
        const size_t middle = (lo + hi) / 2;
        if (r2_mm2 >= walk->edges2_mm2[middle])
            lo = middle;
        else
            hi = middle;
    }
    tally->rings[lo + (is_top ? 0 : count)] += photon->weight;
}

/* At the layer's top or bottom: mirrored, or refracted into the next layer; false if the photon left. */
static bool cross(const struct mc_walk *walk, struct accuracy_stream *stream, struct photon *photon,
                  struct mc_tally *tally)
{
    const bool is_upward = photon->uz < 0;
    const int next = photon->layer + (is_upward ? -1 : 1);
    const bool is_last = next == walk->layer_count;
    const double eta_next = next < 0 ? 1 : is_last ? walk->eta_below : walk->layers[next].eta;
    const double ratio = eta_next / walk->layers[photon->layer].eta, cosine = fmin(fabs(photon->uz), 1);
    if (ratio != 1 && accuracy_uniform(stream) <= dipole_fresnel_reflectance(ratio, cosine)) {
        photon->uz = -photon->uz;
        return true;
    }
    flush_absorbed(photon, tally);
    if (next < 0 || is_last) {
        leave(walk, photon, is_upward, tally);
        return false;
    }
    photon->layer = next;
    photon->z_mm = is_upward ? walk->layers[next].thickness_mm : 0;
    if (ratio != 1) {
        const double across2 = (photon->ux * photon->ux + photon->uy * photon->uy) / (ratio * ratio);
        photon->ux /= ratio;
        photon->uy /= ratio;
        photon->uz = copysign(sqrt(fmax(1 - across2, 0)), photon->uz);
    }
    return true;
}

/* To the face that lies ahead, at to_face_mm. */
static void move_to_face(const struct mc_layer *layer, double to_face_mm, struct photon *photon)
{
    photon->x_mm += to_face_mm * photon->ux;
    photon->y_mm += to_face_mm * photon->uy;
    photon->z_mm = photon->uz < 0 ? 0 : layer->thickness_mm;
}

static double find_face_mm(const struct mc_layer *layer, const struct photon *photon)
{
    if (photon->uz == 0)
        return INFINITY;
    return (photon->uz < 0 ? photon->z_mm : layer->thickness_mm - photon->z_mm) / fabs(photon->uz);
}

/* Through a layer that does not scatter, whose absorption has no chance in it; false: nothing is left. */
static bool pass_clear(const struct mc_layer *layer, struct photon *photon, struct mc_tally *tally)
{
    const double to_face_mm = find_face_mm(layer, photon);
    const double kept = layer->sigma_a_per_mm > 0 ? exp(-layer->sigma_a_per_mm * to_face_mm) : 1;
    photon->absorbed += photon->weight * (1 - kept);
    photon->weight *= kept;
    if (to_face_mm < INFINITY && photon->weight > 0) {
        move_to_face(layer, to_face_mm, photon);
        return true;
    }
    tally->powers->lost += photon->weight;
    flush_absorbed(photon, tally);
    return false;
}

/* Russian roulette; false: the photon lost. */
static bool survive(struct accuracy_stream *stream, struct photon *photon, struct mc_tally *tally)
{
    const double before = photon->weight;
    const bool survives = before > 0 && accuracy_uniform(stream) <= ROULETTE;
    photon->weight = survives ? before / ROULETTE : 0;
    tally->powers->roulette += before - photon->weight;
    if (!survives)
        flush_absorbed(photon, tally);
    return survives;
}

/* Light that both faces of a layer reflect wholly can meet them many times on its way of free_mm. */
static void move_folded(const struct mc_layer *layer, double free_mm, struct photon *photon)
{
    const double d = layer->thickness_mm;
    double unfolded = fmod(photon->z_mm + photon->uz * free_mm, 2 * d);
    if (unfolded < 0)
        unfolded += 2 * d;
    photon->z_mm = unfolded > d ? 2 * d - unfolded : unfolded;
    photon->uz = unfolded > d ? -photon->uz : photon->uz;
    photon->x_mm += free_mm * photon->ux;
    photon->y_mm += free_mm * photon->uy;
}

/* ---- a walk --------------------------------------------------------------------------------------- */

/* Where u of all that scatters a first time has scattered. */
static void start(const struct mc_walk *walk, double u, struct photon *photon)
{
    int i = 0;
    while (i + 1 < walk->source_count && u >= walk->sources[i].end)
        i++;
    const struct mc_source *const source = &walk->sources[i];
    const struct mc_layer *const layer = &walk->layers[source->layer];
    const double begin = i > 0 ? walk->sources[i - 1].end : 0;
    const double part = fmin(fmax((u - begin) / (source->end - begin), 0), 1 - 0x1p-53);
    const double depth = layer->thickness_mm / layer->mean_free_path_mm;
    const double free_mm =
        fmin(-log1p(part * expm1(-depth)) * layer->mean_free_path_mm, layer->thickness_mm);
    *photon = (struct photon){ .z_mm = source->is_upward ? layer->thickness_mm - free_mm : free_mm,
                               .uz = source->is_upward ? -1 : 1,
                               .weight = 1,
                               .layer = source->layer };
}

/* Absorbed in part, and scattered; false: roulette ended the photon. */
static inline bool interact(const struct mc_walk *walk, const struct mc_layer *layer,
                            struct accuracy_stream *stream, struct photon *photon, struct mc_tally *tally)
{
    photon->absorbed += photon->weight * layer->absorption;
    photon->weight *= layer->albedo;
    if (photon->weight < ROULETTE && !survive(stream, photon, tally))
        return false;
    scatter(layer->g, stream, photon);
    photon->left = draw_exponential(walk, stream);
    tally->scatterings++;
    return true;
}

/* One step, to where the photon scatters or to a face; false: it is no more. */
static inline bool step(const struct mc_walk *walk, struct accuracy_stream *stream, struct photon *photon,
                        struct mc_tally *tally)
{
    const struct mc_layer *const layer = &walk->layers[photon->layer];
    if (layer->is_clear)
        return pass_clear(layer, photon, tally) && cross(walk, stream, photon, tally);
    const double free_mm = photon->left * layer->mean_free_path_mm;
    const double z_mm = photon->z_mm + photon->uz * free_mm;
    if (z_mm >= 0 && z_mm <= layer->thickness_mm) {
        photon->x_mm += free_mm * photon->ux;
        photon->y_mm += free_mm * photon->uy;
        photon->z_mm = z_mm;
        return interact(walk, layer, stream, photon, tally);
    }
    if (photon->uz * photon->uz < layer->trapped_cosine2) {
        move_folded(layer, free_mm, photon);
        return interact(walk, layer, stream, photon, tally);
    }
    const double to_face_mm = find_face_mm(layer, photon);
    photon->left = fmax(photon->left - to_face_mm / layer->mean_free_path_mm, 0);
    move_to_face(layer, to_face_mm, photon);
    return cross(walk, stream, photon, tally);
}

static void follow(const struct mc_walk *walk, double u, struct accuracy_stream *stream,
                   struct mc_tally *tally)
{
    struct photon photon;
    start(walk, u, &photon);
    scatter(walk->layers[photon.layer].g, stream, &photon);
    photon.left = draw_exponential(walk, stream);
    tally->scatterings++;
    for (int event = 0; event < EVENT_LIMIT; event++)
        if (!step(walk, stream, &photon, tally))
            return;
    tally->powers->lost += photon.weight;
    flush_absorbed(&photon, tally);
}

void mc_walk_batch(const struct mc_walk *walk, size_t photon_count, struct accuracy_stream *stream,
                   struct mc_tally *tally)
{
    for (size_t i = 0; i < photon_count; i++)
        follow(walk, ((double)i + accuracy_uniform(stream)) / (double)photon_count, stream, tally);
}
