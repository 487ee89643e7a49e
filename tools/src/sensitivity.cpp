// bf sensitivity: how near a model's checks are to their limits, and which parameters take them there.
#include "bf/analysis/sensitivity.hpp"

#include "bf/base/escape.hpp"
#include "files.hpp"
#include "linearize.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace {

using analysis::Sensitivities;

struct SensitivityArguments {
    ModelOptions model;
    analysis::SensitivityOptions options;
    std::string output;
    int rows = 10;
};

std::string line_of(const Sensitivities::Check& check) {
    std::string text = check.name + " = " + number(check.value);
    if (std::isfinite(check.lower)) text += ", at least " + number(check.lower);
    if (std::isfinite(check.upper)) text += ", at most " + number(check.upper);
    if (!std::isfinite(check.distance)) return text;
    const bool is_lower = check.value - check.lower < check.upper - check.value;
    const std::string limit = !std::isfinite(check.lower) || !std::isfinite(check.upper) ? "its limit"
                              : is_lower                                                 ? "its lower limit"
                                                                                         : "its upper limit";
    return text + (check.has_passed ? ": " + number(check.distance) + " from " + limit
                                    : ": beyond " + limit + " by " + number(-check.distance));
}

void print(const Sensitivities& found, int rows) {
    for (const auto& check : found.checks) {
        std::printf("%s\n", escape::terminal(line_of(check)).c_str());
        std::vector<Eigen::Index> order;
        for (Eigen::Index i = 0; i < found.at.size(); ++i)
            if (check.slopes[i] != 0 || check.distance_slopes[i] != 0) order.push_back(i);
        const bool has_limit = std::isfinite(check.distance);
        // Those whose least relative change matters come first.
        const auto weight = [&](Eigen::Index i) {
            const double slope = std::max(std::abs(check.slopes[i]), std::abs(check.distance_slopes[i]));
            return slope * (found.at[i] != 0 ? std::abs(found.at[i]) : 1);
        };
        std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return weight(a) > weight(b); });
        if (order.empty())
            std::printf("  nothing that was looked at changes it\n");
        else
            std::printf("  %-28s  %12s  %14s  %s\n", "by", "at", "slope",
                        has_limit ? "its limit is met at" : "");
        int shown = 0;
        for (const auto i : order) {
            if (shown++ == rows) {
                std::printf("  and %zu more; -o FILE writes all\n",
                            order.size() - static_cast<std::size_t>(rows));
                break;
            }
            const double there = found.at[i] + check.change_to_limit(i);
            const bool is_allowed = there >= found.least[i] && there <= found.most[i];
            std::printf("  %-28s  %12s  %14s  %s\n",
                        escape::terminal(found.names[static_cast<std::size_t>(i)]).c_str(),
                        number(found.at[i]).c_str(), number(check.slopes[i]).c_str(),
                        std::isfinite(there)
                            ? (number(there) + (is_allowed ? "" : ", beyond its own limits")).c_str()
                        : has_limit ? "-"
                                    : "");
        }
        if (!check.differenced.empty())
            std::printf("  by differences: %s\n", escape::terminal(check.differenced).c_str());
        if (check.has_corner)
            std::printf("  a jump or corner was met on the way, here or elsewhere in the model: slopes are "
                        "those of one side\n");
    }
}

nlohmann::ordered_json numbers(const analysis::Vector& all) {
    return std::vector<double>(all.data(), all.data() + all.size());
}

nlohmann::ordered_json to_json(const Sensitivities& found) {
    nlohmann::ordered_json checks = nlohmann::ordered_json::array();
    for (const auto& check : found.checks) {
        std::vector<double> changes;
        for (Eigen::Index i = 0; i < found.at.size(); ++i) changes.push_back(check.change_to_limit(i));
        checks.push_back({{"name", check.name},
                          {"value", check.value},
                          {"at_least", check.lower},
                          {"at_most", check.upper},
                          {"passed", check.has_passed},
                          {"distance", check.distance},
                          {"slopes", numbers(check.slopes)},
                          {"distance_slopes", numbers(check.distance_slopes)},
                          {"changes_to_limit", changes},
                          {"differenced", check.differenced},
                          {"has_corner", check.has_corner}});
    }
    return {{"names", found.names},
            {"at", numbers(found.at)},
            {"least", numbers(found.least)},
            {"most", numbers(found.most)},
            {"checks", checks}};
}

void execute(const SensitivityArguments& arguments) {
    const auto& output = arguments.output;
    if (!output.empty()) {
        if (!is_data(output) || std::filesystem::path(output).extension() == ".mat")
            refuse_format(output, ".yaml or .json");
        refuse_overwriting({{"-o", output}}, files_of(arguments.model.file));
    }
    const LoadedModel loaded = load_model(arguments.model);
    const auto found = [&] {
        const Waiting waiting("running " + arguments.model.file);
        return analysis::sensitivities(loaded.diagram, arguments.options);
    }();
    print(found, arguments.rows);
    if (!output.empty()) write_data(to_json(found), {}, output);
}

} // namespace

void add_sensitivity(CLI::App& app) {
    auto* command = app.add_subcommand(
        "sensitivity", "how near a model's checks are to their limits, and which parameters take them there");
    auto arguments = std::make_shared<SensitivityArguments>();
    auto& options = arguments->options;
    arguments->model.add_to(*command);
    command
        ->add_option(
            "--by", options.by,
            "a parameter, block.parameter, or a variable, or one element of it, K[2]; may be repeated; "
            "otherwise all variables that a run can change, or all parameters of a model without any")
        ->type_name("NAME")
        ->allow_extra_args(false);
    command
        ->add_option("--check", options.checks,
                     "a block Check; may be repeated; otherwise all that report a number")
        ->type_name("BLOCK")
        ->allow_extra_args(false);
    command->add_option("--duration", options.duration, "of the run; otherwise until the model's stop")
        ->check(between(1e-12, 1e9))
        ->type_name("SECONDS");
    command
        ->add_option("--difference", options.step,
                     "relative step of differences, where there is no exact derivative")
        ->check(between(1e-9, 0.1))
        ->type_name("SHARE")
        ->capture_default_str();
    command->add_option("--rows", arguments->rows, "of parameters that are printed for each check")
        ->check(between(1, 1e6))
        ->type_name("N")
        ->capture_default_str();
    command->add_option("-o,--output", arguments->output, "write all: YAML or JSON file")->type_name("FILE");
    command->footer("Example: bf sensitivity docs/start/motor.yaml --check top_speed");
    command->callback([arguments] { execute(*arguments); });
}

} // namespace bf::tools
