#include "bf/run/run.hpp"
#include "reduced.hpp"
#include "short_text.hpp"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace bf::analysis {

namespace {

void sort(std::vector<Complex>& numbers) {
    std::sort(numbers.begin(), numbers.end(), [](const Complex& a, const Complex& b) {
        return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
    });
}

} // namespace

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
    return without_hidden(std::move(one));
}

std::vector<Complex> poles(const LinearSystem& system) {
    auto all = eigenvalues(system.A);
    sort(all);
    return all;
}

std::vector<Complex> zeros(const LinearSystem& system, int output, int input) {
    auto all = Reduced(system, output, input).zeros();
    sort(all);
    return all;
}

bool are_stable(const std::vector<Complex>& poles, double period) {
    return std::all_of(poles.begin(), poles.end(),
                       [&](const Complex& p) { return period > 0 ? std::abs(p) < 1 : p.real() < 0; });
}

bool is_stable(const LinearSystem& system) {
    return are_stable(eigenvalues(without_hidden(system).A), system.period);
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
                       "' has a gain of -1 without delay: closed it is no system");
    one.A = (one.A - gain * one.B * one.C).eval();
    one.B *= gain;
    one.C *= gain;
    one.D *= gain;
    return one;
}

RootLocus root_locus(const LinearSystem& loop, int output, int input, std::vector<double> gains) {
    for (const double k : gains)
        if (!std::isfinite(k))
            throw RunError("a gain of a root locus is a finite number, not " + short_text(k));
    const Reduced L(loop, output, input);
    constexpr double part = 0.01; // of the picture, that a branch goes from gain to gain
    constexpr int most_halvings = 12;
    const bool is_free = gains.empty();
    double size = 0;
    if (is_free) {
        // From almost open to where the branches have gone far along their asymptotes.
        gains.push_back(0);
        for (int i = 0; i <= 120; ++i) gains.push_back(std::pow(10, -3 + 6.0 * i / 120));
        for (const auto& roots : {L.poles(), L.zeros(), L.poles(1)})
            for (const auto& root : roots) size = std::max(size, std::abs(root));
    }
    RootLocus locus;
    const auto goes_far = [&](const std::vector<Complex>& roots) {
        for (std::size_t i = 0; i < roots.size(); ++i) {
            const Complex last = locus.roots.back()[i];
            if (std::abs(last) < 2 * size && std::abs(roots[i] - last) > part * size) return true;
        }
        return false;
    };
    // Where branches meet they go as a root of the gain: there it goes on in shorter steps.
    const auto add = [&](const auto& self, double k, const std::vector<Complex>& roots,
                         int halvings) -> void {
        auto left = roots;
        std::vector<Complex> ordered;
        if (locus.roots.empty()) {
            ordered = roots;
            sort(ordered);
        } else {
            // Each branch goes on with the nearest root that is left.
            for (const auto& last : locus.roots.back()) {
                const auto nearest =
                    std::min_element(left.begin(), left.end(), [&](const auto& a, const auto& b) {
                        return std::abs(a - last) < std::abs(b - last);
                    });
                ordered.push_back(*nearest);
                left.erase(nearest);
            }
            if (is_free && halvings < most_halvings && goes_far(ordered)) {
                const double middle = 0.5 * (locus.gains.back() + k);
                self(self, middle, L.poles(middle), halvings + 1);
                self(self, k, roots, halvings + 1);
                return;
            }
        }
        locus.gains.push_back(k);
        locus.roots.push_back(std::move(ordered));
    };
    for (const double k : gains) add(add, k, L.poles(k), 0);
    return locus;
}

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Time and value from rest, until then.
StepResponse respond(const LinearSystem& one, const std::vector<Complex>& poles, double duration) {
    StepResponse found;
    constexpr int samples = 1000;
    const auto n = one.A.rows();
    double step = one.period;
    Matrix A = one.A, B = one.B;
    if (one.period == 0) {
        // Short enough for the fastest pole, and later twice as long again and again: what is fast is seen at
        // the beginning.
        double fastest = 0;
        for (const auto& p : poles) fastest = std::max(fastest, std::abs(p));
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
    return found;
}

} // namespace

StepResponse step_response(const LinearSystem& system, int output, int input, double duration) {
    const LinearSystem one = single(system, output, input);
    const auto all = poles(one);
    double slowest = 0; // time constant, of fading or growth
    for (const auto& p : all) {
        const double rate = std::abs(one.period > 0 ? std::log(std::abs(p)) / one.period : p.real());
        if (rate > 1e-9 && std::isfinite(rate)) slowest = std::max(slowest, 1 / rate);
    }
    if (slowest == 0) slowest = one.period > 0 ? 10 * one.period : 1;
    const double final = are_stable(all, one.period) ? frequency_response(one, 0, 0, 0).real() : nan;
    StepResponse found;
    // A final value that is small beside what fades is come to later.
    for (int times = 8; times <= 64; times *= 2) {
        found = respond(one, all, duration > 0 ? duration : times * slowest);
        found.final = final;
        static_cast<StepMeasures&>(found) = measure_step(found.time, found.value, final, one.period > 0);
        if (duration > 0 || std::isnan(final) || !std::isnan(found.settling_time)) break;
    }
    return found;
}

} // namespace bf::analysis
