#include "loop_by_gains.hpp"

#include "bf/analysis/loop_gain.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bf::analysis {

// ---- gains by name

LoopByGains::LoopByGains(Simulation& run, const TuneOptions& options)
    : run_(run), options_(options), start_(run.snapshot()), adjustables_(run) {
    for (const auto& name : options.by) add(name);
    double common = 0;
    for (const auto& gain : gains_) {
        first_.push_back(gain.whole.values[gain.element]);
        if (common == 0 && first_.back() != 0) common = first_.back() < 0 ? -1 : 1;
    }
    for (std::size_t i = 0; i < gains_.size(); ++i) {
        auto& gain = gains_[i];
        gain.sign = first_[i] != 0 ? (first_[i] < 0 ? -1 : 1) : common < 0 ? -1 : 1;
        const auto limits = adjustables_.find(gain.whole.path)->limits;
        const double low = std::max(limits.minimum, std::nextafter(limits.above, INFINITY));
        gain.range = gain.sign > 0 ? std::pair(std::max(low, 0.0), limits.maximum)
                                   : std::pair(std::max(-limits.maximum, 0.0), -low);
    }
    require_independence();
}

void LoopByGains::add(const std::string& name) {
    const auto part = [&](const char* its) { return adjustables_.find(name + its); };
    if (part(".P") && part(".I")) {
        add(name + ".P");
        add(name + ".I");
        const auto* D = part(".D");
        if (D && std::any_of(D->given.values.begin(), D->given.values.end(), [](double d) { return d != 0; }))
            add(name + ".D");
        return;
    }
    const auto [found, elements] = adjustables_.named(name);
    if (!found) {
        const bool is_block = run_.diagram().find_node(name) >= 0;
        throw RunError(is_block ? "block '" + name +
                                      "' has no parameters P and I of doubles; name one of its parameters, "
                                      "block.parameter"
                                : "the model has no parameter, variable or block with P and I '" + name +
                                      "'" + adjustables_.nearest(name));
    }
    if (elements.size() != 1)
        throw RunError("'" + name + "' has " + std::to_string(elements.size()) +
                       " elements; name one of them, as '" + adjustables_.name(*found, 0) + "'");
    gains_.push_back({name, found->given, elements[0], 1, {}});
}

/// Each of them is to be free of the others.
void LoopByGains::require_independence() const {
    for (std::size_t i = 0; i < gains_.size(); ++i)
        for (std::size_t k = 0; k < gains_.size(); ++k) {
            const auto &one = gains_[i], &other = gains_[k];
            if (i < k && one.whole.path == other.whole.path && one.element == other.element)
                throw RunError("'" + one.name + "' is named twice");
            if (one.whole.path == other.whole.path) continue;
            for (const auto& follower : adjustables_.follow({one.whole}))
                if (follower.path == other.whole.path)
                    throw RunError("'" + one.name + "' decides '" + other.name + "'; name one of them");
        }
}

std::string LoopByGains::names() const {
    std::string all;
    for (const auto& gain : gains_) all += (all.empty() ? "" : ", ") + gain.name;
    return all;
}

std::string LoopByGains::text(const Gains& gains) const {
    std::string all;
    for (std::size_t i = 0; i < gains.size(); ++i)
        all += (i > 0 ? ", " : "") + name(i) + " = " + short_text(gains[i]);
    return all;
}

bool LoopByGains::is_pid() const {
    if (gains_.size() != 3) return false;
    const auto& first = gains_[0].whole.path;
    const auto block = first.substr(0, first.rfind('.'));
    for (std::size_t i = 0; i < 3; ++i)
        if (gains_[i].whole.path != block + "." + "PID"[i]) return false;
    return true;
}

std::string LoopByGains::why_not(const Gains& gains) const {
    for (std::size_t i = 0; i < gains.size(); ++i) {
        const auto& gain = gains_[i];
        const std::string would = "'" + gain.name + "' would have to be " + short_text(gains[i]);
        if (!std::isfinite(gains[i]) || gains[i] * gain.sign < 0)
            return would + ", and gains keep their sign";
        const double size = std::abs(gains[i]);
        if (size < gain.range.first || size > gain.range.second)
            return would + ", and its limit is " +
                   short_text(gain.sign * (size < gain.range.first ? gain.range.first : gain.range.second));
    }
    return "";
}

void LoopByGains::set(const Gains& gains, bool accepts) {
    std::vector<ParameterValue> asked;
    for (std::size_t i = 0; i < gains_.size(); ++i) {
        const auto& gain = gains_[i];
        auto found = std::find_if(asked.begin(), asked.end(),
                                  [&](const ParameterValue& one) { return one.path == gain.whole.path; });
        if (found == asked.end()) found = asked.insert(asked.end(), gain.whole);
        found->values[gain.element] = gains[i];
    }
    auto change = run_.prepare(adjustables_.follow(asked));
    if (const Status status = run_.apply(change); !status) throw RunError(change.why_refused(status));
    if (accepts) run_.accept(asked);
}

