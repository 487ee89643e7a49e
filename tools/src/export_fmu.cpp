// bf export-fmu: a model as an FMU, which other simulators run.
#include "export_fmu.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/codegen/fmu.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/view/draw.hpp"
#include "block_model.hpp"
#include "bundle.hpp"
#include "files.hpp"
#include "picture.hpp"
#include "points.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <future>
#include <mutex>
#include <set>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct ExportOptions {
    ModelOptions model;
    FmuOptions fmu;
    std::string output;
};

using VariableRole = codegen::FmuVariable::Role;

/// A matrix row by row.
std::vector<double> row_by_row(const std::vector<double>& elements, int rows, int cols) {
    std::vector<double> all;
    for (int i = 0; i < static_cast<int>(elements.size()); ++i)
        all.push_back(elements[static_cast<std::size_t>(fmi::column_by_column(i, rows, cols))]);
    return all;
}

fmi::Variable variable_of(const codegen::FmuVariable& v, std::uint32_t reference) {
    const bool is_real = v.type == Type::float64 || v.type == Type::float32;
    const auto changing = is_real ? fmi::Variability::continuous : fmi::Variability::discrete;
    fmi::Variable its{.name = fmi::structured_name(v.name),
                      .unit = v.unit,
                      .doc = v.doc,
                      .reference = reference,
                      .type = type_of(v.type),
                      .dimensions = v.cols_by >= 0                  ? std::vector{v.rows, v.cols}
                                    : v.rows_by >= 0 && v.cols == 1 ? std::vector{v.rows}
                                                                    : dimensions_of(v.rows, v.cols)};
    its.dimension_by = {v.rows_by, v.cols_by};
    its.dimension_by.resize(its.dimensions.size());
    if (std::isfinite(v.limits.minimum)) its.minimum = v.limits.minimum;
    if (std::isfinite(v.limits.above)) its.minimum = v.limits.above;
    if (std::isfinite(v.limits.maximum)) its.maximum = v.limits.maximum;
    switch (v.role) {
    case VariableRole::input:
        its.causality = fmi::Causality::input;
        its.variability = changing;
        its.start = row_by_row(v.start, v.rows, v.cols);
        break;
    case VariableRole::parameter:
    case VariableRole::fixed:
        its.causality = fmi::Causality::parameter;
        its.variability = v.role == VariableRole::fixed ? fmi::Variability::fixed : fmi::Variability::tunable;
        its.initial = fmi::Initial::exact;
        its.start = row_by_row(v.start, v.rows, v.cols);
        break;
    case VariableRole::calculated:
        its.causality = fmi::Causality::calculated_parameter;
        its.variability = fmi::Variability::tunable;
        its.initial = fmi::Initial::calculated;
        break;
    case VariableRole::crossings:
    case VariableRole::state:
    case VariableRole::rate:
    case VariableRole::output:
    case VariableRole::signal:
        its.causality = v.role == VariableRole::output ? fmi::Causality::output : fmi::Causality::local;
        its.variability = changing;
        its.initial = fmi::Initial::calculated;
        break;
    }
    if (!v.clocks.empty()) its.variability = fmi::Variability::discrete;
    // One start value is that of all elements, how many there may be.
    if (its.has_other_sizes() &&
        std::adjacent_find(its.start.begin(), its.start.end(), std::not_equal_to<>()) == its.start.end())
        its.start.resize(std::min<std::size_t>(its.start.size(), 1));
    return its;
}

/// Can the states of all blocks be saved?
bool can_be_saved(const Diagram& diagram) {
    try {
        Simulation(diagram).snapshot();
        return true;
    } catch (const std::exception&) {
        return false;
    }
}

/// The type with these names of values, which becomes one of the description's where it is new: the first
/// variable that has it gives it its name.
std::string enumeration(fmi::Description& d, const codegen::FmuVariable& v) {
    if (v.names.empty()) return {};
    for (const auto& known : d.enumerations)
        if (known.items == v.names) return known.name;
    d.enumerations.push_back({"type of " + fmi::structured_name(v.name), v.names});
    return d.enumerations.back().name;
}

