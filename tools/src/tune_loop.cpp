#include "tune_loop.hpp"

#include "bf/analysis/loop_gain.hpp"
#include "bf/analysis/tune_loop.hpp"
#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "bf/elaborate/tuning.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "figure.hpp"
#include "files.hpp"
#include "terminal.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace bf::tools {

namespace {

using analysis::SimulatedStep;
using analysis::TunedLoop;
using recording::Curve;
using recording::Figure;

std::string cell(double value) { return std::isfinite(value) ? number(value) : "none"; }

void row(const std::string& name, const std::string& before, const std::string& after) {
    std::printf("%-24s  %-14s  %s\n", escape::terminal(name).c_str(), before.c_str(), after.c_str());
}

/// What a simulated step comes to, beside where the linear one ends; NaN: it comes to nothing.
StepMeasures measures(const SimulatedStep& step, const TunedLoop::State& state) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    StepMeasures nothing{.overshoot = none, .settling_time = none};
    if (step.time.empty() || !std::isfinite(state.step.final)) return nothing;
    return measure_step(step.time, step.value, state.step.final, state.loop.period > 0);
}

void print(const TunedLoop& tuned, const StepMeasures& before, const StepMeasures& after) {
    row("", "before", "after");
    for (const auto& gain : tuned.gains) row(gain.name, cell(gain.before), cell(gain.after));
    const auto both = [&](const char* name, auto&& value) {
        row(name, cell(value(tuned.before)), cell(value(tuned.after)));
    };
    using State = TunedLoop::State;
    row("closed loop", tuned.before.margins.is_stable ? "stable" : "unstable",
        tuned.after.margins.is_stable ? "stable" : "unstable");
    both("crossover rad/s",
         [](const State& s) { return s.margins.gain_crossover > 0 ? s.margins.gain_crossover : NAN; });
    both("phase margin degrees", [](const State& s) { return s.margins.phase; });
    both("gain margin dB", [](const State& s) { return 20 * std::log10(s.margins.gain); });
    both("  of less gain", [](const State& s) { return -20 * std::log10(s.margins.gain_reduction); });
    both("delay margin s", [](const State& s) { return s.margins.delay; });
    both("modulus margin", [](const State& s) { return s.margins.modulus; });
    both("bandwidth rad/s", [](const State& s) { return s.margins.bandwidth; });
    both("overshoot %", [](const State& s) { return s.margins.is_stable ? s.step.overshoot : NAN; });
    row("  simulated", cell(before.overshoot), cell(after.overshoot));
    both("settling time s", [](const State& s) { return s.margins.is_stable ? s.step.settling_time : NAN; });
    row("  simulated", cell(before.settling_time), cell(after.settling_time));
}

Figure figure_of(const TunedLoop& tuned, const SimulatedStep& before, const SimulatedStep& after,
                 const std::string& loop) {
    Figure figure{"Loop through " + loop, {{"Step of the closed loop", "", {}}}};
    auto& curves = figure.panels[0].curves;
    for (const auto& [name, step] : {std::pair("after", &after), std::pair("before", &before)})
        if (!step->time.empty()) curves.push_back({name, step->time, step->value});
    const auto& linear = tuned.after.step;
    const double end = after.time.empty() ? INFINITY : after.time.back();
    curves.push_back({"after, linearised", {}, {}, true, tuned.after.loop.period > 0});
    for (std::size_t i = 0; i < linear.time.size() && linear.time[i] <= end; ++i) {
        curves.back().time.push_back(linear.time[i]);
        curves.back().value.push_back(linear.value[i]);
    }
    return figure;
}

/// Where a file of both pictures goes: "a.png" -> "a_bode.png".
std::filesystem::path beside(const std::filesystem::path& file, const char* what) {
    return file.parent_path() / (file.stem().string() + what + file.extension().string());
}

