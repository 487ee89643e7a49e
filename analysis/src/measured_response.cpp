#include "bf/analysis/measured_response.hpp"

#include "injection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace bf::analysis {

namespace {

constexpr double pi = std::numbers::pi;

/// A stretch of so many base steps, in which so many periods fit; or of a chirp, one of its own periods.
struct Stretch {
    std::int64_t steps, cycles;
};

/// Samples of one stretch.
struct Samples {
    std::int64_t every = 1; ///< base steps from one to the next
    std::vector<double> values = {};

    double mean() const {
        return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    }
    /// Without the mean, and without a drift that takes it from one stretch to the next.
    void level(double drift) {
        const double middle = 0.5 * (static_cast<double>(values.size()) - 1), level = mean(),
                     slope = drift / static_cast<double>(values.size());
        for (std::size_t n = 0; n < values.size(); ++n)
            values[n] -= level + slope * (static_cast<double>(n) - middle);
    }
    /// (2/N) Σ v exp(-j 2π cycles n/N).
    Complex at(std::int64_t cycles) const {
        const auto count = static_cast<std::int64_t>(values.size());
        Complex sum = 0;
        for (std::int64_t n = 0; n < count; ++n)
            sum += values[static_cast<std::size_t>(n)] *
                   std::polar(1.0,
                              -2 * pi * static_cast<double>(cycles * n % count) / static_cast<double>(count));
        return 2.0 / static_cast<double>(count) * sum;
    }
    double power() const {
        double sum = 0;
        for (const double v : values) sum += v * v;
        return sum / static_cast<double>(values.size());
    }
};

class Measurement final : Run::Observer {
  public:
    Measurement(Simulation& run, const MeasureOptions& options)
        : run_(run), d_(run.diagram()), options_(options), is_loop_(!options.loop.empty()),
          from_(find_element(d_, is_loop_ ? options.loop : options.from)),
          to_(is_loop_ ? from_ : find_element(d_, options.to)), start_(run.snapshot()) {
        if (!(options.amplitude >= 0) || !std::isfinite(options.amplitude))
            throw RunError("the amplitude of what is added is a number above 0, not " +
                           std::to_string(options.amplitude));
        const auto& source = d_.nodes[static_cast<std::size_t>(from_.end.node)];
        if (is_loop_ && source.block->declaration().traits.is_root_input)
            throw RunError("no loop goes through '" + from_.name + "', an input of the root");
        if (options.omega.empty()) throw RunError("name frequencies at which the response is measured");
        x_.every = ticks(from_.end);
        y_.every = ticks(to_.end);
        constexpr std::int64_t most_common = 100'000; // else those of the two signals count alone
        for (const auto& rate : d_.rates)
            if (!rate.is_constant && rate.trigger == 0 && common_ <= most_common)
                common_ = std::lcm(common_, rate.ticks);
        if (common_ > most_common) common_ = std::lcm(x_.every, y_.every);
        const double value = read(from_);
        amplitude_ = options.amplitude > 0 ? options.amplitude : 0.01 * std::max(1.0, std::abs(value));
        omega_ = options.omega;
        std::sort(omega_.begin(), omega_.end());
        for (const double omega : omega_) check(omega);
    }
    ~Measurement() override { run_.remove_observer(*this); }

    MeasuredResponse operator()() {
        MeasuredResponse found{.input = from_.name,
                               .output = to_.name,
                               .input_unit = from_.unit,
                               .output_unit = to_.unit,
                               .amplitude = amplitude_,
                               .time = run_.time(),
                               .response = {},
                               .coherence = {},
                               .distortion = {},
                               .unsettled = {}};
        run_.add_observer(*this);
        if (options_.excitation == MeasureOptions::Excitation::sine)
            for (const double omega : omega_) sine(omega, found);
        else
            chirp(found);
        for (std::size_t i = 0; i < found.response.value.size(); ++i) {
            auto& r = found.response;
            const double phase = std::arg(r.value[i]) * 180 / pi;
            r.magnitude.push_back(20 * std::log10(std::abs(r.value[i])));
            r.phase.push_back(i == 0 ? phase : phase + 360 * std::round((r.phase.back() - phase) / 360));
        }
        run_.restore(start_);
        return found;
    }

  private:
    /// Base steps from one value to the next.
    std::int64_t ticks(const Node::End& end) const {
        const auto& node = d_.nodes[static_cast<std::size_t>(end.node)];
        const auto& rate = d_.rates[static_cast<std::size_t>(node.rate)];
        return node.block->declaration().traits.is_root_input || rate.is_constant || rate.trigger > 0
                   ? 1
                   : rate.ticks;
    }
    bool is_hit(const Node::End& end, std::int64_t every) const {
        return every == 1 || run_.is_hit(d_.nodes[static_cast<std::size_t>(end.node)].rate);
    }
    double read(const Element& element) const {
        return read_value(run_.context().data(element.end.node, element.end.slot), d_.slot(element.end).type,
                          element.number);
    }

