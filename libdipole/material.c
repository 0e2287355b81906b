/* Media from what artists and measurements state: reflectance and a length. docs/theory.md T28. */
#include "internal.h"

/*
 * Both models' totals depend on alpha' and x = sigma_tr l = sqrt(3 (1 - alpha')) alone, and fall with x:
 *   dipole  alpha'/2 (e^(-x) + e^(-cx)), c = 1 + 4A/3        beam  alpha'/((1 + x)(1 + bx)), b = 2A/3
 */
struct albedo_problem {
    dipole_model model;
    double boundary_a, target;
};

/* total/alpha' at x, and minus its slope. */
static double reflected(const struct albedo_problem *problem, double x, double *fall)
{
    if (problem->model == DIPOLE_MODEL_BEAM) {
        const double b = 2.0 / 3.0 * problem->boundary_a, value = 1.0 / ((1.0 + x) * (1.0 + b * x));
        *fall = value * (1.0 / (1.0 + x) + b / (1.0 + b * x));
        return value;
    }
    const double c = 1.0 + 4.0 / 3.0 * problem->boundary_a, near = exp(-x), far = exp(-c * x);
    *fall = 0.5 * (near + c * far);
    return 0.5 * (near + far);
}

/* 1 - total/alpha' at x, as a sum of positive terms. */
static double lost(const struct albedo_problem *problem, double x)
{
    if (problem->model == DIPOLE_MODEL_BEAM) {
        const double b = 2.0 / 3.0 * problem->boundary_a;
        return x * (1.0 + b + b * x) / ((1.0 + x) * (1.0 + b * x));
    }
    const double c = 1.0 + 4.0 / 3.0 * problem->boundary_a;
    return -0.5 * (expm1(-x) + expm1(-c * x));
}

/* log of (1 - R) over 1 - total, which falls with x: for bright media, where x is small. */
static void bright(const void *context, double x, double *value, double *d_log_x)
{
    const struct albedo_problem *const problem = context;
    double fall;
    const double part = reflected(problem, x, &fall), absorbed = x * x / 3.0;
    const double deficit = lost(problem, x) + absorbed * part;
    *value = log((1.0 - problem->target) / deficit);
    *d_log_x = -x * ((1.0 - absorbed) * fall + 2.0 / 3.0 * x * part) / deficit;
}

/* log of R over the total, which falls with alpha': for dark media, where alpha' is small. */
static void dark(const void *context, double alpha_prime, double *value, double *d_log_alpha_prime)
{
    const struct albedo_problem *const problem = context;
    double fall;
    const double x = sqrt(3.0 * (1.0 - alpha_prime)), part = reflected(problem, x, &fall);
    *value = log(problem->target / (alpha_prime * part));
    *d_log_alpha_prime = -1.0 - alpha_prime * 1.5 / x * fall / part;
}

/* Parts scattered and absorbed for a total, and x. */
struct albedo {
    double scattered, absorbed, x;
};

static struct albedo albedo_find(const struct albedo_problem *problem)
{
    const double target = problem->target;
    if (target == 0.0)
        return (struct albedo){ 0.0, 1.0, sqrt(3.0) };
    if (target == 1.0)
        return (struct albedo){ 1.0, 0.0, 0.0 };
    if (target <= 0.5) { /* total <= alpha', and close to 1 it is above 1/2 for every A */
        const double alpha_prime = dipole_find_root(dark, problem, target, 1.0 - 1e-9);
        return (struct albedo){ alpha_prime, 1.0 - alpha_prime, sqrt(3.0 * (1.0 - alpha_prime)) };
    }
    /* the deficit is at most (2 + c) x, and all is lost at x = sqrt(3) */
    const double lo = (1.0 - target) / (4.0 + 2.0 * problem->boundary_a);
    const double x = dipole_find_root(bright, problem, lo, sqrt(3.0));
    return (struct albedo){ 1.0 - x * x / 3.0, x * x / 3.0, x };
}

static bool problem_init(double diffuse_reflectance, double eta, dipole_fdr_kind fdr_kind,
                         dipole_model model, struct albedo_problem *out, dipole_status *status)
{
    if (!(diffuse_reflectance >= 0.0 && diffuse_reflectance <= 1.0))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "diffuse_reflectance is %g, expected 0 to 1",
                           diffuse_reflectance);
    if (model != DIPOLE_MODEL_DIPOLE && model != DIPOLE_MODEL_BEAM)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "this model has no inverse, expected \"dipole\" or \"beam\"");
    const dipole_medium any = { 1.0, 1.0, eta, fdr_kind };
    dipole_coefficients coefficients;
    if (!dipole_coefficients_init(&any, &coefficients, status))
        return false;
    *out = (struct albedo_problem){ model, coefficients.boundary_a, diffuse_reflectance };
    return true;
}

static bool length_check(double length_mm, const char *name, dipole_status *status)
{
    return (length_mm >= 1.0 / DIPOLE_SIGMA_MAX_PER_MM && length_mm <= 1.0 / DIPOLE_SIGMA_MIN_PER_MM) ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%s is %g, expected > 0 (%g to %g)", name, length_mm,
                       1.0 / DIPOLE_SIGMA_MAX_PER_MM, 1.0 / DIPOLE_SIGMA_MIN_PER_MM);
}

static bool medium_finish(struct albedo albedo, double sigma_t_prime_per_mm, double eta,
                          dipole_fdr_kind fdr_kind, dipole_medium *out, dipole_status *status)
{
    const dipole_medium medium = { .sigma_a_per_mm = albedo.absorbed * sigma_t_prime_per_mm,
                                   .sigma_s_prime_per_mm = albedo.scattered * sigma_t_prime_per_mm,
                                   .eta = eta,
                                   .fdr_kind = fdr_kind };
    dipole_coefficients coefficients;
    if (!dipole_coefficients_init(&medium, &coefficients, status))
        return false;
    *out = medium;
    return true;
}

bool dipole_medium_from_mean_free_path(double diffuse_reflectance, double mean_free_path_mm, double eta,
                                       dipole_fdr_kind fdr_kind, dipole_model model, dipole_medium *out,
                                       dipole_status *status)
{
    struct albedo_problem problem;
    return length_check(mean_free_path_mm, "mean_free_path_mm", status) &&
           problem_init(diffuse_reflectance, eta, fdr_kind, model, &problem, status) &&
           medium_finish(albedo_find(&problem), 1.0 / mean_free_path_mm, eta, fdr_kind, out, status);
}

bool dipole_medium_from_diffuse_mean_free_path(double diffuse_reflectance, double diffuse_mean_free_path_mm,
                                               double eta, dipole_fdr_kind fdr_kind, dipole_model model,
                                               dipole_medium *out, dipole_status *status)
{
    struct albedo_problem problem;
    if (!length_check(diffuse_mean_free_path_mm, "diffuse_mean_free_path_mm", status) ||
        !problem_init(diffuse_reflectance, eta, fdr_kind, model, &problem, status))
        return false;
    if (diffuse_reflectance == 1.0)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, NULL,
            "diffuse_reflectance is 1, where light travels without end, expected less beside "
            "diffuse_mean_free_path_mm");
    const struct albedo albedo = albedo_find(&problem);
    return medium_finish(albedo, 1.0 / (albedo.x * diffuse_mean_free_path_mm), eta, fdr_kind, out, status);
}
