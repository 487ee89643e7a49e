// bf export-fmu: a model as an FMU, which other simulators run.
#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/codegen/fmu.hpp"
#include "bf/fmi/archive.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/view/draw.hpp"
#include "files.hpp"
#include "picture.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <future>
#include <mutex>
#include <set>
#include <sys/utsname.h>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct ExportOptions {
    ModelOptions model;
    std::string output;
    int version = 3;
    std::vector<std::string> targets;
    bool has_no_binary = false;
};

using Role = codegen::FmuVariable::Role;

/// A matrix row by row.
std::vector<double> row_by_row(const std::vector<double>& elements, int rows, int cols) {
    std::vector<double> all;
    for (int i = 0; i < static_cast<int>(elements.size()); ++i)
        all.push_back(elements[static_cast<std::size_t>(i % cols * rows + i / cols)]);
    return all;
}

fmi::Variable variable_of(const codegen::FmuVariable& v, std::uint32_t reference) {
    static constexpr fmi::Type types[] = {fmi::Type::float64, fmi::Type::float32, fmi::Type::int8,
                                          fmi::Type::uint8,   fmi::Type::int16,   fmi::Type::uint16,
                                          fmi::Type::int32,   fmi::Type::uint32,  fmi::Type::boolean};
    const bool is_real = v.type == Type::float64 || v.type == Type::float32;
    const auto changing = is_real ? fmi::Variability::continuous : fmi::Variability::discrete;
    fmi::Variable its{.name = fmi::structured_name(v.name),
                      .unit = v.unit,
                      .doc = v.doc,
                      .reference = reference,
                      .type = types[static_cast<std::size_t>(v.type)]};
    if (v.cols != 1)
        its.dimensions = {v.rows, v.cols};
    else if (v.rows != 1)
        its.dimensions = {v.rows};
    if (std::isfinite(v.limits.minimum)) its.minimum = v.limits.minimum;
    if (std::isfinite(v.limits.above)) its.minimum = v.limits.above;
    if (std::isfinite(v.limits.maximum)) its.maximum = v.limits.maximum;
    switch (v.role) {
    case Role::input:
        its.causality = fmi::Causality::input;
        its.variability = changing;
        its.start = row_by_row(v.start, v.rows, v.cols);
        break;
    case Role::parameter:
    case Role::fixed:
        its.causality = fmi::Causality::parameter;
        its.variability = v.role == Role::fixed ? fmi::Variability::fixed : fmi::Variability::tunable;
        its.initial = fmi::Initial::exact;
        its.start = row_by_row(v.start, v.rows, v.cols);
        break;
    case Role::calculated:
        its.causality = fmi::Causality::calculated_parameter;
        its.variability = fmi::Variability::tunable;
        its.initial = fmi::Initial::calculated;
        break;
    case Role::crossings:
    case Role::state:
    case Role::rate:
    case Role::output:
    case Role::signal:
        its.causality = v.role == Role::output ? fmi::Causality::output : fmi::Causality::local;
        its.variability = changing;
        its.initial = fmi::Initial::calculated;
        break;
    }
    return its;
}

fmi::Description description_of(const LoadedModel& loaded, const codegen::FmuCode& code, int version) {
    const Diagram& diagram = loaded.diagram;
    fmi::Description d{.version = version, .name = diagram.name, .token = code.token};
    d.tool = "BlockFactory " BF_VERSION;
    if (std::isfinite(diagram.stop)) d.stop = diagram.stop;
    d.step = diagram.step;
    d.co_simulation = fmi::Interface{.identifier = code.identifier,
                                     .has_state = true,
                                     .can_serialize = true,
                                     .takes_any_step = true,
                                     .returns_early = true,
                                     .internal_step = diagram.step};
    d.model_exchange = fmi::Interface{.identifier = code.identifier,
                                      .has_state = true,
                                      .can_serialize = true,
                                      .needs_completed_step = false};
    d.co_simulation->sources = d.model_exchange->sources = code.sources;
    d.variables.push_back(
        {.name = "time", .unit = "s", .doc = "simulated time", .causality = fmi::Causality::independent});
    std::map<std::string, int> inputs;
    std::vector<int> states;
    for (const auto& v : code.variables) {
        const auto number = static_cast<int>(d.variables.size());
        if (v.role == Role::input) inputs[v.name] = number;
        if (v.role == Role::output) {
            fmi::Unknown output{number, std::vector<int>()};
            for (const auto& input : v.inputs) output.dependencies->push_back(inputs.at(input));
            d.outputs.push_back(output);
        }
        if (v.role == Role::state) states.push_back(number);
        if (v.role == Role::rate) d.derivatives.push_back({number});
        if (v.role == Role::crossings) {
            d.indicators.push_back(number);
            d.event_indicators = v.rows;
        }
        if (v.role != Role::input && v.role != Role::parameter && v.role != Role::fixed &&
            v.role != Role::signal && v.role != Role::crossings)
            d.initial_unknowns.push_back({number});
        d.variables.push_back(variable_of(v, static_cast<std::uint32_t>(number)));
        if (v.role == Role::rate) d.variables.back().derivative_of = states[d.derivatives.size() - 1];
    }
    std::set<std::string> names;
    for (const auto& v : d.variables)
        if (!names.insert(v.name).second)
            throw CommandError("no FMU can be made of '" + diagram.name +
                               "': two of its variables would be called \"" + v.name +
                               "\" there; rename one");
    return version == 2 ? fmi::scalars_of(d) : d;
}