    void check(double omega) const {
        const double most = pi / (d_.step * static_cast<double>(std::max(x_.every, y_.every)));
        if (!(omega > 0) || !(omega < most))
            throw RunError("a response is measured at frequencies above 0 and below half of the sampling "
                           "frequency, here " +
                           std::to_string(most) + " rad/s, not at " + std::to_string(omega) + " rad/s");
        constexpr double most_steps = 1e8;
        if (4 * pi / (omega * d_.step) > most_steps)
            throw RunError("two periods of " + std::to_string(omega) +
                           " rad/s are more than 100000000 base steps; begin at a higher frequency");
    }

    /// Whole periods in whole common periods of all rates, near that frequency.
    Stretch stretch(double omega) const {
        const double common = d_.step * static_cast<double>(common_);
        constexpr double near = 1e-3;
        constexpr std::int64_t most_cycles = 500;
        const std::int64_t samples = common_ / std::max(x_.every, y_.every);
        Stretch best{0, 0};
        double least = 1e300;
        for (std::int64_t cycles = 2; cycles <= most_cycles && least > near; ++cycles) {
            const double ideal = 2 * pi * static_cast<double>(cycles) / (omega * common);
            const auto count = static_cast<std::int64_t>(std::llround(ideal));
            if (count < 1 || count * samples <= 2 * cycles) continue;
            const double error = std::abs(ideal / static_cast<double>(count) - 1);
            if (error < least) {
                least = error;
                best = {count * common_, cycles};
            }
        }
        if (best.steps == 0)
            throw RunError("no whole number of periods near " + std::to_string(omega) +
                           " rad/s fits the common period of all sample times, " + std::to_string(common) +
                           " s; choose a lower frequency");
        return best;
    }

    void observe(const Run&) noexcept override {
        if (run_.shows_event()) return;
        const double t = run_.time();
        if (is_hit(from_.end, x_.every) && x_.values.size() < x_.values.capacity())
            x_.values.push_back(is_loop_ ? read(from_) : signal_(t));
        if (is_hit(to_.end, y_.every) && y_.values.size() < y_.values.capacity())
            y_.values.push_back(is_loop_ ? -injection_->own() : read(to_));
    }

    /// Runs from the start with what `signal_` says, calls see() after each stretch but the first, which says
    /// whether it is enough.
    template <class See> void run(const Stretch& stretch, std::int64_t most, See&& see) {
        run_.restore(start_);
        injection_.emplace(run_, from_, signal_);
        const std::shared_ptr<void> end(nullptr, [this](void*) { injection_.reset(); });
        double x_before = 0, y_before = 0, power_before = 0;
        for (std::int64_t i = 0; i < most; ++i) {
            for (Samples* samples : {&x_, &y_}) {
                samples->values.clear();
                samples->values.reserve(static_cast<std::size_t>(stretch.steps / samples->every));
            }
            for (std::int64_t k = 0; k < stretch.steps; ++k) {
                if (options_.go_on && k % 1000 == 0 && !options_.go_on())
                    throw RunError("the measurement was interrupted");
                if (!run_.step()) throw RunError(run_.failure());
            }
            const double x_mean = x_.mean(), y_mean = y_.mean();
            if (i > 0) {
                if (is_loop_) x_.level(x_mean - x_before); // else it is what is added, without any
                y_.level(y_mean - y_before);
                const double power = y_.power();
                if (see()) {
                    // What grows without end is alike all around the loop: -1 comes back of it.
                    if (power > 2 * power_before && power_before > 0)
                        throw RunError("what comes " + std::string(is_loop_ ? "back" : "out") +
                                       " grows without end: " +
                                       (is_loop_ ? "the closed loop is unstable" : "the model is unstable") +
                                       ", so that nothing can be measured; stabilise it first");
                    return;
                }
                power_before = power;
            }
            x_before = x_mean;
            y_before = y_mean;
        }
    }

    /// How much a value may still change, if its changes go on to shrink as they did.
    struct Settling {
        Complex last = 0;
        double change = 0, left = std::numeric_limits<double>::infinity();
        int count = 0;

        void see(const Complex& value) {
            constexpr double slowest = 0.999;
            const double now = std::abs(value - last);
            if (count >= 2) {
                const double ratio = change > 0 ? std::min(now / change, slowest) : slowest;
                left = now * std::max(1.0, ratio / (1 - ratio));
            }
            change = now;
            last = value;
            ++count;
        }
    };