Figure bode_of(const TunedLoop& tuned, const std::string& loop) {
    Figure figure{"Loop through " + loop,
                  {{"Magnitude", "dB", {}}, {"Phase", "degrees", {}}},
                  "frequency (rad/s)",
                  true};
    const auto& after = tuned.after.loop;
    const auto omega = analysis::frequencies(after, 0, 0, 600, true);
    for (const auto& [name, system] : {std::pair("after", &after), std::pair("before", &tuned.before.loop)}) {
        if (analysis::is_nothing(*system)) continue;
        const auto r = analysis::response(*system, 0, 0, omega);
        figure.panels[0].curves.push_back({name, r.omega, r.magnitude});
        figure.panels[1].curves.push_back({name, r.omega, r.phase});
    }
    const auto mark = [&](std::size_t panel, const char* name, double w, double y) {
        figure.panels[panel].curves.push_back({name, {w}, {y}, false, false, Curve::Mark::circle});
    };
    mark(0, "crossover", tuned.after.margins.gain_crossover, 0);
    return figure;
}

/// A parameter or variable with its present value, as an expression.
struct Setting {
    std::string name, value;
};
std::vector<Setting> settings_of(const Simulation& run, const TunedLoop& tuned) {
    std::vector<Setting> all;
    const auto parameters = run.parameters();
    const auto values = run.variables();
    const auto variables = Tuning(run.diagram()).variables();
    const auto of_path = [](const auto& list, const std::string& path) {
        return std::find_if(list.begin(), list.end(), [&](const auto& one) { return one.path == path; });
    };
    // What was not tuned keeps all of its digits.
    const auto element_text = [&](double value) {
        const bool is_tuned = std::any_of(tuned.gains.begin(), tuned.gains.end(),
                                          [&](const auto& gain) { return gain.after == value; });
        return is_tuned ? number(value) : number_text(value);
    };
    const auto matrix_text = [&](int rows, int cols, const auto& element) {
        if (rows * cols == 1) return element_text(element(0));
        std::string text = "[";
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < cols; ++j)
                text += (j > 0 ? " " : i > 0 ? "; " : "") + element_text(element(j * rows + i));
        return text + "]";
    };
    for (const auto& gain : tuned.gains) {
        const std::string whole = gain.name.substr(0, gain.name.find('['));
        if (whole == gain.name) {
            all.push_back({gain.name, number(gain.after)});
            continue;
        }
        if (std::any_of(all.begin(), all.end(), [&](const Setting& one) { return one.name == whole; }))
            continue;
        if (const auto parameter = of_path(parameters, whole); parameter != parameters.end()) {
            const auto& its = *parameter;
            all.push_back(
                {whole, matrix_text(static_cast<int>(its.info.rows), static_cast<int>(its.info.cols),
                                    [&](int e) { return its[e]; })});
        } else {
            const auto& shape = *of_path(variables, whole);
            const auto& its = of_path(values, whole)->values;
            all.push_back({whole, matrix_text(shape.rows, shape.cols,
                                              [&](int e) { return its[static_cast<std::size_t>(e)]; })});
        }
    }
    return all;
}

/// For --params: "controller.pid: {P: 1, I: 2}", "Kp: 3".
std::string overrides_text(const std::vector<Setting>& settings) {
    std::vector<std::pair<std::string, std::string>> lines;
    for (const auto& setting : settings) {
        const auto [block, name] = model::split_last(setting.name);
        const std::string quoted = setting.value.front() == '[' ? "\"" + setting.value + "\"" : setting.value;
        if (block.empty())
            lines.emplace_back("", name + ": " + quoted);
        else if (!lines.empty() && lines.back().first == block)
            lines.back().second += ", " + name + ": " + quoted;
        else
            lines.emplace_back(block, name + ": " + quoted);
    }
    std::string text;
    for (const auto& [block, line] : lines)
        text += block.empty() ? line + "\n" : block + ": {" + line + "}\n";
    return text;
}

/// A parameter that was given as an expression no longer follows the variables in it: `run` has the model's.
void tell_of_variables(const Simulation& run, const std::vector<Setting>& settings) {
    for (const auto& variable : run.variables()) try {
            for (const auto& follower : run.follow({variable}))
                for (const auto& setting : settings)
                    if (follower.path == setting.name)
                        std::fprintf(stderr, "%s no longer follows %s; --by %s tunes the variable\n",
                                     escape::terminal(setting.name).c_str(),
                                     escape::terminal(variable.path).c_str(),
                                     escape::terminal(variable.path).c_str());
        } catch (const std::runtime_error&) { // one that a run cannot change
        }
}

