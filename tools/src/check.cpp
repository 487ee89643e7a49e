// bf check: elaborates a model and prints what came out.
#include "bf/base/escape.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include "bf/program/program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace bf::tools {

namespace {

struct CheckOptions {
    ModelOptions model;
    bool as_json = false, as_program = false;
};

std::string rate_text(const Diagram& d, int rate) {
    if (rate < 0) return "unknown";
    if (rate == constant_rate) return "constant";
    const auto& r = d.rates[static_cast<std::size_t>(rate)];
    if (r.is_continuous) return "continuous";
    if (r.trigger > 0) return "by " + d.conditions[static_cast<std::size_t>(r.trigger)].path;
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
    for (const auto& slot : block.resolution().slots)
        if (slot.role == Role::output)
            text += (text.empty() ? "" : "  ") + slot.name + ":" + slot.size.text() +
                    (slot.type == Type::float64 ? "" : std::string(" ") + name(slot.type));
    return text;
}

/// A block of several rules is listed where one of them writes outputs.
bool is_listed(const Declaration& d, int activity) {
    if (activity >= static_cast<int>(d.output_rules.size())) return true;
    bool has_outputs = false;
    for (std::size_t s = 0; s < d.slots.size(); ++s) {
        if (d.slots[s].role != Role::output) continue;
        if (d.output_rules[static_cast<std::size_t>(activity)].writes(static_cast<int>(s))) return true;
        has_outputs = true;
    }
    return !has_outputs;
}

/// One line of the order: a block, or a test or loop, which has no type.
struct Row {
    int number = 0; ///< of the rate
    std::string rate, path, type, outputs;
};

bool is_shorter(const std::string& a, const std::string& b) { return a.size() < b.size(); }

void add_rows(const Diagram& d, const std::vector<Segment>& segments, const std::string& indent,
              std::vector<Row>& rows) {
    for (const auto& segment : segments)
        for (const auto& activity : segment.activities) {
            if (activity.node >= 0) {
                const auto& node = d.nodes[static_cast<std::size_t>(activity.node)];
                const bool is_last = !rows.empty() && rows.back().path == indent + node.path;
                if (is_last || !is_listed(node.block->declaration(), activity.index)) continue;
                rows.push_back({node.rate, rate_text(d, node.rate), indent + node.path, node.type,
                                outputs_text(*node.block)});
            } else if (activity.loop >= 0) {
                const auto& loop = d.plan.loops[static_cast<std::size_t>(activity.loop)];
                const bool is_algebraic = loop.kind == Loop::Kind::algebraic;
                rows.push_back({loop.rate, "",
                                indent + (is_algebraic ? "solve the loop through " : "repeat ") + loop.path,
                                "", ""});
                add_rows(d, loop.outputs, indent + "  ", rows);
            } else {
                const auto& condition = d.conditions[static_cast<std::size_t>(activity.condition)];
                rows.push_back(
                    {condition.rate, "",
                     indent + (condition.trigger.node >= 0
                                   ? "test whether " + condition.path + " is triggered"
                               : condition.enable.node >= 0 ? "test whether " + condition.path + " is enabled"
                                                            : "test whether " + condition.path + " is reset"),
                     "", ""});
            }
        }
}

std::string padded(const std::string& text, const std::string& longest) {
    return text + std::string(longest.size() - text.size() + 2, ' ');
}

std::string trimmed(std::string line) {
    line.erase(line.find_last_not_of(' ') + 1);
    return line;
}

std::string value_text(const matlab::Value& value) {
    const std::string text = value.to_text();
    return text.size() <= 40 ? text : value.size_text();
}

/// What --set and --params may change, with the values that they have now.
void print_variables(const Diagram& d) {
    std::string name, value, unit;
    std::vector<std::array<std::string, 4>> rows;
    for (const auto& variable : d.definitions) {
        if (variable.kind != Definition::Kind::variable) continue;
        const std::string limits = text_of(variable.limits), about = variable.about();
        rows.push_back({escape::terminal(variable.path), escape::terminal(value_text(variable.value)),
                        escape::terminal(variable.unit),
                        escape::terminal(about + (about.empty() || limits.empty() ? "" : "; ") + limits)});
        name = std::max(name, rows.back()[0], is_shorter);
        value = std::max(value, rows.back()[1], is_shorter);
        unit = std::max(unit, rows.back()[2], is_shorter);
    }
    if (rows.empty()) return;
    std::printf("\nvariables\n");
    for (const auto& row : rows)
        std::puts(trimmed("  " + padded(row[0], name) + padded(row[1], value) +
                          (unit.empty() ? "" : padded(row[2], unit)) + row[3])
                      .c_str());
}

void print(const Diagram& d) {
    const char* const plain = *colour(0) ? "\033[0m" : "";
    std::printf("%s: %zu blocks, base period %s s, ", escape::terminal(d.name).c_str(), d.nodes.size(),
                number(d.step).c_str());
    std::printf(std::isfinite(d.stop) ? "runs for %s s\n" : "no stop time\n", number(d.stop).c_str());
    std::printf("\nrates\n");
    for (int r = 1; r < static_cast<int>(d.rates.size()); ++r)
        std::printf("  %s%s%s\n", colour(r), escape::terminal(rate_text(d, r)).c_str(), plain);
    print_variables(d);

    std::vector<Row> rows;
    add_rows(d, d.plan.outputs, "", rows);
    Row width;
    for (const auto& row : rows) {
        if (row.type.empty()) continue;
        width.rate = std::max(width.rate, row.rate, is_shorter);
        width.path = std::max(width.path, row.path, is_shorter);
        width.type = std::max(width.type, row.type, is_shorter);
    }
    std::printf("\norder of outputs\n");
    int line = 0;
    for (const auto& row : rows) {
        const std::string columns = trimmed(
            row.type.empty() ? row.path
                             : padded(row.path, width.path) + padded(row.type, width.type) + row.outputs);
        const std::string rate = row.type.empty() ? "" : padded(row.rate, width.rate);
        std::printf("%5d  %s%s%s%s\n", ++line, colour(row.number), escape::terminal(rate).c_str(), plain,
                    escape::terminal(columns).c_str());
    }
}

using Json = nlohmann::ordered_json;

/// Of a wrong model: null where nothing is known.
Json to_json(const Diagram& d) {
    Json json{{"model", d.name},         {"step", d.step},
              {"stop", d.stop},          {"variables", Json::array()},
              {"blocks", Json::array()}, {"order", Json::array()}};
    for (const auto& variable : d.definitions)
        if (variable.kind == Definition::Kind::variable)
            json["variables"].push_back({{"name", variable.path},
                                         {"value", variable.value.to_text()},
                                         {"unit", variable.unit},
                                         {"doc", variable.doc},
                                         {"limits", text_of(variable.limits)}});
    for (const auto& node : d.nodes) {
        Json block{{"path", node.path},
                   {"type", node.type},
                   {"period", node.rate < 0 ? Json() : Json(d.period(node.rate))},
                   {"constant", node.rate == constant_rate},
                   {"quantities", Json::array()}};
        const auto& slots = node.block->resolution().slots;
        for (std::size_t s = 0; s < slots.size(); ++s) {
            Json quantity{{"name", slots[s].name},
                          {"role", name(slots[s].role)},
                          {"type", slots[s].type_known ? Json(name(slots[s].type)) : Json()},
                          {"size", slots[s].size_known ? Json(slots[s].size.text()) : Json()},
                          {"unit", std::string(slots[s].unit.text)}};
            if (const auto names = node.element_names.find(static_cast<int>(s));
                names != node.element_names.end())
                quantity["elements"] = names->second;
            block["quantities"].push_back(std::move(quantity));
        }
        json["blocks"].push_back(std::move(block));
    }
    std::vector<Row> rows;
    add_rows(d, d.plan.outputs, "", rows);
    for (const auto& row : rows)
        if (!row.type.empty()) json["order"].push_back(row.path.substr(row.path.find_first_not_of(' ')));
    return json;
}

Json to_json(const std::vector<model::Diagnostic>& diagnostics) {
    Json json = Json::array();
    for (const auto& d : diagnostics) {
        Json fixes = Json::array();
        for (const auto& [title, operation] : d.fixes)
            fixes.push_back({{"title", title}, {"operation", Json::parse(operation)}});
        json.push_back({{"file", d.where.file ? *d.where.file : ""},
                        {"line", d.where.line},
                        {"column", d.where.column},
                        {"path", d.path},
                        {"message", d.message},
                        {"remedy", d.remedy},
                        {"fixes", std::move(fixes)}});
    }
    return json;
}

void execute_json(const CheckOptions& options) {
    Json json;
    std::vector<model::Diagnostic> errors;
    try {
        const ExaminedModel found = examine_model(options.model);
        json = to_json(found.diagram);
        errors = found.diagnostics;
    } catch (const model::Errors& unreadable) {
        errors = unreadable.diagnostics();
    }
    if (!errors.empty()) json["errors"] = to_json(errors);
    std::fputs(to_text(json).c_str(), stdout);
    if (!errors.empty()) throw model::Errors(std::move(errors));
}

void execute(const CheckOptions& options) {
    if (options.as_json) return execute_json(options);
    const LoadedModel loaded = load_model(options.model);
    if (options.as_program)
        std::fputs(escape::terminal(program::text_of(program::lower(loaded.diagram))).c_str(), stdout);
    else
        print(loaded.diagram);
}

} // namespace

void add_check(CLI::App& app) {
    auto* command = app.add_subcommand(
        "check", "elaborate a model: all its errors, or its variables, sizes, types, rates and order");
    auto options = std::make_shared<CheckOptions>();
    options->model.add_to(*command);
    command->add_flag("--json", options->as_json,
                      "print as JSON; of a wrong model its errors, and what is known all the same");
    command->add_flag("--program", options->as_program, "print what a step does, statement by statement")
        ->excludes("--json");
    command->footer("Example: bf check examples/icub_balancing/balancing.yaml --set T_control=0.001");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
