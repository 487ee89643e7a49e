// Subsystems that do not always run, loops, and zero crossings.
#include "generator.hpp"

#include "texts.hpp"

#include <algorithm>

namespace bf::codegen {

namespace {

const char* enumerator(model::Edge edge) {
    switch (edge) {
    case model::Edge::rising: return "rising";
    case model::Edge::falling: return "falling";
    case model::Edge::either: return "either";
    case model::Edge::level: break;
    }
    return "level";
}

} // namespace

std::string Generator::is_active(int condition) const {
    const bool is_triggered = diagram_.conditions[static_cast<std::size_t>(condition)].trigger.node >= 0;
    return (is_triggered ? "is_triggered_" : "is_enabled_") + number(condition) + "_";
}

std::string Generator::control_declarations() const {
    std::string text;
    for (std::size_t c = 1; c < diagram_.conditions.size(); ++c) {
        const auto& condition = diagram_.conditions[c];
        const std::string i = number(static_cast<int>(c));
        text += "    bool test_" + i + "() noexcept; // " + comment(condition.path) + "\n    void disable_" +
                i + "() noexcept;\n    bool is_enabled_" + i + "_ = false;\n";
        if (condition.trigger.node >= 0)
            text += "    bool is_triggered_" + i + "_ = false; // in this step\n";
        for (const auto& [signal, name] :
             {std::pair{condition.trigger, "trigger_" + i + "_"}, {condition.reset, "reset_" + i + "_"}})
            if (signal.node >= 0)
                text += "    " +
                        (is_dynamic()
                             ? "std::vector<double> " + name
                             : "double " + name + "[" + number(diagram_.slot(signal).size.count()) + "]") +
                        "; // at the last look\n";
    }
    for (const int rate : timed_rates_)
        text += "    Real period_" + number(rate) + "_ = 0, last_run_" + number(rate) + "_ = -1; // of " +
                comment(diagram_
                            .conditions[static_cast<std::size_t>(
                                diagram_.rates[static_cast<std::size_t>(rate)].trigger)]
                            .path) +
                " [s]\n";
    for (std::size_t l = 0; l < diagram_.plan.loops.size(); ++l)
        text += "    bool loop_" + number(static_cast<int>(l)) + "() noexcept; // " +
                comment(diagram_.plan.loops[l].path) + "\n";
    if (!guards_.empty()) text += "    bool refresh() noexcept;\n    bool answer_crossings() noexcept;\n";
    return text;
}

std::string Generator::control_resets() const {
    std::string text;
    for (std::size_t c = 1; c < diagram_.conditions.size(); ++c) {
        const auto& condition = diagram_.conditions[c];
        const std::string i = number(static_cast<int>(c));
        text += "    is_enabled_" + i + "_ = false;\n";
        for (const auto& [signal, name] :
             {std::pair{condition.trigger, "trigger_"}, {condition.reset, "reset_"}})
            if (signal.node >= 0)
                text += "    forget(" + (name + i) + "_, in(" + place_of(signal).text() + ").size());\n";
    }
    for (const int rate : timed_rates_)
        text += "    period_" + number(rate) + "_ = 0;\n    last_run_" + number(rate) + "_ = -1;\n";
    if (!guards_.empty())
        text += "    forget(elements<double>(guards_before_), " + number(guard_count()) + ");\n";
    return text;
}

std::string Generator::trigger_resets(int loop) const {
    std::string text;
    for (std::size_t c = 1; c < diagram_.conditions.size(); ++c)
        if (diagram_.conditions[c].trigger.node >= 0 && (loop < 0 || diagram_.conditions[c].loop == loop))
            text += "    " + is_active(static_cast<int>(c)) + " = false;\n";
    return text;
}

std::string Generator::condition_functions(int c) const {
    const auto& condition = diagram_.conditions[static_cast<std::size_t>(c)];
    const std::string i = number(c), is_enabled = "is_enabled_" + i + "_";
    const bool has_trigger = condition.trigger.node >= 0, has_reset = condition.reset.node >= 0;
    const auto edge = [&](const Node::End& end, model::Edge kind, const std::string& before) {
        return std::string("has_edge<bf::generated::Edge::") + enumerator(kind) + ">(" +
               place_of(end).text() + ", " + before + i + (is_dynamic() ? "_.data())" : "_)");
    };
    std::string text =
        "// " + comment(condition.path) + ": looks at its control signals.\nbool " + class_ + "::test_" + i +
        "() noexcept {\n    const bool is_enabled = " +
        (condition.enable.node >= 0 ? "is_positive(" + place_of(condition.enable).text() + ")" : "true") +
        ";\n";
    if (has_trigger)
        text +=
            "    const bool fires = " + edge(condition.trigger, condition.trigger_edge, "trigger_") + ";\n";
    std::string begins;
    if (has_reset) {
        text += "    const bool resets = " + edge(condition.reset, condition.reset_edge, "reset_") + ";\n";
        begins = "resets";
    }
    if (condition.enable.node >= 0)
        text += "    if (!is_enabled && " + is_enabled + ") disable_" + i + "();\n";
    if (condition.resets_states) {
        text += "    const bool begins = is_enabled && !" + is_enabled + ";\n";
        begins = has_reset ? "(begins || resets)" : "begins";
    }
    text += "    " + is_enabled + " = is_enabled;\n";
    if (has_trigger) text += "    is_triggered_" + i + "_ = is_enabled && fires;\n";
    std::string states;
    if (!begins.empty())
        for (const int n : condition.nodes)
            for (const auto& statement : resets(n, false)) states += indented(statement, 8);
    if (!states.empty()) text += "    if (is_enabled && " + begins + ") {\n" + states + "    }\n";
    const int rate = condition.triggered_rate;
    if (timed_rates_.contains(rate)) {
        const std::string r = number(rate);
        text += "    if (is_triggered_" + i + "_) {\n        period_" + r + "_ = last_run_" + r +
                "_ < 0 ? Real(0) : time_ - last_run_" + r + "_;\n        last_run_" + r +
                "_ = time_;\n    }\n";
    }
    if (has_trigger && has_hosted())
        text += "    if (is_triggered_" + i + "_) hosted_->fire(" + number(rate) + ", time_);\n";
    text += "    return true;\n}\n\nvoid " + class_ + "::disable_" + i + "() noexcept {\n    " + is_enabled +
            " = false;\n";
    if (has_trigger) text += "    is_triggered_" + i + "_ = false;\n";
    for (std::size_t o = 0; o < condition.outlets.size(); ++o)
        if (condition.outlets[o].resets && !place_of(condition.outlets[o].end).member.empty())
            text += indented(initial_output(static_cast<std::size_t>(c), o), 4);
    for (const int n : condition.nodes) {
        const auto& slots = block(n).declaration().slots;
        for (std::size_t s = 0; s < slots.size(); ++s)
            if (slots[s].role == Role::continuous_state && slots[s].size.count() > 0)
                text += "    assign(rates_." + place_of({n, static_cast<int>(s)}).member + ", Real(0));\n";
    }
    for (std::size_t inner = 1; inner < diagram_.conditions.size(); ++inner)
        if (diagram_.conditions[inner].parent == c) {
            const std::string j = number(static_cast<int>(inner));
            text += "    if (is_enabled_" + j + "_) disable_" + j + "();\n";
        }
    return text + "}\n\n";
}

std::string Generator::loop_function(int l, const std::string& body) const {
    const auto& loop = diagram_.plan.loops[static_cast<std::size_t>(l)];
    const bool is_while = loop.kind == Loop::Kind::while_loop;
    const auto first = [&](const Node::End& end) { return "in(" + place_of(end).text() + ")[0]"; };
    std::string text =
        "// " + comment(loop.path) + "\nbool " + class_ + "::loop_" + number(l) + "() noexcept {\n";
    for (const int n : loop.resets_states ? loop.nodes : loop.counters)
        for (const auto& statement : resets(n, false)) text += indented(statement, 4);
    if (is_while && loop.initial.node >= 0)
        text += "    if (!(" + first(loop.initial) + " > 0)) return true;\n";
    std::string most = number(loop.iterations);
    if (loop.count.node >= 0) {
        text += "    const double most = std::floor(static_cast<double>(" + first(loop.count) + "));\n";
        most = "most";
    }
    text += std::string("    for (") + (loop.count.node >= 0 ? "double" : "int") + " i = 1; i <= " + most +
            "; ++i) {\n" + indented(trigger_resets(l), 4) + "        if (!(" + body + ")) return false;\n";
    if (is_while) text += "        if (!(" + first(loop.again) + " > 0)) return true;\n";
    text += "    }\n";
    if (!is_while) return text + "    return true;\n}\n\n";
    return text + "    return fail(" + literal(node(loop.nodes.front()).path) +
           ",\n                \"the while loop around it did not end within " + number(loop.iterations) +
           " iterations: look at the condition of its \"\n                \"While, or let it allow "
           "more\");\n}\n\n";
}

int Generator::guard_count() const {
    int count = 0;
    for (const auto& field : guards_) count += field.slot->size.count();
    return count;
}

std::string Generator::crossings_function(const Calls& calls) const {
    const std::string count = number(guard_count());
    std::string text =
        "// Continuous signals after an event.\nbool " + class_ + "::refresh() noexcept {\n" +
        once_more(calls.continuous_outputs) +
        "}\n\n// Crossings of zero since the last step, and those that the answers cause.\nbool " + class_ +
        "::answer_crossings() noexcept {\n    const char* first = nullptr;\n    for (int "
        "round = 0;; ++round) {\n"
        "        forget(elements<double>(guards_), " +
        count + "); // of subsystems that do not run\n        if (!(" + calls.guards +
        ")) return false;\n        if (!find_crossings(elements<double>(guards_), "
        "elements<double>(guards_before_), " +
        count +
        ")) return true;\n        if (round > 1000)\n            return fail(first, \"its "
        "zero crossings answer one "
        "another without end: 1000 times at one instant; give one of \"\n                     "
        "          \"the blocks "
        "a dead band or hysteresis\");\n        first = nullptr;\n        if (before_event) "
        "before_event();\n";
    for (auto field = guards_.begin(); field != guards_.end();) {
        const int n = field->end.node;
        std::string crossed;
        for (; field != guards_.end() && field->end.node == n; ++field)
            crossed += (crossed.empty() ? "" : " || ") + ("has_crossed(guards_." + field->member + ")");
        const std::string path = literal(node(n).path);
        text += "        if (" + crossed + ") {\n            if (!first) first = " + path +
                ";\n            if (!hosted_->event(" + number(hosted_[static_cast<std::size_t>(n)]) +
                ")) return fail(" + path + ", hosted_->failure());\n        }\n";
    }
    return text + "        if (!refresh()) return false;\n    }\n}\n\n";
}

} // namespace bf::codegen
