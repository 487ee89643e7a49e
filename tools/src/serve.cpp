// bf serve: the robots of a running model, for other programs.
#include "bf/middleware/robot_host.hpp"
#include "bf/run/recorder.hpp"
#include "bf/shared_memory/robot.hpp"
#include "bf/udp/robot.hpp"
#include "files.hpp"
#include "robots.hpp"
#include "run.hpp"
#include "run_realtime.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cmath>
#include <cstdio>
#include <optional>

namespace bf::tools {

namespace {

using middleware::RobotHost;

struct ServeOptions {
    ModelOptions model;
    RealtimeOptions realtime;
    std::string shared_memory, udp, key, stop, record, on_loss = "hold";
    double silence = 0.2; ///< s
    bool is_once = false, is_quiet = false;
};

/// All robots of a simulation, which are shown when it has started, in its first step.
class ServedRobots final : public Run::Observer {
  public:
    ServedRobots(const ServeOptions& options, const Simulation& simulation) : options_(options) {
        const auto robots = robots_of(simulation);
        if (robots.empty())
            throw CommandError(options.model.file +
                               " has no robot to serve; give it a MujocoWorld, or a WorldRobot "
                               "in a World");
        for (const auto& robot : robots) {
            if (!robot.driven_by.empty())
                throw CommandError(robot.driven_by + " drives the robot '" + robot.path +
                                   "', which can have one controller alone; serve a model without it");
            if (!options.udp.empty() && robots.size() > 1)
                throw CommandError(options.model.file +
                                   " has several robots, and an address is that of one; serve them by --shm");
            const std::string name = options.shared_memory + (robots.size() > 1 ? "." + robot.path : "");
            auto& served = served_.emplace_back();
            served.end =
                options.udp.empty() ? shared_memory::make_end(name) : udp::make_end(options.udp, options.key);
            served.host = std::make_unique<RobotHost>(
                options.udp.empty() ? name : robot.path, *robot.device, *robot.connection, *served.end,
                middleware::HostOptions{!options.realtime.is_asked, options.silence,
                                        options.on_loss == "limp" ? middleware::OnLoss::limp
                                                                  : middleware::OnLoss::hold,
                                        [this] { return goes_on(); }});
        }
    }

    void observe(const Run& run) noexcept override {
        try {
            if (!std::exchange(is_shown_, true))
                for (auto& served : served_) {
                    served.host->start(run.period());
                    std::fprintf(stderr, "  serves the %s\n", served.end->name().c_str());
                }
        } catch (const std::exception& error) {
            failure = served_.front().end->name() + ": " + error.what();
        }
        if (!failure.empty()) return;
        for (auto& served : served_) served.host->step(run.time());
    }

    /// In the thread that also prints.
    bool goes_on() {
        bool is_over = options_.is_once;
        for (auto& served : served_) {
            for (RobotHost::Event event; served.host->take_event(event);)
                if (!options_.is_quiet)
                    std::fprintf(stderr, "  %s: %s\n", served.end->name().c_str(), text_of(event).c_str());
            if (!options_.is_quiet && served.end->counts().rejected > 0 &&
                !std::exchange(served.is_strange, true))
                std::fprintf(stderr,
                             "  %s: left out a datagram that has another key, version or size, or was sent "
                             "again by somebody; so are those that follow\n",
                             served.end->name().c_str());
            is_over = is_over && served.host->gone() > 0;
        }
        return !is_over && failure.empty() && !InterruptGuard::signal();
    }

    std::string failure; ///< why robots cannot be served

  private:
    struct Served {
        std::unique_ptr<middleware::RobotEnd> end;
        std::unique_ptr<RobotHost> host;
        bool is_strange = false; ///< something came that is not the controller's
    };
    std::string text_of(RobotHost::Event event) const {
        const std::string then = options_.on_loss == "limp" ? "; its joints are limp" : "; its joints hold";
        switch (event) {
        case RobotHost::Event::came: return "a controller has come";
        case RobotHost::Event::left: return "the controller has left" + then;
        case RobotHost::Event::died: return "the controller has died" + then;
        case RobotHost::Event::silent: return "no command for " + number(options_.silence) + " s" + then;
        case RobotHost::Event::refused: return "a command was refused";
        }
        return "";
    }

