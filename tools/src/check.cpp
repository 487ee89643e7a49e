// bf check: elaborates a model and prints what came out.
#include "session.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
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
    if (d.rates[static_cast<std::size_t>(rate)].is_continuous) return "continuous";
    const auto& r = d.rates[static_cast<std::size_t>(rate)];
    std::string text = number(d.period(rate)) + " s";
    if (r.offset) text += " +" + number(static_cast<double>(r.offset) * d.step) + " s";
    return text;
}

/// A colour per rate, fastest first red, as far as terminals have colours.
const char* colour(int rate) {
    static const char* const colours[] = {"\033[35m", "\033[31m", "\033[32m",
                                          "\033[34m", "\033[36m", "\033[33m"};
    return isatty(STDOUT_FILENO) ? colours[rate % 6] : "";
}

std::string outputs_text(const Block& block) {
    std::string text;
    for (const auto& slot : block.declaration().slots)
        if (slot.role == Role::output)
            text += (text.empty() ? "" : "  ") + slot.name + ":" + slot.size.text() +
                    (slot.type == Type::float64 ? "" : std::string(" ") + name(slot.type));
    return text;
}

void print(const Diagram& d) {
    const char* const plain = *colour(0) ? "\033[0m" : "";
    std::printf("%s: %zu blocks, base period %s s, ", d.name.c_str(), d.nodes.size(), number(d.step).c_str());
    std::printf(std::isfinite(d.stop) ? "runs for %s s\n" : "no stop time\n", number(d.stop).c_str());
    std::printf("\nrates\n");
    for (int r = 1; r < static_cast<int>(d.rates.size()); ++r)
        std::printf("  %s%s%s\n", colour(r), rate_text(d, r).c_str(), plain);

    std::size_t rate_width = 0, path_width = 0, type_width = 0;
    for (const auto& segment : d.plan.outputs)
        for (const auto& activity : segment.activities) {
            if (activity.node < 0) continue;
            const auto& node = d.nodes[static_cast<std::size_t>(activity.node)];
            rate_width = std::max(rate_width, rate_text(d, node.rate).size());
            path_width = std::max(path_width, node.path.size());
            type_width = std::max(type_width, node.type.size());
        }
    std::printf("\norder of outputs\n");
    int line = 0;
    for (const auto& segment : d.plan.outputs)
        for (const auto& activity : segment.activities) {
            if (activity.node < 0) {
                const auto& condition = d.conditions[static_cast<std::size_t>(activity.condition)];
                std::printf("%5d  test whether %s is enabled\n", ++line, condition.path.c_str());
                continue;
            }
            const auto& node = d.nodes[static_cast<std::size_t>(activity.node)];
            const auto pad = [](const std::string& text, std::size_t width) {
                return text + std::string(width - text.size() + 2, ' ');
            };
            std::string columns =
                pad(node.path, path_width) + pad(node.type, type_width) + outputs_text(*node.block);
            columns.erase(columns.find_last_not_of(' ') + 1);
            std::printf("%5d  %s%s%s%s\n", ++line, colour(node.rate),
                        pad(rate_text(d, node.rate), rate_width).c_str(), plain, columns.c_str());
        }
}

nlohmann::ordered_json to_json(const Diagram& d) {
    using Json = nlohmann::ordered_json;
    Json json{{"model", d.name},
              {"step", d.step},
              {"stop", d.stop},
              {"blocks", Json::array()},
              {"order", Json::array()}};
    for (const auto& node : d.nodes) {
        Json block{{"path", node.path},
                   {"type", node.type},
                   {"period", d.period(node.rate)},
                   {"constant", node.rate == constant_rate},
                   {"quantities", Json::array()}};
        for (const auto& slot : node.block->declaration().slots)
            block["quantities"].push_back({{"name", slot.name},
                                           {"role", name(slot.role)},
                                           {"type", name(slot.type)},
                                           {"size", slot.size.text()},
                                           {"unit", std::string(slot.unit.text)}});
        json["blocks"].push_back(std::move(block));
    }
    for (const auto& segment : d.plan.outputs)
        for (const auto& activity : segment.activities)
            if (activity.node >= 0)
                json["order"].push_back(d.nodes[static_cast<std::size_t>(activity.node)].path);
    return json;
}

nlohmann::ordered_json to_json(const model::Errors& errors) {
    nlohmann::ordered_json json{{"errors", nlohmann::ordered_json::array()}};
    for (const auto& e : errors.diagnostics())
        json["errors"].push_back({{"file", e.where.file ? *e.where.file : ""},
                                  {"line", e.where.line},
                                  {"column", e.where.column},
                                  {"path", e.path},
                                  {"message", e.message},
                                  {"remedy", e.remedy}});
    return json;
}

void execute(const CheckOptions& options) {
    try {
        const LoadedModel loaded = load_model(options.model);
        if (options.as_json)
            std::fputs(to_text(to_json(loaded.diagram)).c_str(), stdout);
        else
            print(loaded.diagram);
    } catch (const model::Errors& errors) {
        if (options.as_json) std::fputs(to_text(to_json(errors)).c_str(), stdout);
        throw;
    }
}

} // namespace

void add_check(CLI::App& app) {
    auto* command = app.add_subcommand(
        "check", "elaborate a model: all its errors, or its sizes, types, rates and order");
    auto options = std::make_shared<CheckOptions>();
    options->model.add_to(*command);
    command->add_flag("--json", options->as_json, "print as JSON, errors too");
    command->footer("Example: bf check examples/icub_balancing/balancing.yaml --set T_control=0.001");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