/// What a variable of the model says of itself, as a structural parameter with these values.
fmi::Variable structural_parameter(const std::string& name, std::vector<std::uint64_t> values,
                                   const Diagram& diagram) {
    fmi::Variable v{.name = fmi::structured_name(name),
                    .type = fmi::Type::uint64,
                    .causality = fmi::Causality::structural_parameter,
                    .variability = fmi::Variability::fixed,
                    .initial = fmi::Initial::exact,
                    .start = {static_cast<double>(values.front())}};
    for (const auto& its : diagram.definitions)
        if (its.path == name) v.doc = its.about();
    v.minimum = static_cast<double>(*std::ranges::min_element(values));
    v.maximum = static_cast<double>(*std::ranges::max_element(values));
    return v;
}

fmi::Description description_of(const std::vector<FmuVariant>& variants, const codegen::FmuChoice& choice,
                                const codegen::FmuCode& code) {
    const Diagram& diagram = variants.front().loaded.diagram;
    const int version = choice.version;
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
                                      .has_derivatives = code.has_derivatives,
                                      .has_adjoint = code.has_derivatives,
                                      .needs_completed_step = false};
    d.co_simulation->sources = d.model_exchange->sources = code.sources;
    if (!code.has_model_exchange) d.model_exchange.reset();
    if (code.is_hosted) {
        const bool is_saved = can_be_saved(diagram);
        for (auto* its : {&d.co_simulation, &d.model_exchange}) {
            if (!*its) continue;
            (*its)->sources.clear();
            (*its)->has_state = (*its)->can_serialize = is_saved;
        }
    }
    d.variables.push_back(
        {.name = "time", .unit = "s", .doc = "simulated time", .causality = fmi::Causality::independent});
    d.co_simulation->has_event_mode = !code.clocks.empty();
    std::map<std::string, int> known{{"time", 0}};
    std::vector<int> states;
    const auto first_clock = static_cast<int>(code.variables.size()) + 1,
               first_structural = first_clock + static_cast<int>(code.clocks.size());
    for (const auto& v : code.variables) {
        const auto number = static_cast<int>(d.variables.size());
        if (v.role == VariableRole::input || v.role == VariableRole::state) known[v.name] = number;
        if (v.role == VariableRole::output) {
            fmi::Unknown output{number, std::vector<int>()};
            for (const int clock : v.clocks) output.dependencies->push_back(first_clock + clock);
            d.outputs.push_back(output);
        }
        if (v.role == VariableRole::state) states.push_back(number);
        if (v.role == VariableRole::rate) d.derivatives.push_back({number});
        if (v.role == VariableRole::crossings) {
            d.indicators.push_back(number);
            d.event_indicators = v.rows;
        }
        if (v.role != VariableRole::input && v.role != VariableRole::parameter &&
            v.role != VariableRole::fixed && v.role != VariableRole::signal &&
            v.role != VariableRole::crossings && v.clocks.empty())
            d.initial_unknowns.push_back({number});
        d.variables.push_back(variable_of(v, static_cast<std::uint32_t>(number)));
        for (int& by : d.variables.back().dimension_by)
            if (by >= 0) by += first_structural;
        if (!v.names.empty()) {
            d.variables.back().type = fmi::Type::enumeration;
            d.variables.back().declared_type = enumeration(d, v);
        }
        if (v.role == VariableRole::rate) d.variables.back().derivative_of = states[d.derivatives.size() - 1];
        for (const int clock : v.clocks) d.variables.back().clocks.push_back(first_clock + clock);
    }
    auto output = d.outputs.begin();
    for (const auto& v : code.variables)
        if (v.role == VariableRole::output) {
            for (const auto& name : v.dependencies)
                if (const auto at = known.find(name); at != known.end()) // what is left out is no variable
                    output->dependencies->push_back(at->second);
            std::ranges::sort(*output->dependencies);
            ++output;
        }
    for (const auto& clock : code.clocks)
        d.variables.push_back(
            {.name = fmi::structured_name(clock.name),
             .doc = "ticks every " + number(static_cast<double>(clock.ticks) * diagram.step) + " s",
             .reference = static_cast<std::uint32_t>(d.variables.size()),
             .type = fmi::Type::clock,
             .causality = fmi::Causality::input,
             .variability = fmi::Variability::discrete,
             .ticks = fmi::Ticks{.interval = static_cast<double>(clock.ticks) * diagram.step,
                                 .shift = static_cast<double>(clock.offset) * diagram.step,
                                 .resolution = clock.resolution,
                                 .interval_count = clock.interval,
                                 .shift_count = clock.shift}});
    for (std::size_t p = 0; p < choice.structural.size(); ++p) {
        std::vector<std::uint64_t> values;
        for (const auto& variant : variants) values.push_back(variant.structure[p]);
        d.variables.push_back(structural_parameter(choice.structural[p], values, diagram));
        d.variables.back().reference = static_cast<std::uint32_t>(d.variables.size() - 1);
    }
    for (const auto& v : d.variables) {
        try {
            if (v.unit.empty()) continue;
            const Unit unit = detail::parse_unit(v.unit);
            std::ranges::copy(unit.si, d.units[v.unit].exponents.begin());
        } catch (const std::invalid_argument&) { // a text for people
        }
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

/// How the icon lies, and all inputs and all outputs as one terminal each, whose members an importer connects
/// by their names: FMI 3.0, section 2.4.9.
std::string terminals(const fmi::Description& d, const editor::Rectangle& picture) {
    const std::string corners =
        " x1=\"0\" y1=\"0\" x2=\"" + number(picture.width) + "\" y2=\"" + number(picture.height) + "\"";
    std::string all;
    for (const auto& [causality, name] :
         {std::pair{fmi::Causality::input, "inputs"}, std::pair{fmi::Causality::output, "outputs"}}) {
        std::string members;
        for (const auto& v : d.variables)
            if (v.causality == causality)
                members += "      <TerminalMemberVariable variableName=\"" + escape::xml(v.name) +
                           "\" memberName=\"" + escape::xml(v.name) + "\" variableKind=\"signal\"/>\n";
        if (!members.empty())
            all += std::string("    <Terminal name=\"") + name + "\" matchingRule=\"bus\">\n" + members +
                   "    </Terminal>\n";
    }
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiTerminalsAndIcons fmiVersion=\"3.0\">\n"
           "  <GraphicalRepresentation>\n    <CoordinateSystem" +
           corners + " suggestedScalingFactorTo_mm=\"0.1\"/>\n    <Icon" + corners +
           "/>\n  </GraphicalRepresentation>\n" +
           (all.empty() ? "" : "  <Terminals>\n" + all + "  </Terminals>\n") + "</fmiTerminalsAndIcons>\n";
}

/// What people read who look into the archive.
std::string page(const LoadedModel& loaded, const fmi::Description& d) {
    std::string text = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                       escape::xml(d.name) + "</title></head><body>\n<h1>" + escape::xml(d.name) +
                       "</h1>\n<p>An FMU of FMI " + std::to_string(d.version) + ".0 for co-simulation" +
                       (d.model_exchange ? " and model exchange" : "") + ", made by " + escape::xml(d.tool) +
                       " from the model " + escape::xml(loaded.source.file.filename().string()) +
                       ". It steps every " + number(*d.step) +
                       " s; between two of its steps outputs keep their values.</p>\n"
                       "<p><img src=\"diagram.svg\" alt=\"block diagram\"></p>\n"
                       "<table>\n<tr><th>variable</th><th>size</th><th>unit</th><th>what</th></tr>\n";
    for (const auto& v : d.variables) {
        std::string size;
        for (std::size_t i = 0; i < v.dimensions.size(); ++i)
            size += (size.empty() ? "" : " &times; ") +
                    (v.dimension_by[i] < 0
                         ? std::to_string(v.dimensions[i])
                         : escape::xml(d.variables[static_cast<std::size_t>(v.dimension_by[i])].name));
        text += "<tr><td>" + escape::xml(v.name) + "</td><td>" + size + "</td><td>" + escape::xml(v.unit) +
                "</td><td>" + escape::xml(v.doc) + "</td></tr>\n";
    }
    return text + "</table>\n</body></html>\n";
}

/// Runs a compiler, several at once; throws CommandError with what it says, and the remedy.
void compile(const std::vector<std::string>& commands, const fs::path& folder, const std::string& target,
             const char* remedy) {
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
                throw CommandError("the code of the FMU cannot be compiled for " + target + ":\n" +
                                   escape::shortened(read_text_file(log), 2000) + "\n" + remedy);
        }
    };
    std::vector<std::future<bool>> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        workers.push_back(std::async(std::launch::async, work));
    for (auto& worker : workers) worker.get();
}

