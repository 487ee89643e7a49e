// bf check: elaborates a model and prints what came out.
#include "session.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace bf::tools {

namespace {

struct CheckOptions {
    ModelOptions model;
    bool as_json = false;
};

std::string rate_text(const Diagram& d, int rate) {
    if (rate == constant_rate) return "constant";
    const auto& r = d.rates[static_cast<std::size_t>(rate)];
    std::string text = number(d.period(rate)) + " s";
    if (r.offset) text += " +" + number(static_cast<double>(r.offset) * d.step) + " s";
    return text;
}

/// A colour per rate, fastest first red, as far as terminals have colours.
const char* colour(int rate) {
    static const char* const colours[] = {"\033[35m", "\033[31m", "\033[32m", "\033[34m", "\033[36m", "\033[33m"};
    return isatty(STDOUT_FILENO) ? colours[rate % 6] : "";
}

void print(const Diagram& d) {
    std::printf("%s: %zu blocks, base period %s s, %zu conditional subsystems\n\n", d.name.c_str(), d.nodes.size(), number(d.step).c_str(), d.conditions.size() - 1);
    std::printf("rates\n");
    for (std::size_t r = 1; r < d.rates.size(); ++r)
        std::printf("  %s%s%s\n", colour(static_cast<int>(r)), rate_text(d, static_cast<int>(r)).c_str(), *colour(0) ? "\033[0m" : "");
    std::printf("\norder of outputs\n");
    int line = 0;
    for (const auto& segment : d.plan.outputs)
        for (const auto& activity : segment.activities) {
            if (activity.node < 0) {
                std::printf("%5d  if %s\n", ++line, d.conditions[static_cast<std::size_t>(activity.condition)].path.c_str());
                continue;
            }
            const auto& node = d.nodes[static_cast<std::size_t>(activity.node)];
            std::string outputs;
            for (const auto& slot : node.block->declaration().slots)
                if (slot.role == Role::output) outputs += " " + slot.name + ":" + slot.size.text() + (slot.type == Type::float64 ? "" : std::string(" ") + name(slot.type));
            std::printf("%5d  %s%-11s%s %-40s %-20s%s\n", ++line, colour(node.rate), rate_text(d, node.rate).c_str(), *colour(0) ? "\033[0m" : "", node.path.c_str(), node.type.c_str(), outputs.c_str());
        }
}

nlohmann::ordered_json to_json(const Diagram& d) {
    nlohmann::ordered_json json{{"model", d.name}, {"step", d.step}, {"blocks", nlohmann::ordered_json::array()}};
    for (const auto& node : d.nodes) {
        nlohmann::ordered_json block{{"path", node.path}, {"type", node.type}, {"period", d.period(node.rate)}, {"constant", node.rate == constant_rate}};
        for (const auto& slot : node.block->declaration().slots)
            block["quantities"].push_back({{"name", slot.name}, {"role", name(slot.role)}, {"type", name(slot.type)}, {"size", slot.size.text()}, {"unit", std::string(slot.unit.text)}});
        json["blocks"].push_back(std::move(block));
    }
    for (const auto& segment : d.plan.outputs)
        for (const auto& activity : segment.activities)
            if (activity.node >= 0) json["order"].push_back(d.nodes[static_cast<std::size_t>(activity.node)].path);
    return json;
}

} // namespace

void add_check(CLI::App& app) {
    auto* command = app.add_subcommand("check", "elaborate a model: all errors at once, or its sizes, types, rates and order");
    auto options = std::make_shared<CheckOptions>();
    options->model.add_to(*command);
    command->add_flag("--json", options->as_json, "print as JSON");
    command->footer("Example: bf check examples/icub_balancing/balancing.yaml");
    command->callback([options] {
        const LoadedModel loaded = load_model(options->model);
        if (options->as_json) std::printf("%s\n", to_json(loaded.diagram).dump(2).c_str());
        else print(loaded.diagram);
    });
}

} // namespace bf::tools
