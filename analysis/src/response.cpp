#include "bf/analysis/response.hpp"

#include "bf/run/run.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>
#include <utility>

namespace bf::analysis {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degrees = 180 / pi;

void sort(std::vector<Complex>& numbers) {
    std::sort(numbers.begin(), numbers.end(), [](const Complex& a, const Complex& b) {
        return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
    });
}

/// D⁻¹ A D with rows and columns of like size, D of powers of 2: what is fast beside what is slow does not
/// hide it in rounding. Source: Parlett and Reinsch, Numerische Mathematik 13 (1969).
Matrix balanced(Matrix A) {
    bool goes_on = true;
    for (int round = 0; goes_on && round < 100; ++round) {
        goes_on = false;
        for (Eigen::Index i = 0; i < A.rows(); ++i) {
            const double own = std::abs(A(i, i)), column = A.col(i).cwiseAbs().sum() - own,
                         row = A.row(i).cwiseAbs().sum() - own;
            if (!(column > 0) || !(row > 0)) continue;
            const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
            if (!(column * factor + row / factor < 0.95 * (column + row))) continue;
            A.col(i) *= factor;
            A.row(i) /= factor;
            goes_on = true;
        }
    }
    return A;
}

std::vector<Complex> eigenvalues(const Matrix& A) {
    if (A.rows() == 0) return {};
    const Eigen::VectorXcd values = balanced(A).eigenvalues();
    return {values.data(), values.data() + values.size()};
}

/// Is there a pole at 0, to rounding?
bool integrates(const LinearSystem& system) {
    if (system.A.rows() == 0) return false;
    const Matrix at_0 = balanced(
        system.period > 0 ? Matrix(system.A - Matrix::Identity(system.A.rows(), system.A.cols())) : system.A);
    const auto pivots = at_0.fullPivLu().matrixLU().diagonal().cwiseAbs().eval();
    return !(pivots.minCoeff() > 1e-13 * pivots.maxCoeff());
}

/// Where f changes its sign between a and b.
template <class F> double crossing(F&& f, double a, double b) {
    const bool is_positive = f(a) > 0;
    for (int i = 0; i < 60; ++i) {
        const double middle = std::sqrt(a * b);
        ((f(middle) > 0) == is_positive ? a : b) = middle;
    }
    return std::sqrt(a * b);
}

/// Evenly on a logarithmic axis.
std::vector<double> logarithmic(double low, double high, int count) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i)
        all.push_back(low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
    return all;
}

double decibels(const Complex& value) { return 20 * std::log10(std::abs(value)); }

/// The same system with one input and one output.
LinearSystem single(const LinearSystem& system, int output, int input) {
    LinearSystem one;
    one.A = system.A;
    one.B = system.B.col(input);
    one.C = system.C.row(output);
    one.D = system.D.block(output, input, 1, 1);
    one.period = system.period;
    one.states = system.states;
    one.inputs = {system.inputs.empty() ? "" : system.inputs[static_cast<std::size_t>(input)]};
    one.outputs = {system.outputs.empty() ? "" : system.outputs[static_cast<std::size_t>(output)]};
    return one;
}

} // namespace

std::vector<Complex> poles(const LinearSystem& system) {
    auto all = eigenvalues(system.A);
    sort(all);
    return all;
}

std::vector<Complex> zeros(const LinearSystem& system, int output, int input) {
    const auto n = system.A.rows();
    Matrix a = Matrix::Zero(n + 1, n + 1), b = Matrix::Zero(n + 1, n + 1);
    a.topLeftCorner(n, n) = system.A;
    a.topRightCorner(n, 1) = system.B.col(input);
    a.bottomLeftCorner(1, n) = system.C.row(output);
    a(n, n) = system.D(output, input);
    b.topLeftCorner(n, n).setIdentity();
    const Eigen::GeneralizedEigenSolver<Matrix> solver(a, b, false);
    std::vector<Complex> all;
    const double scale = 1 + system.A.norm();
    for (Eigen::Index i = 0; i <= n; ++i) {
        const Complex value = solver.alphas()[i] / solver.betas()[i];
        // What is infinite but for rounding is none: a zero of order m is known to a relative error ε^(1/m).
        if (std::isfinite(value.real()) && std::isfinite(value.imag()) && std::abs(value) < 1e5 * scale)
            all.push_back(value);
    }
    sort(all);
    return all;
}

