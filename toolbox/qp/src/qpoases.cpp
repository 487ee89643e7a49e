#include "data.hpp"

#include <algorithm>
#include <cmath>
#include <qpOASES.hpp>

namespace bf::qp {
namespace {

namespace qpoases = ::qpOASES;

/// H, A and bounds of each problem are new, so that every solve is an `init` with what is known of the
/// solution. It then depends on nothing else of the solves before.
class QpOases final : public Solver {
  public:
    QpOases(int variables, int constraints, const Options& options)
        : data_(variables, constraints, options), bounds_(variables), constraints_(constraints),
          x_(variables), y_(variables + constraints), max_iterations_(options.max_iterations) {
        settings_.printLevel = qpoases::PL_NONE;
        clear();
    }

    Result solve(const Problem& problem, Eigen::Ref<Eigen::VectorXd> x) noexcept override {
        Result result = data_.load(problem, x.size());
        if (result.status != Status::solved) {
            return result;
        }
        // It takes 1e20 as infinite.
        data_.lower = data_.lower.cwiseMax(-qpoases::INFTY);
        data_.upper = data_.upper.cwiseMin(qpoases::INFTY).cwiseMax(data_.lower);
        try {
            const bool knew = knows_ != Known::nothing;
            run(result);
            if (knew && result.status != Status::solved && result.status != Status::iteration_limit) {
                clear();
                run(result);
            }
        } catch (...) {
            result.status = Status::internal_error;
        }
        if (result.status != Status::solved && result.status != Status::iteration_limit) {
            clear();
        }
        if (result.status == Status::solved) {
            x = x_;
        }
        return result;
    }

    void reset() noexcept override { clear(); }

    int state_size() const noexcept override { return 1 + 3 * data_.n + 2 * data_.m; }
    void save(double* state) const noexcept override {
        *state++ = static_cast<double>(knows_);
        state = std::copy_n(x_.data(), x_.size(), state);
        state = std::copy_n(y_.data(), y_.size(), state);
        for (int i = 0; i < data_.n; ++i) *state++ = bounds_.getStatus(i);
        for (int i = 0; i < data_.m; ++i) *state++ = constraints_.getStatus(i);
    }
    void restore(const double* state) noexcept override {
        knows_ = static_cast<Known>(static_cast<int>(*state++));
        std::copy_n(state, x_.size(), x_.data());
        state += x_.size();
        std::copy_n(state, y_.size(), y_.data());
        state += y_.size();
        set(state, state + data_.n);
    }

  private:
    /// What a solve may begin with.
    enum class Known { nothing, working_set, solution };

    void clear() noexcept {
        knows_ = Known::nothing;
        x_.setZero();
        y_.setZero();
        set(nullptr, nullptr);
    }

    /// The working set from numbers; inactive without.
    void set(const double* of_bounds, const double* of_constraints) noexcept {
        const auto status = [](const double* from, int i) {
            return static_cast<qpoases::SubjectToStatus>(from ? static_cast<int>(from[i]) : 0);
        };
        bounds_.init(data_.n);
        for (int i = 0; i < data_.n; ++i) bounds_.setupBound(i, status(of_bounds, i));
        constraints_.init(data_.m);
        for (int i = 0; i < data_.m; ++i) constraints_.setupConstraint(i, status(of_constraints, i));
    }

    void run(Result& result) {
        const int n = data_.n, m = data_.m;
        qpoases::int_t iterations = max_iterations_ - result.iterations;
        const bool begins = knows_ != Known::nothing, has_point = knows_ == Known::solution;
        qpoases::QProblem problem(n, m);
        problem.setOptions(settings_);
        const auto outcome = problem.init(data_.H.data(), data_.g.data(), m > 0 ? data_.A.data() : nullptr,
                                          data_.bounded ? data_.lower.data() : nullptr,
                                          data_.bounded ? data_.upper.data() : nullptr,
                                          data_.lower.data() + n, data_.upper.data() + n, iterations, nullptr,
                                          has_point ? x_.data() : nullptr, has_point ? y_.data() : nullptr,
                                          begins ? &bounds_ : nullptr, begins ? &constraints_ : nullptr);
        result.iterations += static_cast<int>(iterations);
        result.status = static_cast<Status>(static_cast<int>(qpoases::getSimpleStatus(outcome)));
        if (result.status == Status::solved || result.status == Status::iteration_limit) {
            problem.getBounds(bounds_);
            problem.getConstraints(constraints_);
            knows_ = Known::working_set;
        }
        if (result.status != Status::solved) return;
        problem.getPrimalSolution(x_.data());
        problem.getDualSolution(y_.data());
        result.objective = problem.getObjVal();
        knows_ = Known::solution;
        if (!x_.allFinite())
            result.status = Status::internal_error;
        else if (!is_stationary())
            result.status = Status::unbounded;
    }

    /// Hx + g = Aᵀy + the multipliers of the bounds that there are. It regularises an H that is zero and puts
    /// far bounds where there are none, and then has a solution of a problem whose x goes on for ever.
    bool is_stationary() {
        const int n = data_.n, m = data_.m;
        gradient_ = data_.g;
        gradient_.noalias() += data_.H * x_;
        if (m > 0) gradient_.noalias() -= data_.A.transpose() * y_.tail(m);
        for (int i = 0; i < n && data_.bounded; ++i) {
            const double bound = y_[i] > 0 ? data_.lower[i] : data_.upper[i];
            if (std::abs(bound) < qpoases::INFTY) gradient_[i] -= y_[i];
        }
        const double scale =
            data_.g.cwiseAbs().maxCoeff() + data_.H.cwiseAbs().maxCoeff() * x_.cwiseAbs().maxCoeff();
        return gradient_.cwiseAbs().maxCoeff() <= 1e-6 * (1 + scale);
    }

    Data data_;
    qpoases::Options settings_;
    qpoases::Bounds bounds_;
    qpoases::Constraints constraints_;
    Eigen::VectorXd x_, y_, gradient_;
    int max_iterations_;
    Known knows_ = Known::nothing;
};

} // namespace

std::unique_ptr<Solver> make_qpoases(int variables, int constraints, const Options& options) {
    return std::make_unique<QpOases>(variables, constraints, options);
}

} // namespace bf::qp
