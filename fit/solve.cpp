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

// Notes the course of a search, and ends it when asked to.
class observer : public ceres::IterationCallback
{
  public:
    observer(const fit_least_squares &problem, fit_minimum *out) : problem_(problem), out_(out)
    {
    }

    ceres::CallbackReturnType operator()(const ceres::IterationSummary &summary) override
    {
        if (out_->history_count < FIT_HISTORY_LIMIT)
            out_->history[out_->history_count++] = 2.0 * summary.cost;
        return problem_.stop && *problem_.stop ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
    }

  private:
    const fit_least_squares &problem_;
    fit_minimum *out_;
};

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

    std::vector<int> held;
    for (std::size_t i = 0; i < parameter_count; i++) {
        if (least_squares.is_held[i])
            held.push_back(static_cast<int>(i));
    }
    if (held.size() == parameter_count)
        problem.SetParameterBlockConstant(out->parameters);
    else if (!held.empty())
        problem.SetManifold(out->parameters,
                            new ceres::SubsetManifold(static_cast<int>(parameter_count), held));

    out->history_count = 0;
    observer watching(least_squares, out);
    ceres::Solver::Options options;
    options.callbacks.push_back(&watching);
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    options.max_num_iterations = least_squares.iteration_limit > 0 ? least_squares.iteration_limit : 100;
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

bool fit_inverse_information(const double *triangle, size_t count, double rank_tolerance, double *inverse,
                             double *singular, dipole_status *status)
{
    try {
        const auto n = static_cast<Eigen::Index>(count);
        Eigen::MatrixXd scaled = Eigen::Map<const row_matrix>(triangle, n, n);
        Eigen::VectorXd length(n);
        for (Eigen::Index i = 0; i < n; i++) {
            length[i] = scaled.col(i).stableNorm();
            if (length[i] > 0.0)
                scaled.col(i) /= length[i];
        }
        const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
        const Eigen::VectorXd &values = svd.singularValues();
        const double least = std::max(rank_tolerance * values[0], std::numeric_limits<double>::min());
        const Eigen::VectorXd raised = values.cwiseMax(least);
        const Eigen::MatrixXd turned = svd.matrixV() * raised.cwiseInverse().asDiagonal();
        Eigen::Map<row_matrix> out(inverse, n, n);
        out = turned * turned.transpose();
        for (Eigen::Index i = 0; i < n; i++) {
            for (Eigen::Index k = 0; k < n; k++) {
                if (length[i] > 0.0 && length[k] > 0.0)
                    out(i, k) /= length[i] * length[k];
                else
                    out(i, k) = i == k ? std::numeric_limits<double>::infinity() : 0.0;
            }
        }
        std::copy(values.data(), values.data() + n, singular);
        return true;
    } catch (const std::bad_alloc &) {
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, nullptr, "no memory for %zu parameters", count);
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
