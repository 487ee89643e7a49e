// bf tune: gains of the position loops of a robot, by simulated step responses, and of any loop.
#include "bf/tuning/tune.hpp"
#include "bf/base/escape.hpp"
#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "bf/toolbox/simulated_robot.hpp"
#include "figure.hpp"
#include "files.hpp"
#include "terminal.hpp"
#include "tune_loop.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct TuneOptions : LoopTuning { ///< its model's file may be a World's
    std::string robot;
    std::vector<std::string> frequencies;
    std::vector<double> pose;
    double damping = 1;
    tuning::Options tuning;
};

/// A robot that may be tuned, and where its gains are written.
struct Candidate {
    std::string name; ///< of a robot in a World, or the path of a MujocoWorld
    std::function<std::unique_ptr<tuning::Bench>(const std::vector<double>& pose)> make;
    fs::path world; ///< the World's file; empty: the gains are an argument of the block `name`
};

void add_robots(const std::shared_ptr<const physics::Scene>& scene, const fs::path& file,
                std::vector<Candidate>& all) {
    for (int i = 0; i < scene->robot_count(); ++i)
        all.push_back({scene->options().robots[static_cast<std::size_t>(i)].name,
                       [scene, i](const auto& pose) { return tuning::bench_of(*scene, i, pose); }, file});
}

std::vector<Candidate> candidates_of(const Diagram& diagram) {
    std::vector<Candidate> all;
    for (const auto& node : diagram.nodes) {
        const Resolution& resolution = node.block->resolution();
        const auto* device = static_cast<const toolbox::RobotDevice*>(
            resolution.find_provided(toolbox::RobotDevice::resource));
        if (const auto* simulated = dynamic_cast<const toolbox::SimulatedDevice*>(device))
            all.push_back({node.path,
                           [simulated, period = diagram.period(node.rate)](const auto& pose) {
                               return tuning::bench_of(simulated->world(), period, pose);
                           },
                           {}});
        if (const auto* shared = static_cast<const toolbox::SharedWorld*>(
                resolution.find_provided(toolbox::SharedWorld::resource)))
            add_robots(shared->scene, shared->file, all);
    }
    return all;
}

const Candidate& chosen(const std::vector<Candidate>& all, const TuneOptions& options) {
    std::vector<std::string> names;
    for (const auto& candidate : all) names.push_back(candidate.name);
    if (all.empty())
        throw CommandError(options.model.file +
                           " has no robot of a MujocoWorld or World whose joints could be tuned; name a loop "
                           "of the model by --loop SIGNAL, and its gains by --by NAME");
    if (options.robot.empty() && all.size() == 1) return all.front();
    const auto found = std::ranges::find(all, options.robot, &Candidate::name);
    if (found != all.end()) return *found;
    throw CommandError((options.robot.empty() ? "there are several robots; name one by --robot"
                                              : "there is no robot '" + options.robot + "'" +
                                                    did_you_mean(options.robot, names)) +
                       ": " + name_list(names));
}

/// 20, or l_knee=15 and so on; the last one of a joint counts.
std::vector<tuning::Goal> goals_of(const TuneOptions& options, const std::vector<std::string>& joints) {
    tuning::Goal all;
    all.damping = options.overshoot ? tuning::damping_of(*options.overshoot / 100) : options.damping;
    std::vector<tuning::Goal> goals(joints.size(), all);
    for (const auto& text : options.frequencies) {
        const auto equals = text.find('=');
        const auto frequency = number_of(equals == text.npos ? text : text.substr(equals + 1));
        if (!frequency || !(*frequency >= tuning::least_frequency) || !std::isfinite(*frequency))
            throw CommandError("--frequency " + text + " is no NUMBER and no JOINT=NUMBER of " +
                               number(tuning::least_frequency) + " rad/s or more");
        if (equals == text.npos) {
            for (auto& goal : goals) goal.frequency = *frequency;
            continue;
        }
        const auto joint = std::ranges::find(joints, text.substr(0, equals));
        if (joint == joints.end())
            throw CommandError("--frequency " + text + ": there is no such joint" +
                               did_you_mean(text.substr(0, equals), joints) + ": " + name_list(joints));
        goals[static_cast<std::size_t>(joint - joints.begin())].frequency = *frequency;
    }
    return goals;
}

std::string cell(double value, const char* format) {
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return std::isnan(value) ? "-" : text;
}