/// The library of that machine, which needs those libraries beside it.
std::string compiled(const codegen::FmuCode& code, const std::string& target, const fs::path& sources,
                     const std::map<std::string, fs::path>& libraries) {
    const Waiting waiting("compiling the FMU for " + target);
    const fmi::TemporaryFolder folder("compile");
    const char* const chosen = std::getenv("CXX");
    const std::string compiler = target != machine() ? target + "-linux-gnu-g++"
                                 : chosen && *chosen ? chosen
                                                     : "c++";
    std::string options = " -fPIC -fvisibility=hidden";
    for (const auto& option : code.options) options += " " + option;
    const CoreOptions core = code.is_hosted ? core_options() : CoreOptions();
    std::vector<std::string> commands;
    std::string objects;
    for (std::size_t i = 0; i < code.sources.size(); ++i) {
        const std::string object = (folder.path() / (std::to_string(i) + ".o")).string();
        commands.push_back("cd " + escape::shell(sources.string()) + " && " + compiler + options + " -I." +
                           core.compile + " -c " + escape::shell(code.sources[i]) + " -o " +
                           escape::shell(object));
        objects += " " + escape::shell(object);
    }
    const char* const remedy =
        code.is_hosted ? "set CXX to a compiler of C++20"
                       : "set CXX to a compiler of C++17, or leave the binary out by --sources-only";
    compile(commands, folder.path(), target, remedy);
    // It brings the C++ library along, and shows others nothing but the functions of the standard. With
    // plugins the C++ library stands beside it, as they throw and catch: a library that names all that is
    // beside it has them found before they look for one another.
    std::string linked = " -static-libstdc++ -static-libgcc";
    if (code.is_hosted) {
        linked = (code.uses_standard_blocks ? core.blocks : "") +
                 " -Wl,--no-as-needed,--disable-new-dtags,-rpath,'$ORIGIN'";
        for (const auto& [name, file] : libraries)
            if (!std::ranges::count(code.plugins, fs::path(name).stem().string())) // which are opened
                linked += " " + escape::shell(file.string());
    }
    const auto library = folder.path() / "library.so";
    compile({compiler + " -shared -Wl,--exclude-libs,ALL -Wl,-s" + objects + linked + " -o " +
             escape::shell(library.string())},
            folder.path(), target, remedy);
    return read_text_file(library);
}