/// The model's file with these values, by the operations of the editor: all else keeps its bytes.
std::string edited_text(const std::string& file, const std::vector<Setting>& settings) {
    auto model = formats::read_yaml(file);
    for (const auto& [name, value] : settings) {
        bool is_found = false;
        // A parameter of a block, or what is given to another file's model, or a variable of a system:
        // "controller.Gain.Kp".
        for (std::size_t end = name.size(); !is_found && end != std::string::npos;) {
            const auto dot = end == 0 ? std::string::npos : name.rfind('.', end - 1);
            const std::string owner = dot == std::string::npos ? "" : name.substr(0, dot);
            const std::string rest = dot == std::string::npos ? name : name.substr(dot + 1);
            const auto* block = owner.empty() ? nullptr : model::find(model, owner);
            const auto* its = model::find_system(model, owner);
            if (block && (block->is_library_block() || block->reference)) {
                model::edit(model, model::operations::Set{owner, rest, value});
                is_found = true;
            } else if (const auto* variable = its ? model::find_variable(its->variables, rest) : nullptr) {
                model::Variable changed = *variable;
                changed.value.text = value;
                changed.value.spelling.clear();
                model::edit(model, model::operations::SetVariable{owner, rest, std::move(changed)});
                is_found = true;
            }
            end = dot;
        }
        if (!is_found)
            throw CommandError("'" + name + "' does not stand in " + file +
                               " itself; -o FILE writes the gains for --params");
    }
    return formats::write_yaml(model);
}

} // namespace

void LoopTuning::add_to(CLI::App& app, const char* what_model) {
    model.add_to(app, what_model);
    app.add_option(
           "--loop", loop,
           "tune the loop through this signal, cut there: its gain as of negative feedback, 1 + L = 0")
        ->type_name("SIGNAL");
    auto* loop_option = app.get_option("--loop");
    const auto of_loop = [&](CLI::Option* option) { return option->needs(loop_option); };
    of_loop(app.add_option(
                "--by", by,
                "with --loop: a block with P and I, a parameter, block.parameter, or a variable; may be "
                "repeated"))
        ->type_name("NAME")
        ->allow_extra_args(false);
    auto* cross = of_loop(app.add_option("--crossover", crossover, "where the loop's gain is to be 1, rad/s"))
                      ->check(between(1e-9, 1e9))
                      ->type_name("W");
    of_loop(app.add_option("--bandwidth", bandwidth, "of the closed loop, L/(1 + L), rad/s"))
        ->check(between(1e-9, 1e9))
        ->type_name("W")
        ->excludes(cross);
    of_loop(app.add_option("--phase-margin", phase_margin, "degrees, 60 where no overshoot is asked for"))
        ->check(between(1, 179))
        ->type_name("DEGREES");
    of_loop(app.add_option("--gain-margin", gain_margin, "at least, dB"))
        ->check(between(0, 200))
        ->type_name("DB");
    of_loop(
        app.add_option("--open", open,
                       "a further signal that is cut, such as one of a slower loop around this one; may be "
                       "repeated"))
        ->type_name("SIGNAL")
        ->allow_extra_args(false);
    app.add_option(
           "--overshoot", overshoot,
           "of the closed loop's step, at most; of joints the damping ratio is that of this overshoot, %")
        ->check(between(1e-3, 50.0))
        ->type_name("PERCENT");
    app.add_option("--step", step,
                   "height of the simulated step: 1 % of the signal and at least 0.01; of joints' references "
                   "0.05 rad")
        ->type_name("HEIGHT");
    add_operating_point_to(app);
    for (const char* of_operating_point : {"--at", "--from-snapshot"})
        of_loop(app.get_option(of_operating_point));
    app.add_option("-o,--output", output,
                   "write the gains: a YAML file for --params; of the robots of a World a copy of its file")
        ->type_name("FILE");
    of_loop(app.add_flag("--edit", edits_model,
                         "write the gains into the model's own file, which else keeps its bytes"));
    app.add_option("--picture", picture,
                   "draw the step responses before and after, of a loop also the Bode diagram, FILE_bode: "
                   "PNG or SVG file")
        ->type_name("FILE");
}