void print(const std::vector<tuning::TunedJoint>& joints) {
    std::size_t width = 5;
    for (const auto& joint : joints) width = std::max(width, joint.name.size());
    const auto row = [&](const std::string& name, const std::vector<std::string>& cells) {
        std::printf("%-*s", static_cast<int>(width), escape::terminal(name).c_str());
        for (std::size_t i = 0; i < cells.size(); ++i)
            std::printf(i == 0 ? "  %-6s" : "  %9s", cells[i].c_str());
        std::printf("\n");
    };
    row("joint", {"", "P", "I", "D", "rise s", "over %", "settles s", "error rad", "torque Nm"});
    for (const auto& joint : joints) {
        const auto line = [&](const char* when, const tuning::JointGains& gains, const tuning::Measures& m) {
            row(std::string_view(when) == "before" ? joint.name : "",
                {when, cell(gains.P, "%.4g"), cell(gains.I, "%.4g"), cell(gains.D, "%.4g"),
                 cell(m.rise_time, "%.4f"), cell(100 * m.overshoot, "%.1f"), cell(m.settling_time, "%.3f"),
                 cell(m.error, "%.2g"), cell(m.torque, "%.4g")});
        };
        line("before", joint.before, joint.measures_before);
        line("after", joint.after, joint.measures_after);
        if (!joint.remark.empty()) row("", {joint.remark});
    }
}

std::string rows_of(const std::vector<tuning::TunedJoint>& joints, const char* between) {
    std::string text;
    for (const auto& joint : joints) {
        if (!text.empty()) text += between;
        text += number(joint.after.P) + " " + number(joint.after.I) + " " + number(joint.after.D);
    }
    return text;
}

/// The text of a World's file with other position_gains of a robot.
std::string with_gains(std::string text, const std::string& robot, const std::string& gains) {
    const auto value_of = [](const std::string& tag,
                             const std::string& name) -> std::pair<std::size_t, std::size_t> {
        for (std::size_t at = tag.find(name); at != tag.npos; at = tag.find(name, at + 1)) {
            const std::size_t equals = tag.find_first_not_of(" \t\r\n", at + name.size());
            if (std::isspace(static_cast<unsigned char>(tag[at - 1])) == 0 || equals == tag.npos ||
                tag[equals] != '=')
                continue;
            const std::size_t quote = tag.find_first_of("\"'", equals);
            return {quote + 1, tag.find(tag[quote], quote + 1)};
        }
        return {0, 0};
    };
    const auto is_in_comment = [&](std::size_t at) {
        const std::size_t begin = text.rfind("<!--", at);
        return begin != text.npos && text.find("-->", begin) > at;
    };
    for (std::size_t at = text.find("<robot"); at != text.npos; at = text.find("<robot", at + 1)) {
        if (is_in_comment(at)) continue;
        std::size_t end = at;
        for (char quote = 0; end < text.size() && (quote != 0 || text[end] != '>'); ++end)
            if (text[end] == '"' || text[end] == '\'')
                quote = quote == 0 ? text[end] : quote == text[end] ? '\0' : quote;
        const std::string tag = text.substr(at, end - at);
        const auto [name, name_end] = value_of(tag, "name");
        if (tag.substr(name, name_end - name) != robot) continue;
        const auto [old, old_end] = value_of(tag, "position_gains");
        if (old > 0) return text.replace(at + old, old_end - old, gains);
        return text.insert(tag.ends_with('/') ? end - 1 : end, " position_gains=\"" + gains + "\"");
    }
    throw CommandError("the World's file has no robot '" + robot + "' any more");
}

recording::Figure figure_of(const std::vector<tuning::TunedJoint>& joints) {
    recording::Figure figure{.title = "Steps of the references, one joint after the other", .panels = {}};
    for (const auto& joint : joints) {
        recording::Panel& panel = figure.panels.emplace_back();
        panel.title = joint.name;
        panel.y_label = "rad";
        const auto add = [&](const char* name, const tuning::Response& response) {
            panel.curves.push_back({.name = name, .time = response.time, .value = response.position});
        };
        add("after", joint.response_after);
        add("before", joint.response_before);
        recording::Curve goal{
            .name = "goal", .time = joint.response_after.time, .value = {}, .reference = true};
        for (const double t : goal.time)
            goal.value.push_back(joint.response_after.step * tuning::ideal_response(joint.goal, t));
        panel.curves.push_back(std::move(goal));
    }
    return figure;
}