bool is_stable(const LinearSystem& system) {
    const auto all = poles(system);
    return std::all_of(all.begin(), all.end(),
                       [&](const Complex& p) { return system.period > 0 ? std::abs(p) < 1 : p.real() < 0; });
}

Complex frequency_response(const LinearSystem& system, int output, int input, double omega) {
    const Complex s = system.period > 0 ? std::polar(1.0, omega * system.period) : Complex(0, omega);
    const auto n = system.A.rows();
    if (n == 0) return system.D(output, input);
    Eigen::MatrixXcd pencil = -system.A.cast<Complex>();
    pencil.diagonal().array() += s;
    const Eigen::VectorXcd x = pencil.partialPivLu().solve(system.B.col(input).cast<Complex>());
    return (system.C.row(output).cast<Complex>() * x)(0) + system.D(output, input);
}

namespace {

/// From a decade below the roots to one above.
std::pair<double, double> range(const LinearSystem& system, int output, int input) {
    double low = std::numeric_limits<double>::infinity(), high = 0;
    const auto see = [&](const Complex& root) {
        const Complex s = system.period > 0 ? std::log(root) / system.period : root;
        const double size = std::abs(s);
        if (!std::isfinite(size) || size < 1e-8) return;
        low = std::min(low, size);
        high = std::max(high, size);
    };
    for (const auto& p : poles(system)) see(p);
    for (const auto& z : zeros(system, output, input)) see(z);
    if (high == 0) low = high = system.period > 0 ? 0.1 / system.period : 1;
    low = std::pow(10, std::floor(std::log10(low) - 1));
    high = std::pow(10, std::ceil(std::log10(high) + 1));
    if (system.period > 0) {
        high = pi / system.period;
        low = std::min(low, high / 1000);
    }
    return {low, high};
}

/// The same, and on to where L is no longer large, and down to where it goes on as it does at 0: a gain
/// crossover may lie far beyond the poles and zeros.
std::pair<double, double> range_to_one(const LinearSystem& loop, int output, int input) {
    constexpr int most_decades = 20;
    auto [low, high] = range(loop, output, input);
    const auto size = [&](double w) { return std::abs(frequency_response(loop, output, input, w)); };
    // Where L goes as a power of the frequency, its next decade tells that it will cross 1.
    const auto goes_to_one = [&](double w, double next) {
        return (size(w) > 1 && size(next) < 0.5 * size(w)) || (size(w) < 1 && size(next) > 2 * size(w));
    };
    for (int i = 0; i < most_decades && loop.period == 0 && goes_to_one(high, 10 * high); ++i) high *= 10;
    for (int i = 0; i < most_decades && goes_to_one(low, low / 10); ++i) low /= 10;
    return {low, high};
}

/// So many that nothing lies between them, for numbers.
std::vector<double> densely(const std::pair<double, double>& limits) {
    constexpr int per_decade = 400;
    return logarithmic(
        limits.first, limits.second,
        static_cast<int>(per_decade * std::max(10.0, std::log10(limits.second / limits.first))));
}

} // namespace

std::vector<double> frequencies(const LinearSystem& system, int output, int input, int count, bool to_one) {
    auto [low, high] = range(system, output, input);
    low = std::max(low, high * 1e-8);
    if (to_one) {
        const auto wide = range_to_one(system, output, input);
        if (wide.first < low) low = wide.first / (wide.first < low ? 10 : 1);
        if (wide.second > high) high = 10 * wide.second;
    }
    return logarithmic(low, high, count);
}

