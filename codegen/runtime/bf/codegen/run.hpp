// Runs a generated model as a program.
#pragma once

#include "bf/codegen/command_port.hpp"
#include "bf/codegen/parameter_file.hpp"
#include "bf/kernels/steps.hpp"
#include "bf/realtime/pacer.hpp"

#include <chrono>
#include <cinttypes>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

namespace bf::generated {

/// A CSV file of the recorded signals, one row per step and one before each event; numbers read back exactly.
class CsvFile {
  public:
    CsvFile() = default;
    CsvFile(const CsvFile&) = delete;
    CsvFile& operator=(const CsvFile&) = delete;
    ~CsvFile() { close(); }

    bool open(const std::string& file, Quantities columns) {
        file_ = std::fopen(file.c_str(), "w");
        if (!file_) return false;
        std::fputs("time", file_);
        for (const Quantity& q : columns)
            for (int i = 0; i < q.size(); ++i) {
                std::string name = q.name; // elements are named as in recordings: x[0], M[0][1]
                if (q.size() > 1) name += "[" + std::to_string(i % q.rows) + "]";
                if (q.cols > 1) name += "[" + std::to_string(i / q.rows) + "]";
                std::string quoted;
                for (const char c : name) quoted += c == '"' ? "\"\"" : c == '\n' ? " " : std::string(1, c);
                std::fprintf(file_, ",\"%s\"", quoted.c_str());
            }
        std::fputc('\n', file_);
        return true;
    }
    template <class Model> void row(const Model& model) {
        std::fprintf(file_, "%.17g", model.time());
        for (const Quantity& q : model.recorded_table())
            for (int i = 0; i < q.size(); ++i) std::fprintf(file_, ",%.17g", read(model.data(q), q.type, i));
        std::fputc('\n', file_);
    }
    bool is_open() const { return file_ != nullptr; }
    /// False when something could not be written.
    bool close() {
        if (!file_) return true;
        const bool good = std::ferror(file_) == 0;
        const bool closed = std::fclose(file_) == 0;
        file_ = nullptr;
        return good && closed;
    }

