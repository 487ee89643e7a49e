#include "data.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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
            if ((result.status == Status::unbounded || result.status == Status::internal_error) &&
                data_.is_convex())
                approach(result);
        } catch (...) {
            result.status = Status::internal_error;
        }
        if (result.status != Status::solved && result.status != Status::iteration_limit) {
            clear();
        }
        if (result.status == Status::solved) {
            x = x_;
            result.objective = data_.objective(x_);
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
        knows_ = Known::solution;
        if (!x_.allFinite())
            result.status = Status::internal_error;
        else if (is_at_far_bound() || !is_stationary())
            result.status = Status::unbounded;
    }

    /// Is x held where no bound is? It looks for a minimum within bounds so far away that they pass for none,
    /// and one of a singular H may lie on them, where nothing is left of its digits.
    bool is_at_far_bound() {
        const auto holds = [&](qpoases::SubjectToStatus status, int i) {
            return (status == qpoases::ST_LOWER && data_.lower[i] <= -qpoases::INFTY) ||
                   (status == qpoases::ST_UPPER && data_.upper[i] >= qpoases::INFTY);
        };
        for (int i = 0; i < data_.n; ++i)
            if (holds(bounds_.getStatus(i), i)) return true;
        for (int i = 0; i < data_.m; ++i)
            if (holds(constraints_.getStatus(i), data_.n + i)) return true;
        return false;
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
        const double rounding = 1e-9 * data_.H.cwiseAbs().maxCoeff() * x_.cwiseAbs().maxCoeff();
        return gradient_.cwiseAbs().maxCoeff() <= 1e-6 * (1 + data_.g.cwiseAbs().maxCoeff()) + rounding;
    }

    /// Proximal point iterations x ← argmin objective + ½ shift |. − x|², each of a definite H. The gradient
    /// of the Lagrangian at the next x is shift times the step, which vanishes if there is a minimum and
    /// tends to the slope that goes on for ever if there is none.
    void approach(Result& result) {
        const Data::RowMajor H = data_.H;
        const Eigen::VectorXd g = data_.g;
        const double steepest = g.cwiseAbs().maxCoeff(), allowed = 1e-7 * (1.0 + steepest);
        const double curvature = H.cwiseAbs().maxCoeff();
        const double shift = 1e-7 * (curvature > 0.0 ? curvature : 1.0 + steepest);
        Eigen::VectorXd center = Eigen::VectorXd::Zero(data_.n);
        data_.H.diagonal().array() += shift;
        clear();
        double slope = std::numeric_limits<double>::infinity();
        for (bool is_falling = true; is_falling && slope > allowed;) {
            data_.g = g - shift * center;
            run(result);
            if (result.status != Status::solved) break;
            const double next = shift * (x_ - center).cwiseAbs().maxCoeff();
            is_falling = next < 0.9 * slope;
            slope = next;
            center = x_;
        }
        data_.H = H;
        data_.g = g;
        knows_ = Known::nothing; // a start from there would run to the limit of iterations
        if (result.status == Status::solved && slope > allowed) result.status = Status::unbounded;
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