void LoopTuning::execute() const {
    namespace fs = std::filesystem;
    if (step && (*step == 0 || !std::isfinite(*step)))
        throw CommandError("--step " + number(*step) + " is no height of a step; give one that is not 0");
    if (by.empty())
        throw CommandError("name the gains by --by: a block with P and I, a parameter or a variable");
    if (!output.empty() && fs::path(output).extension() != ".yaml")
        throw CommandError("-o " + output + ": the name of this file ends in .yaml");
    require_figure("--picture", picture);
    if (edits_model)
        for (const auto& change : model.overrides())
            if (std::none_of(by.begin(), by.end(), [&](const auto& gain) {
                    return change.name == gain || change.name.starts_with(gain + ".");
                }))
                throw CommandError("--edit would write gains into the file that are right with another '" +
                                   change.name + "'; change that in the file first, or use -o");
    const fs::path second = picture.empty() ? fs::path() : beside(picture, "_bode");
    const LoadedModel loaded = load_model(model);
    refuse_overwriting({{"-o", output}, {"--picture", picture}, {"--picture", second}}, files_of(loaded));

    Simulation run(loaded.diagram), old(loaded.diagram);
    TunedLoop tuned;
    SimulatedStep before, after;
    std::string ends; // of runs, before their time
    {
        const Waiting waiting("tuning the loop through " + loop);
        go_to_operating_point(run);
        tuned = analysis::tune_loop(run, {.loop = loop,
                                          .by = by,
                                          .crossover = crossover,
                                          .bandwidth = bandwidth,
                                          .phase_margin = phase_margin,
                                          .overshoot = overshoot,
                                          .gain_margin = gain_margin,
                                          .open = open});
        // The linear response lasts eight times its slowest time constant.
        constexpr double most_steps = 1e6;
        const auto lasts = [&](const auto& state) {
            return std::min(state.step.time.empty() ? 0 : state.step.time.back(), most_steps * run.period());
        };
        const double duration =
            std::max(lasts(tuned.after), tuned.before.margins.is_stable ? lasts(tuned.before) : 0);
        const auto simulate = [&](Simulation& of, const char* which) {
            try {
                return analysis::simulated_step(of, loop, duration, step.value_or(0), open);
            } catch (const RunError& error) { // an unstable loop may come to an end
                ends += std::string(which) + ": " + error.what() + "\n";
                return SimulatedStep{};
            }
        };
        after = simulate(run, "after");
        go_to_operating_point(old);
        before = simulate(old, "before");
    }
    const auto after_measures = measures(after, tuned.after);
    tell_how_exact(tuned.after.loop);
    print(tuned, measures(before, tuned.before), after_measures);
    std::fputs(escape::terminal(ends).c_str(), stderr);
    if (overshoot && after_measures.overshoot > *overshoot + 0.5)
        std::printf(
            "a step of %s goes further beyond its end than the linearised loop: limits are met, or the step "
            "leaves what is linear; try a smaller --step\n",
            number(after.height).c_str());
    const auto settings = settings_of(run, tuned);
    tell_of_variables(old, settings);
    if (output.empty() && !edits_model) std::printf("\n%s", overrides_text(settings).c_str());
    if (!output.empty()) {
        OutputFile file(output);
        file.write(overrides_text(settings));
        file.commit();
        std::printf("%s\n", output.c_str());
    }
    if (edits_model) {
        const std::string text = edited_text(model.file, settings);
        OutputFile file(model.file);
        file.write(text);
        file.commit();
        std::printf("%s\n", model.file.c_str());
    }
    if (picture.empty()) return;
    write_figure(figure_of(tuned, before, after, loop), picture, 900);
    write_figure(bode_of(tuned, loop), second, 900);
}

} // namespace bf::tools