Response response(const LinearSystem& system, int output, int input, const std::vector<double>& omega) {
    Response all;
    double turns = 0;
    for (const double w : omega) {
        const Complex value = frequency_response(system, output, input, w);
        double phase = std::arg(value) * degrees;
        // K/(jω)^k begins at -90 k degrees, and at 180 less where K is negative.
        if (all.phase.empty() && w > 0) {
            const Complex lower = frequency_response(system, output, input, w / 10);
            const double k = std::round(std::log10(std::abs(lower / value)));
            if (std::isfinite(k)) phase += 360 * std::round((-90 * k - 45 - phase) / 360);
        }
        if (!all.phase.empty()) turns = std::round((all.phase.back() - phase) / 360);
        all.omega.push_back(w);
        all.value.push_back(value);
        all.magnitude.push_back(decibels(value));
        all.phase.push_back(phase + 360 * turns);
    }
    return all;
}

LinearSystem negative(LinearSystem system) {
    system.C = -system.C;
    system.D = -system.D;
    return system;
}

LinearSystem closed(const LinearSystem& loop, int output, int input) {
    LinearSystem one = single(loop, output, input);
    const double gain = 1 / (1 + one.D(0, 0));
    if (!std::isfinite(gain))
        throw RunError("the loop through '" + one.outputs.front() +
                       "' has a gain of -1 without delay: closed it is no "
                       "system");
    one.A = (one.A - gain * one.B * one.C).eval();
    one.B *= gain;
    one.C *= gain;
    one.D *= gain;
    return one;
}

namespace {

/// Where f is least between a and b, by golden sections.
template <class F> double least(F&& f, double a, double b) {
    constexpr double ratio = 0.6180339887498949;
    for (int i = 0; i < 80; ++i) {
        const double left = b - ratio * (b - a), right = a + ratio * (b - a);
        (f(left) < f(right) ? b : a) = f(left) < f(right) ? right : left;
    }
    return f(0.5 * (a + b));
}

} // namespace

Margins margins(const LinearSystem& loop, int output, int input) {
    Margins found;
    const auto L = [&](double w) { return frequency_response(loop, output, input, w); };
    const auto grid = densely(range_to_one(loop, output, input));
    const auto unit = [&](double w) { return std::abs(L(w)) - 1; };
    const auto real = [&](double w) { return L(w).imag(); };
    const auto distance = [&](double w) { return std::abs(1.0 + L(w)); };
    const auto see_distance = [&](double d) { found.modulus = std::min(found.modulus, d); };
    const auto see_gain = [&](double w, double value) {
        const double k = -1 / value;
        if (!(k > 0)) return;
        if (k > 1 && k < found.gain) {
            found.gain = k;
            found.phase_crossover = w;
        } else if (k < 1) {
            found.gain_reduction = std::max(found.gain_reduction, k);
        }
    };
    std::vector<double> distances;
    Complex before;
    double largest = 0;
    for (std::size_t i = 0; i < grid.size(); ++i) {
        const Complex now = L(grid[i]);
        if (i > 0 && (std::abs(before) > 1) != (std::abs(now) > 1)) {
            const double w = crossing(unit, grid[i - 1], grid[i]);
            const double angle = std::arg(-L(w)) * degrees; // from -1
            const double lag = angle < 0 ? angle + 360 : angle;
            found.delay = std::min(found.delay, lag / degrees / w);
            if (std::abs(angle) < std::abs(found.phase)) {
                found.phase = angle;
                found.gain_crossover = w;
            }
            see_distance(distance(w));
        }
        if (i > 0 && (before.imag() > 0) != (now.imag() > 0) && before.real() < 0 && now.real() < 0) {
            const double w = crossing(real, grid[i - 1], grid[i]);
            see_gain(w, L(w).real());
        }
        distances.push_back(std::abs(1.0 + now));
        see_distance(distances.back());
        largest = std::max(largest, std::abs(now));
        before = now;
    }
    for (std::size_t i = 1; i + 1 < grid.size(); ++i)
        if (distances[i] <= distances[i - 1] && distances[i] <= distances[i + 1])
            see_distance(least(distance, grid[i - 1], grid[i + 1]));
    // At 0, where no pole is, L is real; so it is far above all poles, and at half of the samples' frequency.
    const auto see_real = [&](double w, double value) {
        see_distance(std::abs(1 + value));
        if (std::abs(value) > 1e-9 * largest) see_gain(w, value); // else it is 0 but for rounding
    };
    if (!integrates(loop)) see_real(0, L(0).real());
    if (loop.period == 0)
        see_real(std::numeric_limits<double>::infinity(), loop.D(output, input));
    else
        see_real(pi / loop.period, L(pi / loop.period).real());
    const auto T = closed(loop, output, input);
    found.is_stable = is_stable(T);
    const double dc = std::abs(frequency_response(T, 0, 0, 0));
    if (std::isfinite(dc)) {
        const double limit = dc / std::sqrt(2.0);
        const auto above = [&](double w) { return std::abs(frequency_response(T, 0, 0, w)) - limit; };
        const auto its = densely(range(T, 0, 0));
        for (std::size_t i = 1; i < its.size(); ++i)
            if (above(its[i - 1]) > 0 && above(its[i]) <= 0) {
                found.bandwidth = crossing(above, its[i - 1], its[i]);
                break;
            }
    }
    return found;
}

