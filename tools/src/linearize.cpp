// bf linearize: the matrices of a model between named signals.
#include "linearize.hpp"

#include "bf/analysis/loop_gain.hpp"
#include "bf/analysis/response.hpp"
#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/recording/export.hpp"
#include "bf/run/snapshot.hpp"
#include "files.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace {

using analysis::LinearSystem;
using Json = nlohmann::ordered_json;

Json rows_of(const analysis::Matrix& matrix) {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        Json row = Json::array();
        for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
        rows.push_back(std::move(row));
    }
    return rows;
}
std::vector<double> numbers_of(const analysis::Matrix& matrix) {
    return {matrix.data(), matrix.data() + matrix.size()};
}

Json to_json(const LinearSystem& s) {
    return {{"A", rows_of(s.A)},
            {"B", rows_of(s.B)},
            {"C", rows_of(s.C)},
            {"D", rows_of(s.D)},
            {"states", s.states},
            {"inputs", s.inputs},
            {"outputs", s.outputs},
            {"input_units", s.input_units},
            {"output_units", s.output_units},
            {"period", s.period},
            {"time", s.time},
            {"x", numbers_of(s.x)},
            {"u", numbers_of(s.u)},
            {"y", numbers_of(s.y)},
            {"differenced", s.differenced},
            {"held", s.held},
            {"kinks", s.kinks}};
}

/// Names as MATLAB's `ss` has them.
std::vector<recording::MatVariable> to_mat(const LinearSystem& s) {
    std::vector<recording::MatVariable> all;
    const auto matrix = [&](const char* name, const analysis::Matrix& m) {
        all.push_back(
            {name, static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols()), numbers_of(m)});
    };
    const auto texts = [&](const char* name, const std::vector<std::string>& list) {
        if (!list.empty()) all.push_back({name, 0, 0, {}, list});
    };
    matrix("A", s.A);
    matrix("B", s.B);
    matrix("C", s.C);
    matrix("D", s.D);
    all.push_back({"Ts", 1, 1, {s.period}});
    matrix("x", s.x);
    matrix("u", s.u);
    matrix("y", s.y);
    texts("StateName", s.states);
    texts("InputName", s.inputs);
    texts("OutputName", s.outputs);
    texts("InputUnit", s.input_units);
    texts("OutputUnit", s.output_units);
    return all;
}

std::string padded(std::string text, std::size_t width) {
    text.resize(std::max(text.size(), width), ' ');
    return text;
}

void print(const char* name, const analysis::Matrix& matrix, const std::vector<std::string>& rows,
           const std::vector<std::string>& columns) {
    std::size_t first = 2;
    for (const auto& row : rows) first = std::max(first, row.size() + 2);
    std::string line = padded(name, first + 2);
    for (const auto& column : columns) line += padded(column, std::max<std::size_t>(column.size(), 11) + 2);
    std::printf("\n%s\n", escape::terminal(line).c_str());
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        line = padded("  " + rows[static_cast<std::size_t>(i)], first + 2);
        for (Eigen::Index j = 0; j < matrix.cols(); ++j)
            line += padded(number(matrix(i, j)),
                           std::max<std::size_t>(columns[static_cast<std::size_t>(j)].size(), 11) + 2);
        std::printf("%s\n", escape::terminal(line).c_str());
    }
}

void print(const LinearSystem& s) {
    std::printf("at %s s, ", number(s.time).c_str());
    if (s.period > 0)
        std::printf("from sample to sample of %s s\n", number(s.period).c_str());
    else
        std::printf("in continuous time\n");
    constexpr std::size_t most = 12; // that fit a terminal
    if (s.states.size() <= most && s.inputs.size() <= most) {
        print("A", s.A, s.states, s.states);
        print("B", s.B, s.states, s.inputs);
        print("C", s.C, s.outputs, s.states);
        print("D", s.D, s.outputs, s.inputs);
    } else {
        std::printf("%zu states, %zu inputs, %zu outputs; -o FILE writes the matrices\n", s.states.size(),
                    s.inputs.size(), s.outputs.size());
    }
    std::printf("\npoles\n");
    for (const auto& p : analysis::poles(s)) std::printf("  %s\n", root_text(p).c_str());
}

/// At most eight of them.
std::string list(const std::vector<std::string>& names) {
    constexpr std::size_t most = 8;
    std::string text;
    for (std::size_t i = 0; i < std::min(names.size(), most); ++i) text += (i == 0 ? "" : ", ") + names[i];
    return names.size() > most ? text + ", " + std::to_string(names.size() - most) + " more" : text;
}

void execute(const LinearOptions& options, const std::string& output) {
    if (!output.empty()) {
        if (!is_data(output)) refuse_format(output, ".yaml, .json or .mat");
        refuse_overwriting({{"-o", output}}, files_of(options.model.file));
    }
    const LinearSystem system = options.system();
    if (output.empty()) return print(system);
    write_data(to_json(system), to_mat(system), output);
}

} // namespace

bool is_data(const std::string& file) {
    const auto extension = std::filesystem::path(file).extension();
    return extension == ".yaml" || extension == ".json" || extension == ".mat";
}

void refuse_format(const std::string& file, const std::string& endings) {
    throw CommandError("cannot tell the format of " + file + ": give a name that ends in " + endings);
}