    const ServeOptions& options_;
    std::vector<Served> served_;
    bool is_shown_ = false;
};

void execute(const ServeOptions& options) {
    ModelOptions model = options.model;
    model.sets.push_back("stop=" + (options.stop.empty() ? "Inf" : options.stop));
    const LoadedModel loaded = load_model(model);
    FileSet read = files_of(loaded);
    read.insert(model.params.begin(), model.params.end());
    refuse_overwriting({{"--record", options.record}}, read);
    Simulation simulation(loaded.diagram);
    ServedRobots robots(options, simulation);
    const InterruptGuard guard;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(simulation, simulation.recorded(), options.record, loaded.source,
                         recording::WriterOptions{.drop_when_full = options.realtime.is_asked});
        if (!options.realtime.is_asked) simulation.add_observer(*recorder);
    }
    const auto goes_on = [&] { return robots.goes_on() && !(recorder && recorder->failed()); };
    RunResult result;
    if (options.realtime.is_asked) {
        // The recorder is added by the runner; the robots see a step before it.
        simulation.add_observer(robots);
        result = run_realtime(
            simulation, options.realtime, nullptr, recorder ? &*recorder : nullptr, {},
            [&](const std::string&) { return goes_on(); }, [](const RunResult&) {});
    } else {
        simulation.add_observer(robots);
        RunHooks hooks;
        hooks.between_steps = goes_on;
        result = run(simulation, loaded.diagram.stop, hooks);
    }
    goes_on(); // tells what happened last
    if (recorder) recorder->close();
    if (!options.is_quiet) std::fputs(result.report.c_str(), stdout);
    const std::string stopped = loaded.diagram.name + " stopped at t = " + number(result.simulated) + " s: ";
    if (!robots.failure.empty()) throw CommandError(robots.failure);
    if (!result.failure.empty()) throw CommandError(stopped + result.failure);
    if (InterruptGuard::signal()) throw Interrupted(InterruptGuard::signal(), stopped + "interrupted");
}

} // namespace

void add_serve(CLI::App& app) {
    auto* command = app.add_subcommand("serve", "let other programs drive the robots of a model");
    auto options = std::make_shared<ServeOptions>();
    options->model.add_to(*command);
    command
        ->add_option(
            "--shm", options->shared_memory,
            "serve the robot under this name through shared memory, to programs of this user on this "
            "computer; several robots: NAME.BLOCK")
        ->type_name("NAME")
        ->check(CLI::Validator([](std::string& name) { return shared_memory::wrong_name(name); }, ""));
    auto* udp =
        command
            ->add_option("--udp", options->udp,
                         "serve it over UDP at PORT, to programs of this computer, or at HOST:PORT")
            ->type_name("WHERE")
            ->check(CLI::Validator([](std::string& address) { return udp::wrong_address(address); }, ""));
    auto* key = command
                    ->add_option(
                        "--key", options->key,
                        "with --udp: the token that controllers must know is the line in this file, which is "
                        "made if it is not there")
                    ->type_name("FILE")
                    ->needs(udp);
    udp->needs(key);
    udp->excludes(command->get_option("--shm"));
    command->add_option("--stop", options->stop, "duration, s (an expression); until Ctrl-C by default")
        ->type_name("T");
    command
        ->add_option("--record", options->record,
                     "write the signals that the model records to this MCAP file")
        ->type_name("FILE");
    command->add_flag("--once", options->is_once, "end when the first controller has left");
    command
        ->add_option("--on-loss", options->on_loss,
                     "what joints do when their controller is gone: hold their positions, or go limp (hold "
                     "by default)")
        ->check(CLI::IsMember({"hold", "limp"}).description(""))
        ->type_name("WHAT");
    command
        ->add_option(
            "--silence", options->silence,
            "with --realtime: take the joints back after so many s without a command; 0: never (0.2 by "
            "default)")
        ->check(between(0, 1e6))
        ->type_name("S");
    options->realtime.add_to(*command);
    command->add_flag("--quiet", options->is_quiet, "tell nothing of controllers that come and go");
    command->footer(
        "Without --realtime the model's time stands still until a controller has done its step, so that "
        "every run is "
        "the same,\nbit for bit; with it the model runs by the clock, and controllers keep up with it.\n"
        "A diagram drives the robot by the block SharedMemory/Robot or Udp/Robot in place of its world.\n"
        "Example: bf serve examples/icub_balancing/balancing.yaml --set \"robot_is='served'\" --shm icub");
    command->callback([options] {
        if (options->shared_memory.empty() && options->udp.empty())
            throw CLI::RequiredError("--shm NAME or --udp WHERE");
        execute(*options);
    });
}

} // namespace bf::tools