    void sine(double omega, MeasuredResponse& found) {
        const Stretch stretch = this->stretch(omega);
        const double exact =
            2 * pi * static_cast<double>(stretch.cycles) / (static_cast<double>(stretch.steps) * d_.step);
        signal_ = [a = amplitude_, exact, begin = run_.time()](double t) {
            return a * std::sin(exact * (t - begin));
        };
        Settling settling;
        double coherence = 0;
        run(stretch, std::max<std::int64_t>(4, options_.most_periods / stretch.cycles), [&] {
            const Complex y = y_.at(stretch.cycles);
            settling.see(y / x_.at(stretch.cycles));
            const double power = y_.power();
            coherence = power > 0 ? std::min(1.0, std::norm(y) / (2 * power)) : 0;
            return settling.left <= options_.tolerance * std::abs(settling.last);
        });
        add(found, exact, settling, settling.left / std::abs(settling.last), coherence);
        found.distortion.push_back(std::sqrt(1 / coherence - 1));
    }

    static void add(MeasuredResponse& found, double omega, const Settling& settling, double unsettled,
                    double coherence) {
        found.response.omega.push_back(omega);
        found.response.value.push_back(settling.last);
        found.coherence.push_back(coherence);
        found.unsettled.push_back(unsettled);
    }

    void chirp(MeasuredResponse& found) {
        const double least = omega_.front(), most = omega_.back();
        const double common = d_.step * static_cast<double>(common_),
                     asked = 2 * pi * options_.chirp_periods / least;
        const auto steps = static_cast<std::int64_t>(std::ceil(asked / common)) * common_;
        const double period = static_cast<double>(steps) * d_.step, base = 2 * pi / period;
        const double limit = 0.45 * 2 * pi / (d_.step * static_cast<double>(std::max(x_.every, y_.every)));
        const double low = 0.8 * least, high = std::max(std::min(1.25 * most, limit), most);
        // φ(u) = c (r^u - 1) over a period, u from 0 to 1, with a whole number of turns at its end.
        const double ratio = high / low,
                     turns = std::round(low * period / std::log(ratio) * (ratio - 1) / (2 * pi));
        const double c = 2 * pi * turns / (ratio - 1);
        signal_ = [a = amplitude_, c, period, rate = std::log(ratio), begin = run_.time()](double t) {
            const double u = (t - begin) / period;
            return a * std::sin(c * std::expm1(rate * (u - std::floor(u))));
        };
        std::vector<std::int64_t> bins;
        for (const double omega : omega_) {
            const auto bin = static_cast<std::int64_t>(std::llround(omega / base));
            if (bins.empty() || bins.back() != bin) bins.push_back(bin);
        }
        constexpr std::int64_t neighbours = 2;
        std::vector<Settling> settling(bins.size());
        std::vector<double> coherence(bins.size()), left(bins.size());
        run({steps, 1}, std::max(4, options_.most_periods / options_.chirp_periods), [&] {
            double largest = 0;
            for (std::size_t i = 0; i < bins.size(); ++i) {
                double xx = 0, yy = 0;
                Complex yx = 0;
                for (std::int64_t k = std::max<std::int64_t>(1, bins[i] - neighbours);
                     k <= bins[i] + neighbours; ++k) {
                    const Complex x = x_.at(k), y = y_.at(k);
                    if (k == bins[i]) settling[i].see(y / x);
                    xx += std::norm(x);
                    yy += std::norm(y);
                    yx += y * std::conj(x);
                }
                coherence[i] = yy > 0 ? std::norm(yx) / (xx * yy) : 0;
                largest = std::max(largest, std::abs(settling[i].last));
            }
            bool is_enough = true;
            // Far below the largest response stands what the others leave.
            for (std::size_t i = 0; i < bins.size(); ++i) {
                left[i] = settling[i].left / std::max(std::abs(settling[i].last), 1e-3 * largest);
                is_enough = is_enough && left[i] <= options_.tolerance;
            }
            return is_enough;
        });
        for (std::size_t i = 0; i < bins.size(); ++i)
            add(found, base * static_cast<double>(bins[i]), settling[i], left[i], coherence[i]);
        found.distortion.assign(bins.size(), std::numeric_limits<double>::quiet_NaN());
    }

    Simulation& run_;
    const Diagram& d_;
    const MeasureOptions& options_;
    bool is_loop_;
    Element from_, to_;
    std::vector<std::byte> start_;
    std::vector<double> omega_; ///< sorted
    double amplitude_ = 0;
    std::int64_t common_ = 1; ///< period of all rates, in base steps
    Samples x_, y_;
    std::function<double(double)> signal_;
    std::optional<Injection> injection_;
};

} // namespace

MeasuredResponse measure_response(Simulation& run, const MeasureOptions& options) {
    const auto here = run.snapshot();
    try {
        return Measurement(run, options)();
    } catch (...) {
        run.restore(here);
        throw;
    }
}

} // namespace bf::analysis
