// A loop of a run as a function of gains, and what is asked of it.
#pragma once

#include "adjustable.hpp"
#include "bf/analysis/tune_loop.hpp"
#include "reduced.hpp"
#include "short_text.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace bf::analysis {

using Gains = std::vector<double>;

/// Whoever asked for it does not wait for the end.
struct Interrupted : RunError {
    using RunError::RunError;
};

/// The loop, linearised at the run's state when this is made, for each set of gains.
class LoopByGains {
  public:
    /// Throws RunError: gains that are unknown, fixed, named twice, or that change nothing.
    LoopByGains(Simulation& run, const TuneOptions& options);

    const TuneOptions& asked() const { return options_; }
    std::size_t count() const { return gains_.size(); }
    const std::string& name(std::size_t i) const { return gains_[i].name; }
    std::string names() const;
    std::string text(const Gains& gains) const; ///< "pid.P = 2, pid.I = 0.5"
    const Gains& first() const { return first_; }
    double sign(std::size_t i) const { return gains_[i].sign; } ///< which a gain keeps
    /// The least and the greatest absolute value that its sign and its limits leave; infinite: there is none.
    std::pair<double, double> range(std::size_t i) const { return gains_[i].range; }
    bool is_pid() const; ///< are they P, I and D of one block, in this order?
    /// Empty, or what of them is out of the question: "'k.P' would have to be 25, and is at most 20".
    std::string why_not(const Gains& gains) const;
    bool allows(const Gains& gains) const { return !gains.empty() && why_not(gains).empty(); }

    /// What is asked of one set of gains is asked one after another.
    const LinearSystem& loop(const Gains& gains);
    Complex at(const Gains& gains, double omega) { return Reduced(loop(gains), 0, 0)(omega); }
    bool is_good(const Gains& gains); ///< allowed, and stable when the loop is closed
    double overshoot(const Gains& gains);
    TunedLoop::State state(const Gains& gains);
    /// Leaves the run at the state that it had, with these gains.
    void finish(const Gains& gains, bool accepts);
    void give_up() { run_.restore(start_); } ///< with the gains that it had
    /// Throws RunError where nothing comes back with the model's gains, nor with slightly others, with what
    /// is in the way; and for a gain that changes nothing.
    void require_effect();
    /// With gains with which nothing comes back.
    [[noreturn]] void refuse_nothing(const Gains& gains);

  private:
    struct Gain {
        std::string name;
        ParameterValue whole;
        std::size_t element;
        double sign;
        std::pair<double, double> range;
    };
    void add(const std::string& name);
    void require_independence() const;
    void set(const Gains& gains, bool accepts = false);

    Simulation& run_;
    const TuneOptions& options_;
    std::vector<std::byte> start_;
    Adjustables adjustables_;
    std::vector<Gain> gains_;
    Gains first_, looped_;
    LinearSystem loop_; ///< with the gains that were asked for last
};

/// Finds gains that meet what is asked; throws RunError, and says what can be had.
Gains search_one_gain(LoopByGains& loop);
/// Crossovers lie below `most_omega` [rad/s].
Gains search_gains(LoopByGains& loop, double most_omega);

bool has_gain_margin(const Margins& margins, double dB);
/// Of a loop that lost it that way sooner [dB].
double gain_margin(const Margins& margins);

/// The ends of what can be had in a row of increasing numbers, bisected; `ok` holds within. NaN: there is
/// none.
struct Ends {
    double low = NAN, high = NAN;
    bool begins_before = false, goes_on = false; ///< does it hold at the row's own ends?
};
Ends ends(const std::vector<double>& row, const std::function<bool(double)>& ok);
/// "from 1 to 5 rad/s", "from 1 rad/s on", "up to 5 rad/s", rounded so that they lie within.
std::string range_text(const Ends& ends, const std::string& unit);

} // namespace bf::analysis
