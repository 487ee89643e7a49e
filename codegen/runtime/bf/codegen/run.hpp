// Runs a generated model as a program.
#pragma once

#include "bf/base/run_options.hpp"
#include "bf/codegen/command_port.hpp"
#include "bf/codegen/csv_file.hpp"
#include "bf/codegen/input_file.hpp"
#include "bf/codegen/live.hpp"
#include "bf/codegen/parameter_file.hpp"
#include "bf/core/interrupt.hpp"
#include "bf/kernels/steps.hpp"
#include "bf/realtime/control.hpp"
#include "bf/realtime/interrupt.hpp"
#include "bf/realtime/pacer.hpp"
#include "bf/realtime/watchdog.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>

namespace bf::generated {

/// What the command line says.
struct RunOptions {
    std::string parameters, inputs, csv, folder;
    std::optional<double> stop; ///< s; else what the model says
    bool is_paced = false, shows_time = false, lists = false;
    realtime::Overrun overrun = realtime::Overrun::skip;
    realtime::ThreadOptions thread;
    double watchdog = 1;                 ///< s; 0: none
    std::optional<std::string> commands; ///< where they come in
    std::optional<std::string> serve;    ///< where
    bool is_controlled = false, waits = false;
    std::string token; ///< file

    RunOptions() { thread.priority = 50; }
};

inline const char* usage() {
    return "usage: %s [OPTION]...\n"
           "  --stop SECONDS   duration; Inf: until Ctrl-C\n"
           "  --params FILE    YAML of names and values to change before the first step\n"
           "  --inputs FILE    CSV of the model's inputs: columns time, u, x[1], ...; a row holds until the "
           "next\n"
           "  --csv FILE       write the recorded signals\n"
           "  --folder FOLDER  where relative file names of blocks are meant from\n"
           "  --realtime       step against the clock\n"
           "  --overrun POLICY what a missed deadline leads to: skip, catch-up, stop or degrade (skip)\n"
           "  --priority P     of SCHED_FIFO, 1 to 99; 0: the ordinary scheduler (50)\n"
           "  --cpu N          run the loop on this processor alone\n"
           "  --watchdog S     end the program when a step takes longer; 0: never (1)\n"
           "  --command-port [WHERE]\n"
           "                   take changes of parameters while it runs, a line of such YAML each, at a Unix "
           "socket\n"
           "                   (this path, else one in XDG_RUNTIME_DIR) or, where a number stands, at a TCP "
           "port\n"
           "  --serve [WHERE]  serve live signals, parameters and timing to viewers on this computer (bf "
           "edit\n"
           "                   --attach, Foxglove), at a port (8765) or at a Unix socket, unix:PATH\n"
           "  --control        let viewers change parameters, start and stop the run\n"
           "  --wait           open no device and make no step until a viewer starts the run\n"
           "  --token FILE     the token for the TCP port or viewers is the line in this file, which is made "
           "if\n"
           "                   it is not there (a random one for each run)\n"
           "  --list           print all parameters and variables, and what is fixed; end\n"
           "  --time           print the time per step\n";
}

namespace detail {
template <class Model, class = void> struct IsElaborated : std::false_type {};
template <class Model>
struct IsElaborated<Model, std::void_t<decltype(&Model::elaborate)>> : std::true_type {};

template <class Model, class = void> struct HasFolder : std::false_type {};
template <class Model> struct HasFolder<Model, std::void_t<decltype(Model::folder)>> : std::true_type {};

template <class Model, class = void> struct HasEvents : std::false_type {};
template <class Model>
struct HasEvents<Model, std::void_t<decltype(Model::before_event)>> : std::true_type {};

/// Empty, or what is wrong: "--OPTION: ...".
inline std::string read_options(int argc, char** argv, RunOptions& options) {
    std::set<std::string> given;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const char* const value = i + 1 < argc ? argv[i + 1] : nullptr;
        const auto wrong = [&](const std::string& text) { return option + ": " + text; };
        if (option == "--list" || option == "--list-parameters") {
            options.lists = true;
            continue;
        }
        if (option == "--time") {
            options.shows_time = true;
            continue;
        }
        if (option == "--realtime") {
            options.is_paced = true;
            continue;
        }
        if (option == "--control") {
            options.is_controlled = true;
            continue;
        }
        if (option == "--wait") {
            options.waits = true;
            continue;
        }
        if (!given.insert(option).second) return wrong("it is given twice");
        if (option == "--command-port" || option == "--serve") {
            const bool is_given = value && *value && std::strncmp(value, "--", 2) != 0;
            i += is_given;
            if (option == "--serve")
                options.serve = is_given ? value : "8765";
            else
                options.commands = is_given ? value : "";
            continue;
        }
        std::string* const text = option == "--csv"      ? &options.csv
                                  : option == "--params" ? &options.parameters
                                  : option == "--inputs" ? &options.inputs
                                  : option == "--folder" ? &options.folder
                                  : option == "--token"  ? &options.token
                                                         : nullptr;
        const OptionRange* const range = option == "--priority"   ? &priority_range
                                         : option == "--cpu"      ? &processor_range
                                         : option == "--watchdog" ? &watchdog_range
                                         : option == "--stop"     ? &stop_range
                                                                  : nullptr;
        if (!text && !range && option != "--overrun") return wrong("there is no such option");
        if (!value) return wrong("a value is missing");
        if (!*value) return wrong(empty_option);
        ++i;
        double number = 0;
        if (text) *text = value;
        if (range) {
            if (const std::string why = read_option(value, *range, number); !why.empty()) return wrong(why);
        }
        if (option == "--overrun") {
            const auto known = realtime::overrun_of(value);
            if (!known) return wrong("there is no policy '" + std::string(value) + "'");
            options.overrun = *known;
        }
        if (option == "--priority") options.thread.priority = static_cast<int>(number);
        if (option == "--cpu") options.thread.cpu = static_cast<int>(number);
        if (option == "--watchdog") options.watchdog = number;
        if (option == "--stop") options.stop = number;
    }
    for (const char* paced : {"--overrun", "--priority", "--cpu", "--watchdog", "--serve"})
        if (given.count(paced) && !options.is_paced) return std::string(paced) + " requires --realtime";
    if (!options.token.empty() && !options.commands && !options.serve)
        return "--token requires --command-port or --serve";
    if (options.is_controlled && !options.serve) return "--control requires --serve";
    if (options.waits && !options.is_controlled) return "--wait requires --control";
    return "";
}
} // namespace detail