std::string build_description(const codegen::FmuCode& code) {
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
        "  <BuildConfiguration modelIdentifier=\"" +
        code.identifier +
        "\">\n    <SourceFileSet language=\"C++17\" compilerOptions=\"-ffp-contract=off\">\n";
    for (const auto& source : code.sources)
        text += "      <SourceFile name=\"" + escape::xml(source) + "\"/>\n";
    return text + "    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n";
}

/// What people read who look into the archive.
std::string page(const LoadedModel& loaded, const fmi::Description& d) {
    std::string text = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                       escape::xml(d.name) + "</title></head><body>\n<h1>" + escape::xml(d.name) +
                       "</h1>\n<p>An FMU of FMI " + std::to_string(d.version) +
                       ".0 for co-simulation and model exchange, made by " + escape::xml(d.tool) +
                       " from the model " + escape::xml(loaded.source.file.filename().string()) +
                       ". It steps every " + number(*d.step) +
                       " s; between two of its steps outputs keep their values.</p>\n"
                       "<p><img src=\"diagram.svg\" alt=\"block diagram\"></p>\n"
                       "<table>\n<tr><th>variable</th><th>size</th><th>unit</th><th>what</th></tr>\n";
    for (const auto& v : d.variables) {
        std::string size;
        for (const int n : v.dimensions) size += (size.empty() ? "" : " &times; ") + std::to_string(n);
        text += "<tr><td>" + escape::xml(v.name) + "</td><td>" + size + "</td><td>" + escape::xml(v.unit) +
                "</td><td>" + escape::xml(v.doc) + "</td></tr>\n";
    }
    return text + "</table>\n</body></html>\n";
}

std::string machine() {
    utsname system{};
    uname(&system);
    return system.machine;
}

/// Runs a compiler, several at once; throws CommandError with what it says.
void compile(const std::vector<std::string>& commands, const fs::path& folder, const std::string& target) {
    std::mutex mutex;
    std::size_t next = 0;
    const auto work = [&] {
        for (;;) {
            std::size_t at = 0;
            {
                const std::lock_guard lock(mutex);
                if (next == commands.size()) return true;
                at = next++;
            }
            const std::string log = (folder / ("log" + std::to_string(at))).string();
            if (std::system((commands[at] + " >" + escape::shell(log) + " 2>&1").c_str()) != 0)
                throw CommandError(
                    "the code of the FMU cannot be compiled for " + target + ":\n" +
                    escape::shortened(read_text_file(log), 2000) +
                    "\nset CXX to a compiler of C++17, or leave the binary out by --sources-only");
        }
    };
    std::vector<std::future<bool>> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        workers.push_back(std::async(std::launch::async, work));
    for (auto& worker : workers) worker.get();
}