RootLocus root_locus(const LinearSystem& loop, int output, int input, std::vector<double> gains) {
    const LinearSystem one = single(loop, output, input);
    // Roots at that gain, each of a branch the nearest that is left to where the branch was.
    const auto roots_at = [&](double k, const std::vector<Complex>* last) {
        const double gain = k / (1 + k * one.D(0, 0));
        auto roots = eigenvalues(one.A - gain * one.B * one.C);
        if (!last) {
            sort(roots);
            return roots;
        }
        std::vector<Complex> ordered;
        for (const auto& before : *last) {
            const auto nearest =
                std::min_element(roots.begin(), roots.end(), [&](const auto& a, const auto& b) {
                    return std::abs(a - before) < std::abs(b - before);
                });
            ordered.push_back(*nearest);
            roots.erase(nearest);
        }
        return ordered;
    };
    RootLocus locus;
    const bool is_free = gains.empty();
    if (is_free) {
        // From almost open to where the branches have gone far along their asymptotes.
        gains.push_back(0);
        for (int i = 0; i <= 400; ++i) gains.push_back(std::pow(10, -3 + 6.0 * i / 400));
    }
    // Where branches meet they move as the root of the gain: there it goes on in shorter steps.
    constexpr std::size_t most_gains = 3000;
    double size = 0;
    for (const auto& root : poles(one)) size = std::max(size, std::abs(root));
    const auto goes_far = [&](const std::vector<Complex>& a, const std::vector<Complex>& b) {
        for (std::size_t i = 0; i < a.size(); ++i)
            if (std::abs(a[i]) < 2 * size && std::abs(a[i] - b[i]) > 0.01 * size) return true;
        return false;
    };
    for (const double k : gains) {
        if (locus.gains.empty()) {
            locus.gains.push_back(k);
            locus.roots.push_back(roots_at(k, nullptr));
            continue;
        }
        double step = k - locus.gains.back();
        const double shortest = step / 4096;
        while (locus.gains.back() < k || step <= 0) {
            const double next = step <= 0 || step >= k - locus.gains.back() ? k : locus.gains.back() + step;
            auto roots = roots_at(next, &locus.roots.back());
            if (is_free && step > shortest && locus.gains.size() < most_gains &&
                goes_far(locus.roots.back(), roots)) {
                step /= 2;
                continue;
            }
            locus.gains.push_back(next);
            locus.roots.push_back(std::move(roots));
            if (!(step > 0)) break; // gains that were given may repeat, or fall
            step *= 2;
        }
    }
    return locus;
}