std::string platform(const std::string& target, int version) {
    if (version == 2 && target == "x86_64") return "linux64";
    return target + "-linux";
}

} // namespace

namespace {

std::vector<Axis> axes_of(const FmuOptions& options) {
    std::vector<Axis> axes;
    for (const auto& text : options.structural) axes.push_back(parse_axis(text, "--structural"));
    return axes;
}

constexpr std::size_t most_models = 64; ///< each of which is compiled

/// The model for each combination of values of its structural parameters, beginning with its own values where
/// they are among them.
std::vector<FmuVariant> variants_of(const ModelOptions& model, const FmuOptions& options,
                                    LoadedModel (*load)(const ModelOptions&)) {
    std::vector<FmuVariant> variants;
    variants.push_back({load(model), {}});
    const auto axes = axes_of(options);
    if (axes.empty()) return variants;
    const auto own = std::move(variants.front().loaded);
    variants.clear();
    std::vector<std::uint64_t> own_values;
    std::vector<std::string> known;
    for (const auto& d : own.diagram.definitions)
        if (d.kind == Definition::Kind::variable) known.push_back(d.path);
    for (const auto& axis : axes) {
        if (std::ranges::count(axes, axis.name, &Axis::name) > 1)
            throw CommandError("--structural: '" + axis.name +
                               "' is given twice; give all its values at once");
        const auto its = std::ranges::find_if(own.diagram.definitions, [&](const Definition& d) {
            return d.kind == Definition::Kind::variable && d.path == axis.name;
        });
        if (its == own.diagram.definitions.end())
            throw CommandError("--structural: the model has no variable '" + axis.name + "'" +
                               did_you_mean(axis.name, known) +
                               "; a variable that decides sizes becomes a structural parameter");
        own_values.push_back(
            its->value.is_scalar() ? static_cast<std::uint64_t>(std::max(0.0, its->value.scalar())) : 0);
    }
    const Points points{axes};
    if (points.size() > most_models)
        throw CommandError("--structural: these values have " + std::to_string(points.size()) +
                           " combinations, each of which is a program of its own; give at most " +
                           std::to_string(most_models));
    for (std::size_t i = 0; i < points.size(); ++i) {
        ModelOptions changed = model;
        FmuVariant& its = variants.emplace_back();
        for (const auto& [name, text] : points[i]) {
            const auto value = number_of(text);
            if (!value || !(*value >= 1 && *value <= 1e6) || *value != std::floor(*value))
                throw CommandError("--structural: '" + name + "' must be whole numbers from 1, but is " +
                                   text);
            its.structure.push_back(static_cast<std::uint64_t>(*value));
            changed.sets.push_back(name + "=" + text);
        }
        its.loaded = load(changed);
        if (its.structure == own_values) std::swap(variants.front(), its);
    }
    return variants;
}

} // namespace