/// The library of that machine.
std::string compiled(const codegen::FmuCode& code, const std::string& target, const fs::path& sources) {
    const Waiting waiting("compiling the FMU for " + target);
    const fmi::TemporaryFolder folder("compile");
    const char* const chosen = std::getenv("CXX");
    const std::string compiler = target != machine() ? target + "-linux-gnu-g++"
                                 : chosen && *chosen ? chosen
                                                     : "c++";
    std::string options = " -fPIC -fvisibility=hidden";
    for (const auto& option : code.options) options += " " + option;
    std::vector<std::string> commands;
    std::string objects;
    for (std::size_t i = 0; i < code.sources.size(); ++i) {
        const std::string object = (folder.path() / (std::to_string(i) + ".o")).string();
        commands.push_back("cd " + escape::shell(sources.string()) + " && " + compiler + options +
                           " -I. -c " + escape::shell(code.sources[i]) + " -o " + escape::shell(object));
        objects += " " + escape::shell(object);
    }
    compile(commands, folder.path(), target);
    // It brings the C++ library along, and shows others nothing but the functions of the standard.
    const auto library = folder.path() / "library.so";
    compile({compiler + " -shared -static-libstdc++ -static-libgcc -Wl,--exclude-libs,ALL -Wl,-s" + objects +
             " -o " + escape::shell(library.string())},
            folder.path(), target);
    return read_text_file(library);
}

std::string platform(const std::string& target, int version) {
    if (version == 2 && target == "x86_64") return "linux64";
    return target + "-linux";
}

void execute(const ExportOptions& options) {
    const LoadedModel loaded = load_model(options.model);
    const auto code = codegen::generate_fmu(loaded.diagram, options.version, generation_options(loaded));
    const auto description = description_of(loaded, code, options.version);
    const std::string output =
        !options.output.empty() ? options.output : fs::path(options.model.file).stem().string() + ".fmu";
    refuse_overwriting({{"-o", output}}, {options.model.file});

    fmi::Contents contents;
    contents["modelDescription.xml"] = fmi::to_xml(description);
    for (const auto& [name, text] : code.files) contents["sources/" + name] = text;
    if (options.version == 3) contents["sources/buildDescription.xml"] = build_description(code);
    contents["documentation/index.html"] = page(loaded, description);
    contents["documentation/licenses/license.txt"] =
        "The files under sources/bf are a part of BlockFactory, licensed under the Apache License 2.0\n"
        "(SPDX-License-Identifier: Apache-2.0). All others were made from the model, whose authors license "
        "them.\n";

    const fmi::TemporaryFolder folder("export");
    formats::Files texts = loaded.source.texts;
    const auto drawing =
        editor::draw(formats::read_yaml(loaded.source.file, texts), "", loaded.diagram, {}, {});
    contents["documentation/diagram.svg"] = editor::to_svg(drawing, false);
    try {
        const auto icon = folder.path() / "icon.png";
        save_picture(drawing, false, icon.string());
        contents[options.version == 2 ? "model.png" : "terminalsAndIcons/icon.png"] = read_text_file(icon);
        if (options.version == 3)
            contents["terminalsAndIcons/icon.svg"] = contents["documentation/diagram.svg"];
    } catch (const CommandError&) { // without librsvg there is no icon
    }
    if (!options.has_no_binary) {
        const auto sources = folder.path() / "sources";
        codegen::write(code.files, sources);
        auto targets = options.targets;
        if (targets.empty()) targets = {machine()};
        for (const auto& target : targets)
            contents["binaries/" + platform(target, options.version) + "/" + code.identifier + ".so"] =
                compiled(code, target, sources);
    }
    fmi::write_archive(contents, output);
    std::printf("%s: FMI %d.0, co-simulation and model exchange, %zu variables, steps of %s s\n",
                output.c_str(), options.version, description.variables.size(),
                number(loaded.diagram.step).c_str());
}

} // namespace

void add_export_fmu(CLI::App& app) {
    auto* command = app.add_subcommand("export-fmu", "write a model as an FMU, which other simulators run");
    auto options = std::make_shared<ExportOptions>();
    options->model.add_to(*command);
    command->add_option("-o,--output", options->output, "file; otherwise MODEL.fmu in this folder")
        ->type_name("FILE");
    command->add_option("--fmi", options->version, "version of the standard: 3 (by default) or 2")
        ->type_name("VERSION")
        ->check(CLI::IsMember(std::set<int>{2, 3}).description(""));
    command
        ->add_option("--target", options->targets,
                     "machines that it has binaries for: x86_64, aarch64; otherwise this one")
        ->delimiter(',')
        ->type_name("MACHINE,...")
        ->check(CLI::IsMember(std::set<std::string>{"x86_64", "aarch64"}).description(""));
    command->add_flag("--sources-only", options->has_no_binary, "no binaries: importers compile it");
    command->footer("It holds its sources, too. Example: bf export-fmu examples/dc_motor/model.yaml");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