namespace {

StepResponse respond(const LinearSystem& one, double duration) {
    StepResponse found;
    constexpr int samples = 1000;
    const auto all = poles(one);
    const auto n = one.A.rows();
    double step = one.period;
    Matrix A = one.A, B = one.B;
    if (one.period == 0) {
        // Short enough for the fastest pole, and later twice as long again and again: what is fast is seen at
        // the beginning.
        double fastest = 0;
        for (const auto& p : all) fastest = std::max(fastest, std::abs(p));
        step = std::min(duration / samples, 0.02 / fastest);
        Matrix block = Matrix::Zero(n + 1, n + 1);
        block.topLeftCorner(n, n) = one.A * step;
        block.topRightCorner(n, 1) = one.B * step;
        const Matrix flow = block.exp();
        A = flow.topLeftCorner(n, n);
        B = flow.topRightCorner(n, 1);
    }
    Vector x = Vector::Zero(n);
    const double end = duration * (1 + 1e-12);
    for (double t = 0; found.time.size() <= 100 * samples; t += step) {
        found.time.push_back(t);
        found.value.push_back((n > 0 ? (one.C * x)(0) : 0) + one.D(0, 0));
        if (t + step > end) break;
        if (one.period == 0 && found.time.size() % (2 * samples) == 0) {
            B = (A * B + B).eval();
            A = (A * A).eval();
            step *= 2;
            if (t + step > end) break;
        }
        if (n > 0) x = A * x + B;
    }
    found.final =
        is_stable(one) ? frequency_response(one, 0, 0, 0).real() : std::numeric_limits<double>::quiet_NaN();
    const double sign = found.final < 0 ? -1 : 1;
    std::size_t top = 0;
    for (std::size_t i = 0; i < found.value.size(); ++i)
        if (sign * found.value[i] > sign * found.value[top]) top = i;
    found.peak = found.value[top];
    found.peak_time = found.time[top];
    found.overshoot = std::isnan(found.final) || found.final == 0
                          ? std::numeric_limits<double>::quiet_NaN()
                          : std::max(0.0, 100 * (found.peak - found.final) / found.final);
    const auto reaches = [&](double share) {
        for (std::size_t i = 0; i < found.value.size(); ++i)
            if (found.value[i] / found.final >= share) {
                if (i == 0 || one.period > 0) return found.time[i];
                const double a = found.value[i - 1] / found.final, b = found.value[i] / found.final;
                return found.time[i - 1] + (share - a) / (b - a) * (found.time[i] - found.time[i - 1]);
            }
        return std::numeric_limits<double>::quiet_NaN();
    };
    found.rise_time = reaches(0.9) - reaches(0.1);
    found.settling_time = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = found.value.size(); i-- > 0;)
        if (!(std::abs(found.value[i] / found.final - 1) <= 0.02)) {
            if (i + 1 < found.time.size()) found.settling_time = found.time[i + 1];
            break;
        } else if (i == 0) {
            found.settling_time = 0;
        }
    return found;
}

} // namespace

StepResponse step_response(const LinearSystem& system, int output, int input, double duration) {
    const LinearSystem one = single(system, output, input);
    if (duration > 0) return respond(one, duration);
    double slowest = 0; // time constant, of fading or growth
    for (const auto& p : poles(one)) {
        const double rate = std::abs(one.period > 0 ? std::log(std::abs(p)) / one.period : p.real());
        if (rate > 1e-9 && std::isfinite(rate)) slowest = std::max(slowest, 1 / rate);
    }
    if (slowest == 0) slowest = one.period > 0 ? 10 * one.period : 1;
    auto found = respond(one, 8 * slowest);
    // A final value that is small beside what fades is come to later.
    for (int times = 16; std::isfinite(found.final) && found.final != 0 && std::isnan(found.settling_time) &&
                         times <= 64 && is_stable(one);
         times *= 2)
        found = respond(one, times * slowest);
    return found;
}

} // namespace bf::analysis
