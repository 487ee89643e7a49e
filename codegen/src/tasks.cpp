// A function for each rate.
#include "generator.hpp"

#include <algorithm>
#include <cmath>

namespace bf::codegen {

namespace {

/// "10ms" in the largest unit in which it is whole; else in base steps.
std::string time_name(double time, std::int64_t steps) {
    const double nanoseconds = std::round(time * 1e9);
    if (nanoseconds < 1 || std::abs(nanoseconds * 1e-9 - time) > 1e-9 * time || nanoseconds > 9e15)
        return std::to_string(steps) + "_steps";
    auto count = static_cast<std::int64_t>(nanoseconds);
    const char* unit = "ns";
    for (const char* larger : {"us", "ms", "s"}) {
        if (count % 1000 != 0) break;
        count /= 1000;
        unit = larger;
    }
    return std::to_string(count) + unit;
}

} // namespace

std::string Generator::rate_name(int rate) const {
    const auto& its = diagram_.rates[static_cast<std::size_t>(rate)];
    const auto name = [&](std::int64_t steps) {
        return time_name(static_cast<double>(steps) * diagram_.step, steps);
    };
    return name(its.ticks) + (its.offset > 0 ? "_after_" + name(its.offset) : "");
}

std::string Generator::rate_doc(const program::Task& task) const {
    const auto text = program::period_text(diagram_, task.rate);
    const auto plus = text.find(" + ");
    return "Every " + text.substr(0, plus) +
           (plus == text.npos ? "" : ", first at " + text.substr(plus + 3)) + ".";
}

std::string Generator::rate_rules(const std::string& slashes) {
    std::string text;
    for (const char* line : {"One function per rate, for a scheduler that gives a shorter period the higher "
                             "priority: where several",
                             "are due they run in this order, each may interrupt those below it anywhere, "
                             "and each ends before it is",
                             "due again. From initialize on call either these or step, which calls those "
                             "that are due. False when it",
                             "failed; all of them then fail until initialized."})
        text += slashes + " " + line + "\n";
    return text;
}

std::int64_t Generator::calls_between(const program::Flag& hit) const {
    const auto ticks = [&](int rate) { return diagram_.rates[static_cast<std::size_t>(rate)].ticks; };
    return ticks(hit.number) / (hit.task < 0 ? 1 : ticks(hit.task));
}

std::int64_t Generator::calls_before(const program::Flag& hit) const {
    const auto& rate = diagram_.rates[static_cast<std::size_t>(hit.number)];
    if (hit.task < 0) return rate.offset;
    const auto& task = diagram_.rates[static_cast<std::size_t>(hit.task)];
    return (rate.offset - task.offset) / task.ticks;
}

std::string Generator::hit_name(const program::Flag& hit) {
    return number(hit.number) + (hit.task < 0 ? "" : "_in_" + number(hit.task));
}

std::string Generator::time_inside() const { return time_of(is_split() ? program_.tasks.front().rate : -1); }

void Generator::print_step(Calls& calls) {
    if (!is_split()) {
        print_outputs(program_.outputs, calls);
        auto kept = program_.update;
        const bool integrates = !kept.empty() && kept.back().kind == program::Statement::Kind::integrate;
        if (integrates) kept.pop_back();
        calls.commit = update_body(kept);
        calls.update = calls.commit + (integrates ? indented(text_of(program_.update.back()), 4) : "");
        return;
    }
    for (const auto& task : program_.tasks) {
        time_ = time_of(task.rate);
        calls.outputs.clear();
        print_outputs(task.outputs, calls);
        calls.tasks.push_back({rate_name(task.rate), calls.outputs, update_body(task.update)});
    }
    time_ = time_inside();
}

std::string Generator::task_functions(const Calls& calls) {
    std::string text;
    for (std::size_t t = 0; t < calls.tasks.size(); ++t) {
        const auto& [name, outputs, update] = calls.tasks[t];
        const auto& task = program_.tasks[t];
        const auto writes = [&](const Field& output) {
            const auto its = [&](const program::Task& one) {
                return std::find(one.nodes.begin(), one.nodes.end(), output.end.node) != one.nodes.end();
            };
            // Constants belong to no rate.
            return its(task) || (t == 0 && std::none_of(program_.tasks.begin(), program_.tasks.end(), its));
        };
        const std::string steps = of_task("steps", task.rate);
        text += head_of("output_" + name) + " {\n" + unless_failed() + "    " + time_of(task.rate) + " = " +
                time_at(steps) + ";\n" + text_of(task.hits, program::first, 4);
        if (!outputs.empty()) text += indented(unless(called(outputs), "return false;\n"), 4);
        for (const auto& output : outputs_)
            if (writes(output)) text += indented(copy_of(output), 4);
        const auto ticks = diagram_.rates[static_cast<std::size_t>(task.rate)].ticks;
        text += "    return true;\n}\n\n" + head_of("update_" + name) + " {\n" + unless_failed() + update +
                "    " + steps + " += " + std::to_string(ticks) + ";\n    return true;\n}\n\n";
    }
    return text;
}

std::string Generator::task_calls(const Calls& calls, const std::string& half) {
    std::string text;
    for (std::size_t t = 0; t < calls.tasks.size(); ++t) {
        const int rate = program_.tasks[t].rate, hit = program_.hit[static_cast<std::size_t>(rate)];
        const std::string call = unless(call_of(half + "_" + calls.tasks[t].name), "return false;\n");
        if (half == "output")
            for (const auto& s : program_.step)
                if (s.kind == program::Statement::Kind::hit && s.flag == hit)
                    text += text_of(s, program::first);
        text += used_flags_.contains(hit) ? "if (" + flag(hit) + ") {\n" + indented(call, 4) + "}\n" : call;
    }
    return indented(text, 4);
}

} // namespace bf::codegen