/// All that can be changed with its present value, as a parameter file has it, and what is fixed as comments.
template <class Model> void list_parameters(const Model& model) {
    for (const auto& table : {model.variable_table(), model.parameter_table()})
        for (const Quantity& q : table)
            std::fputs(line_of(q, [&](int i) { return read(model.data(q), q.type, i); }).c_str(), stdout);
    if constexpr (detail::HasArguments<Model>::value)
        for (const FixedName& argument : Model::argument_table())
            std::printf("# %s: at the start only; %s\n", argument.name, argument.reason);
    for (const FixedName& fixed : model.fixed_table())
        std::printf("# %s is fixed: %s\n", fixed.name, fixed.reason);
}

/// Steps the model until its stop time; returns the exit code of the program, as of `bf run`.
template <class Model> int run(int argc, char** argv) {
    occupy_standard_streams();
    const NumberLocale locale;
    const std::string program = std::string(argv[0]).substr(std::string(argv[0]).rfind('/') + 1);
    const auto complain = [&](const std::string& text) {
        std::fprintf(stderr, "%s: %s%s", program.c_str(), text.c_str(), text.back() == '\n' ? "" : "\n");
    };
    for (int i = 1; i < argc; ++i)
        if (std::strcmp(argv[i], "--help") == 0) {
            std::printf(usage(), argv[0]);
            return 0;
        }
    RunOptions options;
    if (const std::string wrong = detail::read_options(argc, argv, options); !wrong.empty()) {
        complain(wrong + "\nSee " + argv[0] + " --help");
        return 2;
    }
    const auto model = std::make_unique<Model>();
    if constexpr (detail::HasFolder<Model>::value) {
        if (!options.folder.empty()) model->folder = options.folder.c_str();
    } else if (!options.folder.empty()) {
        complain("no block of this model reads a file: leave --folder out");
        return 2;
    }
    double planned = Model::stop_time;
    std::string errors;
    if constexpr (detail::IsElaborated<Model>::value) {
        errors = model->elaborate(options.parameters);
        planned = model->planned_stop();
    } else if (!options.parameters.empty()) {
        errors = load_parameters(*model, options.parameters);
    }
    if (!errors.empty()) {
        std::fprintf(stderr, "%s%s", errors.c_str(), errors.back() == '\n' ? "" : "\n");
        return 1;
    }
    if (options.lists) {
        list_parameters(*model);
        return 0;
    }
    const double stop = options.stop.value_or(planned);
    if (!std::isfinite(stop) && !options.stop && !options.is_paced) {
        complain("the model does not say when it ends: give --stop SECONDS (--stop Inf runs until Ctrl-C)");
        return 1;
    }
    if (const std::string wrong = check_stop(stop, Model::period); !wrong.empty()) {
        complain(wrong + "; give a shorter --stop (Inf has no end)");
        return 1;
    }
    std::optional<InputFile> inputs;
    if (!options.inputs.empty())
        if (const std::string wrong = inputs.emplace().read(options.inputs, model->input_table());
            !wrong.empty()) {
            complain(wrong);
            return 1;
        }
    for (const std::string& read : {options.inputs, options.parameters})
        if (is_one_file(options.csv, read)) {
            complain("--csv " + options.csv + " is a file that is read; give another name");
            return 1;
        }
    CsvFile csv;
    if (!options.csv.empty() && !csv.open(options.csv, model->recorded_table(), options.is_paced)) {
        complain("cannot write " + options.csv + ": " + write_error(csv.error()));
        return 1;
    }
    const realtime::InterruptGuard guard; // whoever reads the line below may end the program at once
    if constexpr (detail::HasFolder<Model>::value) look_for_interrupt(guard.flag()); // so do blocks that wait
    std::optional<CommandPort> commands;
    if (options.commands) {
        commands.emplace(*model);
        if (const std::string wrong = commands->listen(*options.commands, program, options.token);
            !wrong.empty()) {
            complain(wrong);
            return 1;
        }
        std::fprintf(stderr, "takes commands at %s\n", commands->place().c_str());
    }
    const std::int64_t steps = kernels::steps_before(stop, Model::period);
    std::optional<realtime::Pacer> pacer;
    std::optional<realtime::Watchdog> watchdog;
    std::optional<Live> live;
    realtime::Control control(options.waits);
    std::atomic<std::int64_t> done{0};
    if (options.is_paced) {
        const auto period = realtime::nanoseconds(Model::period);
        const auto limit = realtime::stall_limit(options.watchdog, period),
                   emergency = realtime::emergency_limit(period);
        pacer.emplace(period, options.overrun);
        if (options.serve) {
            live.emplace(*model, control, pacer->statistics());
            if (const std::string wrong =
                    live->listen({*options.serve, options.token, options.is_controlled});
                !wrong.empty()) {
                complain(wrong);
                return 1;
            }
            std::fprintf(stderr, "live at %s\n", live->place().c_str());
        }
        if (limit > 0 || live || realtime::ServiceManager().is_there())
            watchdog.emplace(
                limit, emergency, options.thread.priority > 0 ? std::min(options.thread.priority + 1, 99) : 0,
                control, [&, limit, emergency] {
                    const std::int64_t step = done.load();
                    const double at = static_cast<double>(step) * Model::period;
                    const std::string failure = control.state() == realtime::Control::State::emergency
                                                    ? realtime::emergency_text(step, at, emergency, "")
                                                    : realtime::stall_text(step, at, limit, "");
                    complain(failure);
                    if (live) live->end(failure, false);
                    std::_Exit(1);
                });
    }
    while (control.state() == realtime::Control::State::waiting) {
        live->apply(-1);
        if (watchdog) watchdog->kick();
        if (realtime::InterruptGuard::signal()) control.stop();
        realtime::sleep_until(realtime::now() + 20'000'000);
    }
    if (watchdog) watchdog->rest();
    const bool is_started = control.goes_on();
    bool good = !is_started || model->initialize();
    if (pacer) {
        const auto refused = realtime::prepare_thread(options.thread);
        if (!refused.empty()) complain("warning: the period is not guaranteed on this machine");
        for (const std::string& text : refused) std::fprintf(stderr, "  %s\n", text.c_str());
        pacer->start();
        if (watchdog) watchdog->kick();
    }
    const auto show = [&](bool is_event) {
        if (pacer && pacer->is_degraded()) return;
        if (csv.is_open()) csv.row(*model);
        if (live) is_event ? live->observe_event() : live->observe();
    };
    [[maybe_unused]] const auto show_event = [&] { show(true); };
    if constexpr (detail::HasEvents<Model>::value) {
        model->observer = const_cast<void*>(static_cast<const void*>(&show_event));
        model->before_event = [](void* f) { (*static_cast<decltype(show_event)*>(f))(); };
    }
    const auto begin = std::chrono::steady_clock::now();
    for (std::int64_t k = 0; good && k < steps && !csv.error() && !realtime::InterruptGuard::signal(); ++k) {
        if ((pacer && !pacer->wait()) || !control.goes_on()) break;
        if (commands) commands->apply(*model);
        if (live) live->apply(k);
        if (inputs)
            inputs->go_to(model->time(), Model::period, [&](const Quantity& q) { return model->data(q); });
        good = model->output();
        if (good) show(false);
        good = good && model->update();
        if (pacer) pacer->end_step();
        if (watchdog) watchdog->kick();
        done.store(k + 1, std::memory_order_relaxed);
    }
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (watchdog) watchdog->end();
    if (is_started) model->terminate();
    watchdog.reset();
    csv.close();
    for (const Quantity& q : model->check_table())
        std::printf("%s = %.17g\n", q.name, read(model->data(q), q.type, 0));
    if (options.shows_time && done > 0)
        std::printf("%.3f ns per step\n", wall * 1e9 / static_cast<double>(done));
    if (pacer) std::fputs(realtime::report(pacer->statistics()).c_str(), stdout);
    if (live) std::fputs(live->log().c_str(), stdout);
    if (csv.lost() > 0) std::printf("  %" PRIu64 " rows not recorded: the disk was too slow\n", csv.lost());
    std::fflush(stdout);
    char at[60];
    std::snprintf(at, sizeof at, "stopped at t = %g s: ", model->time());
    std::string failure; // a line for each
    const auto fails = [&](const std::string& text) {
        if (!text.empty()) failure += (failure.empty() ? "" : "\n") + text;
    };
    const int signal = realtime::InterruptGuard::signal();
    if (!good && !(signal && is_interruption(model->failure()))) {
        const std::string block = model->failed_block();
        fails(block + (block.empty() ? "" : ": ") + model->failure());
    }
    if (csv.error()) fails("cannot write " + options.csv + ": " + write_error(csv.error()));
    if (good && options.overrun == realtime::Overrun::stop && pacer)
        fails(realtime::missed_deadline(pacer->statistics()));
    if (live) live->end(failure, signal != 0);
    if (live) fails(live->emergency());
    if (!failure.empty()) {
        complain(at + failure);
        return 1;
    }
    if (signal) complain(std::string(at) + "interrupted");
    return signal ? 128 + signal : 0;
}

} // namespace bf::generated