void LoopByGains::finish(const Gains& gains, bool accepts) {
    run_.restore(start_);
    set(gains, accepts);
}

// ---- the loop

const LinearSystem& LoopByGains::loop(const Gains& gains) {
    if (gains == looped_) return loop_;
    if (options_.go_on && !options_.go_on()) throw Interrupted("the search was interrupted");
    looped_.clear();
    finish(gains, false);
    loop_ = loop_gain(run_, options_.loop, options_.open);
    looped_ = gains;
    return loop_;
}

bool LoopByGains::is_good(const Gains& gains) {
    if (!allows(gains)) return false;
    const auto& system = loop(gains);
    return are_stable(poles(closed(system)), system.period);
}

double LoopByGains::overshoot(const Gains& gains) {
    return step_response(closed(loop(gains)), 0, 0).overshoot;
}

TunedLoop::State LoopByGains::state(const Gains& gains) {
    TunedLoop::State state{.loop = loop(gains), .margins = {}, .step = {}};
    if (is_nothing(state.loop)) {
        state.margins.is_stable = true; // without gains there is no loop
        return state;
    }
    state.margins = margins(state.loop);
    state.step = step_response(closed(state.loop), 0, 0);
    return state;
}

void LoopByGains::require_effect() {
    const LinearSystem present = loop(first_);
    std::string without_effect;
    for (std::size_t i = 0; i < gains_.size(); ++i) {
        const auto [low, high] = gains_[i].range;
        const double size = std::abs(first_[i]);
        Gains moved = first_;
        moved[i] = size == 0             ? std::min(1.0, high)
                   : 1.25 * size <= high ? 1.25 * size
                                         : std::max(low, 0.8 * size);
        moved[i] *= gains_[i].sign;
        if (moved == first_)
            throw RunError("'" + name(i) + "' is held by its limits at " + short_text(first_[i]));
        const LinearSystem other = loop(moved);
        if (is_nothing(present) && is_nothing(other)) refuse_nothing(first_);
        const auto both = [&](const LinearSystem& a, const LinearSystem& b) {
            if (a.A.rows() != b.A.rows() || a.period != b.period) return false;
            const Reduced one(a, 0, 0), two(b, 0, 0);
            for (const double w : frequencies(a, 0, 0, 12))
                if (const Complex v = one(w), u = two(w); !(std::abs(v - u) <= 1e-13 * std::abs(v)))
                    return false;
            return true;
        };
        if (both(present, other)) without_effect = without_effect.empty() ? name(i) : without_effect;
    }
    if (!without_effect.empty())
        throw RunError("'" + without_effect + "' does not change what comes back to '" + options_.loop +
                       "'; name gains that act in that loop at this operating point");
}

void LoopByGains::refuse_nothing(const Gains& gains) {
    finish(gains, false);
    throw RunError((gains == first_ ? "" : "with " + text(gains) + " ") +
                   why_nothing_returns(run_, options_.loop, options_.open));
}

// ---- what can be had

double gain_margin(const Margins& m) {
    const double up = 20 * std::log10(m.gain), down = -20 * std::log10(m.gain_reduction);
    return std::min(up, down);
}

bool has_gain_margin(const Margins& m, double dB) { return dB == 0 || gain_margin(m) >= dB - 1e-9; }

Ends ends(const std::vector<double>& row, const std::function<bool(double)>& ok) {
    Ends found;
    const auto border = [&](double inside, double outside) {
        for (int k = 0; k < 20 && std::abs(outside - inside) > 1e-5 * std::abs(inside); ++k) {
            const double middle = 0.5 * (inside + outside);
            (ok(middle) ? inside : outside) = middle;
        }
        return inside;
    };
    for (std::size_t i = 0; i < row.size(); ++i) {
        if (ok(row[i])) {
            if (std::isnan(found.low)) {
                found.begins_before = i == 0;
                found.low = i == 0 ? row[0] : border(row[i], row[i - 1]);
            }
            found.high = row[i];
            found.goes_on = i + 1 == row.size();
        } else if (!std::isnan(found.low)) {
            found.high = border(found.high, row[i]);
            break;
        }
    }
    return found;
}

std::string range_text(const Ends& ends, const std::string& unit) {
    const auto inside = [](double value, double to) {
        std::string text = short_text(value);
        if (const double unit_of_last = std::pow(10, std::floor(std::log10(std::abs(value))) - 3);
            (std::stod(text) - value) * to < 0)
            text = short_text(value + to * 0.5 * unit_of_last);
        return text;
    };
    if (ends.begins_before && ends.goes_on) return "of any size";
    if (ends.begins_before) return "up to " + inside(ends.high, -1) + " " + unit;
    const std::string from = "from " + inside(ends.low, 1) + " ";
    return ends.goes_on ? from + unit + " on" : from + "to " + inside(ends.high, -1) + " " + unit;
}

} // namespace bf::analysis
