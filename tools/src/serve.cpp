// bf serve: the robots of a running model, for other programs.
#include "bf/middleware/ending.hpp"
#include "bf/run/recorder.hpp"
#include "files.hpp"
#include "model_parameters.hpp"
#include "robots.hpp"
#include "run.hpp"
#include "run_realtime.hpp"
#include "terminal.hpp"
#include "verbs.hpp"
#include "ways_to_serve.hpp"

#include <atomic>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

namespace bf::tools {

namespace {

struct ServeOptions {
    ModelOptions model;
    RealtimeOptions realtime;
    std::string stop, record, on_loss = "hold";
    double silence = 0.2; ///< s
    bool is_once = false;
    const WayToServe* way = nullptr;
    std::map<std::string, std::vector<std::string>> of_way; ///< its options, by their names without dashes
};

/// All robots of a simulation, which are shown when it has started, in its first step.
class ServedRobots final : public Run::Observer {
  public:
    ServedRobots(const ServeOptions& options, const Simulation& simulation, Registry& registry)
        : options_(options) {
        const auto robots = robots_of(simulation);
        if (robots.empty())
            throw CommandError(options.model.file +
                               " has no robot to serve; give it a MujocoWorld, or a WorldRobot in a World");
        if (options.way->alone && robots.size() > 1)
            throw CommandError(options.model.file + " has several robots, and " + options.way->alone);
        for (const auto& robot : robots)
            if (!robot.driven_by.empty())
                throw CommandError(robot.driven_by + " drives the robot '" + robot.path +
                                   "', which can have one controller alone; serve a model without it");
        const middleware::HostOptions host{.waits = !options.realtime.is_asked,
                                           .is_once = options.is_once,
                                           .watchdog = options.silence,
                                           .idle_after = options.silence,
                                           .on_loss = options.on_loss == "limp" ? middleware::OnLoss::limp
                                                                                : middleware::OnLoss::hold,
                                           .goes_on = [this] {
                                               for (auto& served : served_) served->heed();
                                               return goes_on();
                                           }};
        try {
            for (const auto& robot : robots)
                served_.push_back(make_served_robot(
                    *options.way,
                    {robot.path, robots.size() == 1, *robot.device, *robot.connection, options.of_way, host},
                    registry));
        } catch (const std::runtime_error& error) {
            throw CommandError(error.what());
        }
    }

    void observe(const Run& run) noexcept override {
        if (!is_shown_) {
            try {
                for (auto& served : served_) {
                    served->start(run.period());
                    std::fprintf(stderr, "  serves the %s\n", served->name().c_str());
                }
            } catch (const std::exception& error) {
                failure = served_.front()->name() + ": " + error.what();
            }
            is_shown_ = true;
        }
        if (!failure.empty()) return;
        for (auto& served : served_) served->show(run.time());
        for (auto& served : served_) served->step(run.time());
    }

    /// Before the first step: others may ask for the model as it began.
    void allow_reset() {
        for (auto& served : served_) served->allow_reset();
    }
    /// Between two steps: does somebody? The joints are taken back then.
    bool take_reset() {
        bool is_asked = false;
        for (auto& served : served_) {
            if (!served->wants_reset()) continue;
            served->reset();
            is_asked = true;
        }
        return is_asked;
    }

    /// In the thread that also prints.
    bool goes_on() {
        if (!is_shown_) return !InterruptGuard::signal(); // the thread of the steps may be starting them
        bool is_over = options_.is_once;
        for (auto& served : served_) {
            for (std::string news; !(news = served->take_news()).empty();)
                if (!options_.model.is_quiet)
                    std::fprintf(stderr, "  %s: %s\n", served->name().c_str(), news.c_str());
            is_over = is_over && served->gone() > 0;
        }
        return !is_over && failure.empty() && !InterruptGuard::signal();
    }

    std::string failure; ///< why robots cannot be served

