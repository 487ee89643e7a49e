#include "bf/analysis/tune_loop.hpp"

#include "loop_by_gains.hpp"

#include <cmath>
#include <numbers>

namespace bf::analysis {

namespace {

void check(const TuneOptions& asked, const LoopByGains& loop) {
    const auto refuse = [](const std::string& what, double value) {
        throw RunError(what + " is a number above 0, not " + short_text(value));
    };
    const bool has_speed = asked.crossover != 0 || asked.bandwidth != 0;
    if (asked.crossover != 0 && asked.bandwidth != 0)
        throw RunError("a crossover and a bandwidth say the same; give one of them");
    if (const double speed = asked.crossover + asked.bandwidth;
        has_speed && !(speed > 0 && std::isfinite(speed)))
        refuse("a crossover or bandwidth", speed);
    if (asked.phase_margin && !(*asked.phase_margin > 0 && *asked.phase_margin < 180))
        throw RunError("a phase margin lies between 0 and 180 degrees, not at " +
                       short_text(*asked.phase_margin));
    if (asked.overshoot && !(*asked.overshoot > 0)) refuse("an overshoot", *asked.overshoot);
    if (!(asked.gain_margin >= 0) || !std::isfinite(asked.gain_margin))
        throw RunError("a gain margin is at least 0 dB, not " + short_text(asked.gain_margin) + " dB");
    if (loop.count() == 0) throw RunError("name gains by which the loop is tuned");
    if (loop.count() > 2 && !loop.is_pid())
        throw RunError(
            "a crossover and a phase margin decide two gains, or P, I and D of a block; there are " +
            std::to_string(loop.count()) + ": name the block, or two of them");
    if (loop.count() > 1 && !has_speed)
        throw RunError("say how fast the loop is to be: a crossover or a bandwidth, rad/s");
    if (loop.count() == 1 && has_speed && asked.overshoot)
        throw RunError(
            "one gain meets one requirement: a crossover, a bandwidth, a phase margin or an overshoot");
}

/// Of all crossovers, where requirements are met at one.
void verify(const TuneOptions& asked, const Margins& m) {
    if (asked.phase_margin && m.phase < *asked.phase_margin - 1e-6)
        throw RunError("the loop crosses 1 again at " + short_text(m.gain_crossover) +
                       " rad/s, where its phase margin is " + short_text(m.phase) +
                       " degrees; ask for a slower loop, or damp what resonates there");
    if (m.modulus < 1e-6)
        throw RunError("the closed loop would swing on for ever at " + short_text(m.gain_crossover) +
                       " rad/s, where the loop's gain is -1; ask for another speed, or tune more gains");
    if (has_gain_margin(m, asked.gain_margin)) return;
    const bool is_up = 20 * std::log10(m.gain) < asked.gain_margin;
    throw RunError(
        is_up ? "the gain margin comes to " + short_text(20 * std::log10(m.gain)) + " dB at " +
                    short_text(m.phase_crossover) + " rad/s, not to " + short_text(asked.gain_margin) +
                    " dB; ask for a slower loop or a greater phase margin"
              : "the closed loop would be unstable with " + short_text(-20 * std::log10(m.gain_reduction)) +
                    " dB less gain, not with " + short_text(asked.gain_margin) +
                    " dB; ask for a faster loop or a greater phase margin");
}

} // namespace

TunedLoop tune_loop(Simulation& run, const TuneOptions& asked) {
    LoopByGains loop(run, asked);
    try {
        check(asked, loop);
        loop.require_effect();
        TunedLoop found;
        found.before = loop.state(loop.first());
        const double period = found.before.loop.period;
        const double most = period > 0 ? std::numbers::pi / period : std::numeric_limits<double>::infinity();
        if (asked.crossover >= most || asked.bandwidth >= most)
            throw RunError(
                "the loop is sampled at " + short_text(2 * most) +
                " rad/s, of which half can be had at most, not " +
                short_text(asked.crossover + asked.bandwidth) + " rad/s" +
                (found.before.loop.held.empty() ? "" : "; held: " + found.before.loop.held.front()));
        const Gains gains = loop.count() == 1 ? search_one_gain(loop) : search_gains(loop, most);
        found.after = loop.state(gains);
        verify(asked, found.after.margins);
        for (std::size_t i = 0; i < gains.size(); ++i)
            found.gains.push_back({loop.name(i), loop.first()[i], gains[i]});
        loop.finish(gains, true);
        return found;
    } catch (...) {
        loop.give_up();
        throw;
    }
}

} // namespace bf::analysis