  private:
    std::FILE* file_ = nullptr;
};

inline int usage(const char* program, int code) {
    std::fprintf(
        code == 0 ? stdout : stderr,
        "usage: %s [OPTION]...\n"
        "  --stop SECONDS   duration\n"
        "  --params FILE    YAML of names and values to change before the first step\n"
        "  --command-port N take changes of parameters while it runs, from this computer: a line of that "
        "YAML each\n"
        "  --csv FILE       write the recorded signals\n"
        "  --folder FOLDER  where relative file names of blocks are meant from\n"
        "  --realtime       begin each step at its time of the clock\n"
        "  --overrun WHAT   after a late step: skip (periods), catch_up, stop, degrade (record nothing)\n"
        "  --priority N     real-time priority 1 ... 99\n"
        "  --cpu N          run on that processor only\n"
        "  --list           print all parameters and variables, and what is fixed; end\n"
        "  --time           print the time per step\n",
        program);
    return code;
}

/// Set by SIGINT and SIGTERM: the step under way is the last one.
inline volatile std::sig_atomic_t is_asked_to_stop = 0;

namespace detail {
template <class Model, class = void> struct IsElaborated : std::false_type {};
template <class Model>
struct IsElaborated<Model, std::void_t<decltype(&Model::elaborate)>> : std::true_type {};

template <class Model, class = void> struct HasFolder : std::false_type {};
template <class Model> struct HasFolder<Model, std::void_t<decltype(Model::folder)>> : std::true_type {};

template <class Model, class = void> struct HasEvents : std::false_type {};
template <class Model>
struct HasEvents<Model, std::void_t<decltype(Model::before_event)>> : std::true_type {};

inline bool whole_number(const char* text, int least, int most, int& value) {
    char* end = nullptr;
    const long number = std::strtol(text, &end, 10);
    value = static_cast<int>(number);
    return end != text && *end == '\0' && number >= least && number <= most;
}

inline std::optional<realtime::Overrun> overrun_of(const std::string& name) {
    if (name == "skip") return realtime::Overrun::skip;
    if (name == "catch_up") return realtime::Overrun::catch_up;
    if (name == "stop") return realtime::Overrun::stop;
    if (name == "degrade") return realtime::Overrun::degrade;
    return std::nullopt;
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

/// Steps the model until its stop time; returns the exit code of the program.
template <class Model> int run(int argc, char** argv) {
    const auto model = std::make_unique<Model>();
    double stop = -1; // s; below 0: what the model says
    std::string csv_name, parameters, folder;
    bool shows_time = false, is_paced = false, lists = false;
    int port = -1;
    realtime::ThreadOptions thread;
    auto overrun = realtime::Overrun::skip;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const bool has_value = i + 1 < argc;
        if (option == "--help") return usage(argv[0], 0);
        if (option == "--list" || option == "--list-parameters") {
            lists = true;
        } else if (option == "--time") {
            shows_time = true;
        } else if (option == "--realtime") {
            is_paced = true;
        } else if (option == "--csv" && has_value) {
            csv_name = argv[++i];
        } else if (option == "--params" && has_value) {
            parameters = argv[++i];
        } else if (option == "--folder" && has_value) {
            folder = argv[++i];
        } else if (option == "--command-port" && has_value) {
            if (!detail::whole_number(argv[++i], 0, 65535, port)) return usage(argv[0], 2);
        } else if (option == "--overrun" && has_value) {
            const auto known = detail::overrun_of(argv[++i]);
            if (!known) return usage(argv[0], 2);
            overrun = *known;
        } else if (option == "--priority" && has_value) {
            if (!detail::whole_number(argv[++i], 1, 99, thread.priority)) return usage(argv[0], 2);
        } else if (option == "--cpu" && has_value) {
            if (!detail::whole_number(argv[++i], 0, 4095, thread.cpu)) return usage(argv[0], 2);
        } else if (option == "--stop" && has_value) {
            char* end = nullptr;
            stop = std::strtod(argv[++i], &end);
            if (end == argv[i] || *end != '\0' || !(stop >= 0)) return usage(argv[0], 2);
        } else {
            return usage(argv[0], 2);
        }
    }
    if constexpr (detail::HasFolder<Model>::value) {
        if (!folder.empty()) model->folder = folder.c_str();
    } else if (!folder.empty()) {
        std::fprintf(stderr, "no block of this model reads a file: leave --folder out\n");
        return 2;
    }
    double planned = Model::stop_time;
    std::string errors;
    if constexpr (detail::IsElaborated<Model>::value) {
        errors = model->elaborate(parameters);
        planned = model->planned_stop();
    } else if (!parameters.empty()) {
        errors = load_parameters(*model, parameters);
    }
    if (!errors.empty()) {
        std::fprintf(stderr, "%s%s", errors.c_str(), errors.back() == '\n' ? "" : "\n");
        return 1;
    }
    if (lists) {
        list_parameters(*model);
        return 0;
    }
    if (stop < 0) stop = planned;
    if (!std::isfinite(stop) && !is_paced) {
        std::fprintf(stderr, "the model names no stop time: give --stop SECONDS\n");
        return 2;
    }
    CsvFile csv;
    if (!csv_name.empty() && !csv.open(csv_name, model->recorded_table())) {
        std::fprintf(stderr, "cannot write %s\n", csv_name.c_str());
        return 1;
    }
    std::optional<CommandPort> commands;
    if (port >= 0) {
        commands.emplace(*model);
        if (const std::string error = commands->listen(port); !error.empty()) {
            std::fprintf(stderr, "%s\n", error.c_str());
            return 1;
        }
        std::fprintf(stderr, "takes commands at 127.0.0.1:%d\n", commands->port());
    }
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { is_asked_to_stop = 1; });
    const std::int64_t steps = kernels::steps_before(stop, Model::period);
    bool good = model->initialize();
    std::optional<realtime::Pacer> pacer;
    if (is_paced) {
        pacer.emplace(static_cast<realtime::Nanoseconds>(std::llround(Model::period * 1e9)), overrun);
        for (const std::string& refused : realtime::prepare_thread(thread))
            std::fprintf(stderr, "warning: %s\n", refused.c_str());
        pacer->start();
    }
    const auto record = [&] {
        if (csv.is_open() && !(pacer && pacer->is_degraded())) csv.row(*model);
    };
    if constexpr (detail::HasEvents<Model>::value) model->before_event = record;
    const auto begin = std::chrono::steady_clock::now();
    std::int64_t done = 0;
    for (; good && done < steps && !is_asked_to_stop; ++done) {
        if (pacer && !pacer->wait()) break;
        if (commands) commands->apply(*model);
        good = model->output();
        if (good) record();
        good = good && model->update();
        if (pacer) pacer->end_step();
    }
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    model->terminate();
    for (const Quantity& q : model->check_table())
        std::printf("%s = %.17g\n", q.name, read(model->data(q), q.type, 0));
    if (shows_time && done > 0) std::printf("%.3f ns per step\n", wall * 1e9 / static_cast<double>(done));
    if (pacer) std::fputs(realtime::report(pacer->statistics()).c_str(), stdout);
    if (!good) {
        const std::string block = model->failed_block();
        std::fprintf(stderr, "stopped at t = %g s: %s%s%s\n", model->time(), block.c_str(),
                     block.empty() ? "" : ": ", model->failure());
    }
    if (!csv.close()) {
        std::fprintf(stderr, "%s could not be written completely\n", csv_name.c_str());
        return 1;
    }
    const bool is_late = pacer && good && done < steps && !is_asked_to_stop;
    if (is_late)
        std::fprintf(stderr, "stopped at t = %g s: a step ended after its deadline\n", model->time());
    return good && !is_late ? 0 : 1;
}

} // namespace bf::generated