  private:
    const ServeOptions& options_;
    std::vector<std::unique_ptr<middleware::ServedRobot>> served_;
    std::atomic<bool> is_shown_ = false;
};

void execute(const ServeOptions& options) {
    ModelOptions model = options.model;
    model.sets.push_back("stop=" + (options.stop.empty() ? "Inf" : options.stop));
    // Shared with what ends the robots, which may never come back.
    const auto model_of_robots = std::make_shared<const LoadedModel>(load_model(model));
    const LoadedModel& loaded = *model_of_robots;
    FileSet read = files_of(loaded);
    read.insert(model.params.begin(), model.params.end());
    refuse_overwriting({{"--record", options.record}}, read);
    const auto run_of_robots = std::make_shared<Simulation>(loaded.diagram);
    Simulation& simulation = *run_of_robots;
    auto served = std::make_shared<ServedRobots>(options, simulation, *loaded.registry);
    ServedRobots& robots = *served;
    const InterruptGuard guard;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(simulation, simulation.recorded(), options.record, loaded.source,
                         recording::WriterOptions{.drop_when_full = options.realtime.is_asked});
        recorder->served(options.way->option.name + std::string(" ") +
                         options.of_way.at(options.way->option.name + 2).back());
        if (!options.realtime.is_asked) simulation.add_observer(*recorder);
    }
    std::unique_ptr<ModelParameters> parameters;
    if (const std::string option = options.way->option.name; options.way->parameters_by)
        parameters = serve_parameters(option, options.of_way.at(option.substr(2)).back(), loaded, simulation,
                                      recorder ? &*recorder : nullptr);
    const auto goes_on = [&] { return robots.goes_on() && !(recorder && recorder->failed()); };
    RunResult result;
    if (options.realtime.is_asked) {
        // The recorder is added by the runner; the robots see a step before it.
        simulation.add_observer(robots);
        result = run_realtime(
            simulation, options.realtime, nullptr, recorder ? &*recorder : nullptr,
            parameters ? [&] { parameters->apply(); } : std::function<void()>(),
            [&](const std::string&) { return goes_on(); }, [](const RunResult&) {});
    } else {
        simulation.add_observer(robots);
        RunHooks hooks;
        std::vector<std::byte> begin; // where the model goes that is asked to begin again
        const auto alone = [&](const std::function<void()>& what) {
            parameters ? parameters->alone(what) : what();
        };
        hooks.between_steps = [&] {
            if (simulation.steps() == 0 && begin.empty() && options.way->has_reset && !recorder) try {
                    alone([&] { begin = simulation.snapshot(); });
                    robots.allow_reset();
                } catch (const RunError&) { // a block refuses, and the robot says so
                }
            if (robots.take_reset()) alone([&] { simulation.restore(begin); });
            if (parameters) parameters->apply();
            return goes_on();
        };
        result = run(simulation, loaded.diagram.stop, hooks);
    }
    parameters.reset();
    goes_on(); // tells what happened last
    if (recorder) recorder->close();
    if (!options.model.is_quiet) std::fputs(result.report.c_str(), stdout);
    const std::string stopped = loaded.diagram.name + " stopped at t = " + number(result.simulated) + " s: ";
    const std::string failure = robots.failure;
    if (!middleware::end_within(
            5, [served = std::move(served), run_of_robots, model_of_robots]() mutable { served.reset(); }))
        std::fprintf(stderr, "  the middleware does not answer, and is left without a farewell\n");
    if (!failure.empty()) throw CommandError(failure);
    if (!result.failure.empty()) throw CommandError(stopped + result.failure);
    if (InterruptGuard::signal()) throw Interrupted(InterruptGuard::signal(), stopped + "interrupted");
}

} // namespace

void add_serve(CLI::App& app) {
    auto* command = app.add_subcommand("serve", "let other programs drive the robots of a model");
    auto options = std::make_shared<ServeOptions>();
    options->model.add_to(*command);
    std::string choices;
    for (const auto& way : ways_to_serve()) {
        const auto add = [&](const WayOption& option) {
            auto& values = options->of_way[option.name + 2];
            auto* added = command->add_option(option.name, values, option.help)->type_name(option.value);
            option.is_list ? added->allow_extra_args(false) : added->expected(1);
            return added;
        };
        auto* chosen =
            add(way.option)
                ->check(CLI::Validator([wrong = way.wrong](std::string& value) { return wrong(value); }, ""));
        for (const auto& option : way.more) {
            auto* more = add(option)->needs(chosen);
            if (option.is_needed) chosen->needs(more);
        }
        for (const auto& other : ways_to_serve()) {
            if (&other == &way) break;
            chosen->excludes(command->get_option(other.option.name));
        }
        choices += std::string(choices.empty() ? "" : " or ") + way.option.name + " " + way.option.value;
    }
    command->add_option("--stop", options->stop, "duration, s (an expression); until Ctrl-C by default")
        ->type_name("T");
    command
        ->add_option("--record", options->record,
                     "write the signals that the model records to this MCAP file")
        ->type_name("FILE");
    command->add_flag("--once", options->is_once, "end when the first controller of each robot has left");
    command
        ->add_option("--on-loss", options->on_loss,
                     "what joints do when their controller is gone: hold their positions, or go limp (hold "
                     "by default); before the first one comes they hold")
        ->check(CLI::IsMember({"hold", "limp"}).description(""))
        ->type_name("WHAT");
    auto* silence =
        command
            ->add_option(
                "--silence", options->silence,
                "with --realtime: take the joints back after so many s without a command, and let them wait "
                "where torques, velocities, PWM or currents do not come again; 0: never (0.2 by default)")
            ->check(between(0, 1e6))
            ->type_name("S");
    options->realtime.add_to(*command);
    silence->needs(command->get_option("--realtime"));
    command->add_flag("--quiet", options->model.is_quiet, "tell nothing of controllers that come and go");
    command->footer(
        "Without --realtime the model's time stands still until a controller has done its step, so that "
        "every run is the same,\nbit for bit; with it the model runs by the clock, and controllers keep up "
        "with it.\n"
        "A diagram drives the robot by the block Robot of SharedMemory, Udp, Yarp, Ros1 or Ros2 in place of "
        "its world.\n"
        "Example: bf serve examples/icub_balancing/balancing.yaml --set \"robot_is='served'\" --shm icub");
    command->callback([options, choices] {
        std::erase_if(options->of_way, [](const auto& option) { return option.second.empty(); });
        for (const auto& way : ways_to_serve())
            if (options->of_way.contains(way.option.name + 2)) options->way = &way;
        if (options->way == nullptr) throw CLI::RequiredError(choices);
        execute(*options);
    });
}

} // namespace bf::tools