void write_data(const Json& all, const std::vector<recording::MatVariable>& variables,
                const std::string& output) {
    OutputFile written(output);
    const auto extension = std::filesystem::path(output).extension();
    if (extension == ".mat") {
        recording::write_mat(variables, written.path());
    } else {
        std::ofstream out(written.path());
        if (extension == ".json")
            out << to_text(all);
        else
            for (const auto& [key, value] : all.items()) out << key << ": " << value.dump() << "\n";
        if (!out.flush()) throw CommandError("cannot write " + output + ": the disk is full or gone");
    }
    written.commit();
    std::printf("%s\n", output.c_str());
}

std::string root_text(std::complex<double> root) {
    // What is 0 but for rounding.
    const auto rounded = [&](double part) {
        return std::abs(part) < 1e-12 * std::max(1.0, std::abs(root)) ? 0 : part;
    };
    const double real = rounded(root.real()), imaginary = rounded(root.imag());
    const std::string text = number(real);
    return imaginary == 0 ? text : text + (imaginary < 0 ? " - " : " + ") + number(std::abs(imaginary)) + "j";
}

void LinearOptions::add_to(CLI::App& app, bool has_loop) {
    model.add_to(app);
    const auto signals = [&](const char* name, std::vector<std::string>& to, const char* what) {
        return app.add_option(name, to, what)->type_name("SIGNAL")->allow_extra_args(false);
    };
    auto* f = signals(
        "--from", from,
        "input: a signal to which it is added, or one element of it, a[3]; may be repeated; otherwise all "
        "inputs of the root");
    auto* t = signals(
        "--to", to,
        "output: a signal, or a state as block.state; may be repeated; otherwise all outputs of the root");
    signals("--open", open, "a signal that is cut: what reads it gets the input that is added there alone");
    if (has_loop)
        app.add_option("--loop", loop,
                       "the loop through this signal, cut there: its gain as of negative feedback, 1 + L = 0")
            ->type_name("SIGNAL")
            ->excludes(f)
            ->excludes(t);
    add_operating_point_to(app);
}

void LinearOptions::add_operating_point_to(CLI::App& app) {
    app.add_option("--at", at, "operating point: after so many seconds of the run")
        ->check(between(0, 1e9))
        ->type_name("SECONDS");
    app.add_option("--from-snapshot", snapshot, "begin with a snapshot that bf run wrote")->type_name("FILE");
}

void tell_how_exact(const analysis::LinearSystem& system) {
    const auto tell = [](const std::string& what, const std::vector<std::string>& names) {
        if (!names.empty())
            std::fprintf(stderr, "%s %s\n", what.c_str(), escape::terminal(list(names)).c_str());
    };
    tell("by central differences:", system.differenced);
    tell("held:", system.held);
    tell("a jump or corner is right here, the derivative is that of one side:", system.kinks);
}

analysis::LinearSystem LinearOptions::system() const {
    const LoadedModel loaded = load_model(model);
    const Waiting waiting("linearising " + model.file);
    Simulation run(loaded.diagram);
    go_to_operating_point(run);
    auto found =
        loop.empty()
            ? analysis::linearize(run, {.from = from, .to = to, .open = open, .all_states = all_states})
            : analysis::loop_gain(run, loop, open);
    tell_how_exact(found);
    if (!loop.empty() && analysis::is_nothing(found)) {
        go_to_operating_point(run);
        throw CommandError(analysis::why_nothing_returns(run, loop, open));
    }
    return found;
}

void LinearOptions::go_to_operating_point(Simulation& run) const {
    run.start();
    if (!snapshot.empty()) {
        const std::string bytes = read_text_file(snapshot);
        restore_snapshot(run, std::as_bytes(std::span(bytes)), snapshot);
    }
    if (!run.run_until(std::max(at, run.time())))
        throw CommandError("the run to the operating point ends at " + number(run.time()) +
                           " s: " + run.failure());
}

analysis::LinearSystem LinearOptions::single() const {
    auto found = system();
    if (found.inputs.size() != 1 || found.outputs.size() != 1)
        throw CommandError("a response is from one input to one output, but there are the inputs " +
                           list(found.inputs) + " and the outputs " + list(found.outputs) +
                           "; choose with --from and --to, elements as a[3]");
    return found;
}

void add_linearize(CLI::App& app) {
    auto* command = app.add_subcommand(
        "linearize", "matrices A, B, C, D of a model by name, between any signals, at an operating point");
    auto options = std::make_shared<LinearOptions>();
    auto output = std::make_shared<std::string>();
    options->add_to(*command, false);
    command->add_flag("--all-states", options->all_states,
                      "also those on no path from an input to an output");
    command->add_option("-o,--output", *output, "YAML, JSON or MAT-file; otherwise it is printed")
        ->type_name("FILE");
    command->footer("Examples:\n"
                    "  bf linearize docs/start/motor.yaml --from reference --to motor.omega\n"
                    "  bf linearize docs/start/motor.yaml --from controller.voltage --to motor.omega --open "
                    "controller.voltage -o motor.mat");
    command->callback([options, output] { execute(*options, *output); });
}

} // namespace bf::tools
