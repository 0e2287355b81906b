// Ceres and Eigen behind a C header: no exception, no print and no type of theirs leaves this file.
#include "fit/solve.h"

#include <ceres/ceres.h>
#include <ceres/gradient_checker.h>
#include <Eigen/Dense>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <vector>

namespace
{

class cost_function : public ceres::CostFunction
{
  public:
    explicit cost_function(const fit_least_squares &problem) : problem_(problem)
    {
        set_num_residuals(static_cast<int>(problem.residual_count));
        mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.parameter_count));
    }

    bool Evaluate(const double *const *parameters, double *residuals, double **jacobians) const override
    {
        double *const jacobian = jacobians ? jacobians[0] : nullptr;
        return problem_.residuals(problem_.context, parameters[0], residuals, jacobian);
    }

  private:
    const fit_least_squares &problem_;
};

// Ceres warns through glog of what we report ourselves, in the result.
void silence()
{
    FLAGS_minloglevel = google::GLOG_FATAL;
}

using row_matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void solve(const fit_least_squares &least_squares, const double *start, fit_minimum *out)
{
    const std::size_t parameter_count = least_squares.parameter_count;
    std::copy(start, start + parameter_count, out->parameters);
    cost_function cost(least_squares);

    ceres::Problem::Options problem_options;
    problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(problem_options);
    problem.AddResidualBlock(&cost, nullptr, out->parameters);
    for (std::size_t i = 0; i < parameter_count; i++) {
        problem.SetParameterLowerBound(out->parameters, static_cast<int>(i), least_squares.lower[i]);
        problem.SetParameterUpperBound(out->parameters, static_cast<int>(i), least_squares.upper[i]);
    }

    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-12;
    options.gradient_tolerance = 1e-15;
    options.parameter_tolerance = 1e-10;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);

    out->sum_of_squares = 2.0 * summary.final_cost;
    out->iteration_count = static_cast<int>(summary.iterations.size());
    out->has_converged = summary.termination_type == ceres::CONVERGENCE;
}

double jacobian_error(const fit_least_squares &least_squares, const double *point)
{
    cost_function cost(least_squares);
    const std::vector<const ceres::Manifold *> no_manifolds(1, nullptr);
    ceres::GradientChecker checker(&cost, &no_manifolds, ceres::NumericDiffOptions());
    ceres::GradientChecker::ProbeResults results;
    // the tolerance decides only what the checker would say in words
    checker.Probe(&point, 1.0, &results);
    if (!results.return_value || results.jacobians.empty())
        return std::numeric_limits<double>::infinity();
    const auto &analytic = results.jacobians[0];
    const auto &numeric = results.numeric_jacobians[0];
    // relative to the column: numeric differences cannot resolve entries far below its largest
    double largest = 0.0;
    for (Eigen::Index i = 0; i < analytic.cols(); i++) {
        const double scale =
            std::max(analytic.col(i).lpNorm<Eigen::Infinity>(), numeric.col(i).lpNorm<Eigen::Infinity>());
        const double difference = (analytic.col(i) - numeric.col(i)).lpNorm<Eigen::Infinity>();
        if (difference > 0.0)
            largest = std::max(largest, difference / scale);
    }
    return largest;
}

} // namespace

bool fit_least_squares_solve(const fit_least_squares *problem, const double *start, fit_minimum *out,
                             dipole_status *status)
{
    try {
        silence();
        std::vector<double> residuals(problem->residual_count);
        if (!problem->residuals(problem->context, start, residuals.data(), nullptr))
            return dipole_fail(status, DIPOLE_NOT_CONVERGED, nullptr,
                               "the model has no value at the start");
        solve(*problem, start, out);
        return true;
    } catch (const std::bad_alloc &) {
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, nullptr, "no memory for the solver");
    } catch (const std::exception &error) {
        return dipole_fail(status, DIPOLE_NOT_CONVERGED, nullptr, "the solver failed: %s", error.what());
    }
}

double fit_least_squares_jacobian_error(const fit_least_squares *problem, const double *parameters)
{
    try {
        silence();
        return jacobian_error(*problem, parameters);
    } catch (const std::exception &) {
        return std::numeric_limits<double>::infinity();
    }
}

bool fit_triangle_fold(double *triangle, size_t column_count, const double *rows, size_t row_count,
                       dipole_status *status)
{
    try {
        const auto columns = static_cast<Eigen::Index>(column_count);
        const auto added = static_cast<Eigen::Index>(row_count);
        Eigen::Map<row_matrix> folded(triangle, columns, columns);
        Eigen::MatrixXd stacked(columns + added, columns);
        stacked.topRows(columns) = folded;
        stacked.bottomRows(added) = Eigen::Map<const row_matrix>(rows, added, columns);
        const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(stacked);
        folded = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
        return true;
    } catch (const std::bad_alloc &) {
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, nullptr,
                           "no memory to fold %zu rows of %zu columns", row_count, column_count);
    }
}