void execute(const TuneOptions& options) {
    std::vector<Candidate> all;
    std::optional<LoadedModel> loaded;
    FileSet read{options.model.file};
    if (fs::path(options.model.file).extension() == ".xml") {
        if (!options.model.sets.empty() || !options.model.params.empty())
            throw CommandError("--set and --params change what a model says, but " + options.model.file +
                               " is the file of a World; give the model instead, or change the file");
        const fs::path models(BF_ROBOT_MODELS);
        auto scene = physics::SceneOptions::read(options.model.file, {models, models / "iCub"});
        add_robots(std::make_shared<const physics::Scene>(std::move(scene)), options.model.file, all);
    } else {
        loaded = load_model(options.model);
        read = files_of(*loaded);
        all = candidates_of(loaded->diagram);
    }
    const Candidate& robot = chosen(all, options);
    const std::string ending = robot.world.empty() ? ".yaml" : ".xml";
    if (!options.output.empty() && fs::path(options.output).extension() != ending)
        throw CommandError("-o " + options.output + ": the name of this file ends in " + ending);
    require_figure("--picture", options.picture);
    read.insert(robot.world);
    refuse_overwriting({{"-o", options.output}, {"--picture", options.picture}}, read);

    const auto bench = robot.make(options.pose);
    tuning::Options asked = options.tuning;
    if (options.step && !(std::abs(*options.step) <= 3))
        throw CommandError("--step of a robot's references lies between -3 and 3 rad");
    asked.step = options.step.value_or(asked.step);
    asked.goals = goals_of(options, bench->joints());
    if (bench->joints().empty()) throw CommandError("robot '" + robot.name + "' has no joints");
    if (bench->is_held())
        std::printf("the base of '%s' floats; it is held while its joints are tuned\n",
                    escape::terminal(robot.name).c_str());
    const auto joints = [&] {
        const Waiting waiting("tuning " + std::to_string(bench->joints().size()) + " joints");
        return tuning::tune(*bench, asked);
    }();
    print(joints);
    const std::string setting = robot.world.empty()
                                    ? robot.name + ": {position_gains: \"[" + rows_of(joints, "; ") + "]\"}\n"
                                    : "position_gains=\"" + rows_of(joints, " ") + "\"\n";
    if (options.output.empty()) std::printf("\n%s", setting.c_str());
    if (!options.output.empty()) {
        OutputFile file(options.output);
        file.write(robot.world.empty()
                       ? setting
                       : with_gains(read_text_file(robot.world), robot.name, rows_of(joints, " ")));
        file.commit();
        std::printf("%s\n", options.output.c_str());
    }
    if (!options.picture.empty()) write_figure(figure_of(joints), options.picture, 1000);
}

} // namespace

void add_tune(CLI::App& app) {
    auto* command = app.add_subcommand(
        "tune", "find gains of a loop of a model, or of a robot's position loops, by simulated steps");
    auto options = std::make_shared<TuneOptions>();
    options->add_to(*command, "model file (.yaml), or a World's file (.xml)");
    command
        ->add_option("--robot", options->robot,
                     "the robot's name in the World, or the MujocoWorld's path; where there are several")
        ->type_name("NAME");
    command
        ->add_option("--frequency", options->frequencies,
                     "natural frequency of the closed loops, rad/s (20 by default), or that of one joint; "
                     "may be repeated")
        ->type_name("[JOINT=]W")
        ->allow_extra_args(false);
    auto* damping = command->add_option("--damping", options->damping, "damping ratio of the closed loops")
                        ->check(between(0.2, 5.0))
                        ->type_name("Z")
                        ->capture_default_str();
    damping->excludes(command->get_option("--overshoot"));
    command
        ->add_option("--torque", options->tuning.torque_share,
                     "share of the effort limits that a step may take; the frequency is lowered for it")
        ->check(between(0.01, 1.0))
        ->type_name("SHARE")
        ->capture_default_str();
    command
        ->add_option("--integral", options->tuning.integral,
                     "the pole of I, as a share of the frequency, where load or friction ask for it: 0.01 to "
                     "1; 0: no I")
        ->check(between(0.0, 1.0))
        ->type_name("SHARE")
        ->capture_default_str();
    command
        ->add_option("--pose", options->pose,
                     "joint positions around which they are tuned, rad, with commas between; otherwise the "
                     "start")
        ->delimiter(',')
        ->type_name("S,...")
        ->allow_extra_args(false);
    command->footer("Each joint is identified by a small step, its gains are computed for the frequency and "
                    "the damping, and refined by a search on simulated steps.\n"
                    "Examples:\n"
                    "  bf tune examples/two_robots/world.xml --robot left --picture steps.png -o tuned.xml\n"
                    "  bf tune model.yaml --frequency 15 --frequency l_knee=10 --overshoot 5 -o gains.yaml\n"
                    "  bf run model.yaml --params gains.yaml\n" +
                    std::string(loop_example));
    for (const char* of_joints : {"--robot", "--frequency", "--damping", "--torque", "--integral", "--pose"})
        command->get_option(of_joints)->excludes(command->get_option("--loop"));
    command->callback([options] { options->loop.empty() ? execute(*options) : options->execute(); });
}

} // namespace bf::tools