MadeFmu make_fmu(const std::vector<FmuVariant>& variants, const FmuOptions& options) {
    if (options.version == 2 && (options.has_clocks || !options.structural.empty()))
        throw CommandError(std::string("FMI 2.0 has no ") +
                           (options.has_clocks ? "clocks; leave --fmi 2 or --clocks out"
                                               : "structural parameters; leave --fmi 2 or --structural out"));
    const LoadedModel& loaded = variants.front().loaded;
    codegen::FmuChoice choice{options.version, options.has_clocks, {}};
    for (const auto& axis : axes_of(options)) choice.structural.push_back(axis.name);
    std::vector<codegen::FmuModel> models;
    for (const auto& [its, structure] : variants) {
        models.push_back({&its.diagram, generation_options(its), folders_of(its.diagram), structure});
        for (const auto value : structure)
            if (models.size() > 1) models.back().options.suffix += "_" + std::to_string(value);
    }
    const auto code = codegen::generate_fmu(models, choice);
    MadeFmu made{description_of(variants, choice, code), {}};
    const auto& description = made.description;
    auto& contents = made.contents;
    contents["modelDescription.xml"] = fmi::to_xml(description);
    std::map<std::string, fs::path> libraries;
    auto targets = options.targets;
    if (targets.empty()) targets = {machine()};
    if (code.is_hosted) {
        if (options.has_no_binary || targets != std::vector{machine()})
            throw CommandError(
                "the model has blocks from plugins, which are binaries of this machine (" + machine() +
                "); leave --sources-only and --target out, or export the part of the model without them");
        libraries = libraries_of(code.plugins, *loaded.registry);
        for (const auto& [place, file] : resources_of(loaded))
            contents["resources/" + place] = read_text_file(file);
    } else {
        for (const auto& [name, text] : code.files) contents["sources/" + name] = text;
    }
    if (options.version == 3 && !code.is_hosted)
        contents["sources/buildDescription.xml"] = build_description(code);
    contents["documentation/index.html"] = page(loaded, description);
    std::string& license = contents["documentation/licenses/license.txt"];
    if (code.is_hosted) {
        license = "The library and what is called libbf_* and WholeBodyToolbox beside it are BlockFactory's, "
                  "licensed under the Apache License 2.0\n(SPDX-License-Identifier: Apache-2.0), but for "
                  "what was made from the model, whose authors license it. These stand there, too, and have "
                  "licences of their own:\n";
        for (const auto& [name, file] : libraries) license += name + "\n";
        license += "So do the files under resources.\n";
    } else {
        license =
            "The files under sources/bf are a part of BlockFactory, licensed under the Apache License 2.0\n"
            "(SPDX-License-Identifier: Apache-2.0). All others were made from the model, whose authors "
            "license them.\n";
    }

    const fmi::TemporaryFolder folder("export");
    formats::Files texts = loaded.source.texts;
    const auto drawing =
        editor::draw(formats::read_yaml(loaded.source.file, texts), "", loaded.diagram, {}, {});
    contents["documentation/diagram.svg"] = editor::to_svg(drawing, false);
    try {
        const auto icon = folder.path() / "icon.png";
        save_picture(drawing, false, icon.string());
        contents[options.version == 2 ? "model.png" : "terminalsAndIcons/icon.png"] = read_text_file(icon);
        if (options.version == 3) {
            contents["terminalsAndIcons/icon.svg"] = contents["documentation/diagram.svg"];
            contents["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(description, drawing.bounds);
        }
    } catch (const CommandError&) { // without librsvg there is no icon
    }
    if (!options.has_no_binary) {
        const auto sources = folder.path() / "sources";
        codegen::write(code.files, sources);
        for (const auto& target : targets) {
            const std::string place = "binaries/" + platform(target, options.version) + "/";
            contents[place + code.identifier + ".so"] = compiled(code, target, sources, libraries);
            for (const auto& [name, file] : libraries) contents[place + name] = read_text_file(file);
        }
    }
    return made;
}

fmi::Type type_of(Type type) {
    static constexpr fmi::Type types[] = {fmi::Type::float64, fmi::Type::float32, fmi::Type::int8,
                                          fmi::Type::uint8,   fmi::Type::int16,   fmi::Type::uint16,
                                          fmi::Type::int32,   fmi::Type::uint32,  fmi::Type::boolean};
    return types[static_cast<std::size_t>(type)];
}

std::vector<int> dimensions_of(int rows, int cols) {
    if (cols != 1) return {rows, cols};
    return rows == 1 ? std::vector<int>() : std::vector{rows};
}

void FmuOptions::add_to(CLI::App& app) {
    app.add_option("--fmi", version, "version of the standard: 3 (by default) or 2")
        ->type_name("VERSION")
        ->check(CLI::IsMember(std::set<int>{2, 3}).description(""));
    app.add_flag("--clocks", has_clocks,
                 "rates are clocks, which the importer ticks (FMI 3.0; other importers cannot run it)");
    app.add_option("--target", targets,
                   "machines that it has binaries for: x86_64, aarch64; otherwise this one")
        ->delimiter(',')
        ->type_name("MACHINE,...")
        ->check(CLI::IsMember(std::set<std::string>{"x86_64", "aarch64"}).description(""));
    app.add_flag("--sources-only", has_no_binary, "no binaries: importers compile it");
}

namespace {

void execute(const ExportOptions& options) {
    std::error_code error;
    const bool is_block = !options.model.file.ends_with(".yaml") && !fs::exists(options.model.file, error);
    const auto variants = variants_of(
        options.model, options.fmu,
        is_block ? block_as_model : static_cast<LoadedModel (*)(const ModelOptions&)>(load_model));
    const std::string output =
        !options.output.empty() ? options.output : fs::path(options.model.file).stem().string() + ".fmu";
    refuse_overwriting({{"-o", output}}, {options.model.file});
    const auto [description, contents] = make_fmu(variants, options.fmu);
    fmi::write_archive(contents, output);
    std::printf("%s: FMI %d.0, co-simulation%s, %zu variables, steps of %s s\n", output.c_str(),
                options.fmu.version, description.model_exchange ? " and model exchange" : "",
                description.variables.size(), number(variants.front().loaded.diagram.step).c_str());
}

} // namespace

void add_export_fmu(CLI::App& app) {
    auto* command = app.add_subcommand("export-fmu", "write a model as an FMU, which other simulators run");
    auto options = std::make_shared<ExportOptions>();
    options->model.add_to(*command, "model file (.yaml), or a block as `bf describe` calls it");
    command->add_option("-o,--output", options->output, "file; otherwise MODEL.fmu in this folder")
        ->type_name("FILE");
    options->fmu.add_to(*command);
    command
        ->add_option(
            "--structural", options->fmu.structural,
            "values of a variable that decides sizes, which becomes a structural parameter (FMI 3.0): "
            "n=1:8, 'n=[2 4 8]'; may be repeated")
        ->type_name("NAME=VALUES")
        ->expected(1)
        ->take_all();
    command->footer("It holds its sources, too, or the plugins whose blocks are in it. Examples:\n"
                    "  bf export-fmu examples/dc_motor/model.yaml\n"
                    "  bf export-fmu PID --set P=2 --set e=3    # a block whose input e has three elements");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
