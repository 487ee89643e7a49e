// Rates of a model as clocks of its FMU.
#include "generator.hpp"

#include <algorithm>
#include <cmath>

namespace bf::codegen {

namespace {
bool has_period(const SampleRate& rate) {
    return !rate.is_constant && !rate.is_continuous && rate.trigger == 0;
}
} // namespace

/// Those with a period at which some blocks run, and not only inputs of the root are held.
std::vector<int> Generator::clocked_rates() const {
    std::set<int> held, all;
    for (const auto& input : diagram_.inputs) held.insert(input.end.node);
    for (int n = 0; n < static_cast<int>(diagram_.nodes.size()); ++n)
        if (!held.contains(n) && has_period(diagram_.rates[static_cast<std::size_t>(node(n).rate)]))
            all.insert(node(n).rate);
    return {all.begin(), all.end()};
}

/// Those at which a signal gets its values, or an input of the root is read; none where some of it may be at
/// any time.
std::vector<int> Generator::rates_of(const Node::End& end) const {
    std::set<int> all{node(end.node).rate};
    const auto is_end = [&](const SignalName& input) {
        return input.end.node == end.node && input.end.slot == end.slot;
    };
    if (std::any_of(diagram_.inputs.begin(), diagram_.inputs.end(), is_end)) {
        all.clear();
        for (const auto& reader : diagram_.nodes)
            for (const auto& source : reader.sources)
                if (source.node == end.node && source.slot == end.slot) all.insert(reader.rate);
    }
    const bool are_clocked = std::all_of(all.begin(), all.end(), [&](int rate) {
        return has_period(diagram_.rates[static_cast<std::size_t>(rate)]);
    });
    return are_clocked ? std::vector<int>(all.begin(), all.end()) : std::vector<int>();
}

/// Does anything happen in every step of the model that is neither continuous nor of a rate with a period?
bool Generator::has_unclocked_steps() const {
    using Kind = program::Statement::Kind;
    const auto has_rate = [&](const program::Statement& s) { // the conditions of a rate itself
        return s.kind == Kind::when &&
               std::any_of(s.when.begin(), s.when.end(), [&](const program::Literal& l) {
                   if (l.kind != program::Literal::Kind::flag || l.is_negated) return false;
                   const auto& flag = program_.flags[static_cast<std::size_t>(l.number)];
                   return flag.kind == program::Flag::Kind::hit &&
                          has_period(diagram_.rates[static_cast<std::size_t>(flag.number)]);
               });
    };
    const auto is_clocked = [&](const program::Statement& s) {
        return has_rate(s) || s.kind == Kind::integrate || s.kind == Kind::finite ||
               ((s.kind == Kind::run || s.kind == Kind::commit) &&
                has_period(diagram_.rates[static_cast<std::size_t>(node(s.node).rate)]));
    };
    return !std::all_of(program_.outputs.begin(), program_.outputs.end(), [&](const program::Statement& s) {
        return is_clocked(s) || (s.kind == Kind::run && (s.passes & program::again) != 0);
    }) || !std::all_of(program_.update.begin(), program_.update.end(), is_clocked);
}

FmuClock Generator::clock_of(const SampleRate& rate) const {
    FmuClock clock{{}, rate.ticks, rate.offset};
    const double interval = static_cast<double>(rate.ticks) * diagram_.step,
                 shift = static_cast<double>(rate.offset) * diagram_.step;
    for (double resolution = 1; resolution <= 1e9 && clock.resolution == 0; resolution *= 10) {
        const double i = std::round(interval * resolution), s = std::round(shift * resolution);
        if (i / resolution == interval && s / resolution == shift)
            clock.resolution = static_cast<std::uint64_t>(resolution),
            clock.interval = static_cast<std::uint64_t>(i), clock.shift = static_cast<std::uint64_t>(s);
    }
    return clock;
}

} // namespace bf::codegen
