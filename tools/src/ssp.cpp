#include "ssp.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/base/numbers.hpp"
#include "bf/fmi/ssp.hpp"
#include "bf/model/builder.hpp"
#include "session.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numeric>
#include <set>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

model::Expression of(model::Value value) { return {.text = std::move(value.text)}; }

bool is_parameter(fmi::Causality kind) {
    return kind == fmi::Causality::parameter || kind == fmi::Causality::structural_parameter;
}

/// "2 x 3".
std::string size_text(const std::vector<int>& dimensions) {
    std::string text;
    for (const int size : dimensions) text += (text.empty() ? "" : " x ") + std::to_string(size);
    return text.empty() ? "1" : text;
}

/// A name for a block or a port that none of `taken` has, which it joins.
std::string name_of(const std::string& wanted, std::set<std::string>& taken) {
    std::string name;
    for (const char c : wanted) {
        const auto byte = static_cast<unsigned char>(c);
        name += byte < 0x20 || byte == 0x7f || c == '.' || c == '*' ? '_' : c;
    }
    if (name.size() > 150) name.resize(150);
    if (name.front() == ' ') name.front() = '_';
    if (name.back() == ' ') name.back() = '_';
    std::string unique = name;
    for (int i = 2; !taken.insert(unique).second; ++i) unique = name + "_" + std::to_string(i);
    return unique;
}

/// The longest time of which both are multiples, s: by Euclid's algorithm on whole nanoseconds. Of 0 and
/// another it is the other; of those that are no whole nanoseconds the first.
double common_measure(double a, double b) {
    const auto is_counted = [](double x) {
        return x < 9e9 && std::abs(x * 1e9 - std::round(x * 1e9)) <= 1e-6 * std::max(1.0, x);
    };
    if (a == 0 || b == 0) return a + b;
    if (!is_counted(a) || !is_counted(b)) return a;
    return static_cast<double>(std::gcd(std::llround(a * 1e9), std::llround(b * 1e9))) / 1e9;
}

class SystemModel {
  public:
    SystemModel(fmi::SystemStructure structure, const fs::path& folder, const std::string& package,
                const std::vector<Override>& overrides)
        : its_(std::move(structure)), folder_(folder), package_(package) {
        for (const auto& given : overrides)
            if (given.name == "step") its_.own["step"] = given.text;
    }

    model::Model model() {
        if (its_.start != 0)
            refuse("its experiment begins at " + number_text(its_.start) +
                   " s, but runs begin at 0; let it begin there");
        model_.name = its_.name;
        for (char& c : model_.name)
            if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '_';
        model_.doc = its_.system.doc;
        model_.plugins.push_back({"FMI"});
        describe(its_.system);
        read_experiment();
        for (const auto& warning : its_.warnings) bfWarning << warning;
        give_parameters(its_.system, "");
        fill(its_.system, model_.root, "");
        return std::move(model_);
    }

  private:
    [[noreturn]] void refuse(const std::string& what) const { throw CommandError(package_ + ": " + what); }

    /// Reads what all FMUs say of themselves.
    void describe(const fmi::SystemElement& system) {
        for (const auto& element : system.elements) {
            if (element.is_system) {
                describe(element);
                continue;
            }
            const auto [known, is_new] = descriptions_.try_emplace(element.source);
            if (is_new) known->second = fmi::description_of(folder_ / element.source);
            const auto& d = known->second;
            const double step = d.co_simulation && d.co_simulation->internal_step
                                    ? *d.co_simulation->internal_step
                                    : d.step.value_or(0);
            if (step > 0 && (step_ == 0 || step < step_)) step_ = step;
            for (const auto& v : d.variables)
                if (v.ticks && v.causality == fmi::Causality::input)
                    for (const double time : {v.ticks->interval.value_or(0), v.ticks->shift})
                        ticks_ = common_measure(ticks_, time);
        }
    }

    /// Where nobody says how long a step is, it is the shortest that an FMU names, shorter where clocks
    /// would tick between such steps, or a thousandth of the run.
    void read_experiment() {
        if (its_.stop) model_.stop = of(*its_.stop);
        const auto own = [&](const char* name, std::optional<model::Expression>& to) {
            if (const auto found = its_.own.find(name); found != its_.own.end()) to = of(found->second);
        };
        own("step", model_.step);
        own("solver", model_.solver);
        own("relative_tolerance", model_.relative_tolerance);
        own("absolute_tolerance", model_.absolute_tolerance);
        own("max_step", model_.max_step);
        step_ = common_measure(step_, ticks_);
        if (step_ == 0) step_ = its_.stop.value_or(0) / 1000;
        if (!model_.step) model_.step = of(step_);
        if (its_.own.contains("algebraic_loops")) model_.algebraic_loops = model::AlgebraicLoops::solve;
        for (const auto& signal : its_.record) model_.record.push_back({signal});
        model_.record_all = model_.record.empty();
    }

    /// Hands the values that a system's bindings give to the components, those of outer systems last.
    void give_parameters(fmi::SystemElement& system, const std::string& path) {
        for (auto& element : system.elements)
            if (element.is_system) give_parameters(element, path + element.name + ".");
        for (const auto& parameter : system.parameters)
            if (!give(system, parameter, path)) warn_of(parameter, path + parameter.name);
    }
    /// Sets may be for more than there is (SSP 2.0, section 6.2), or a name is misspelled.
    static void warn_of(const fmi::ParameterValue& value, const std::string& name) {
        bfWarning << value.place << ": '" << name << "' is given a value, but nothing takes it";
    }
    /// Does some element or connector have that name?
    bool give(fmi::SystemElement& system, fmi::ParameterValue value, const std::string& path) {
        bool is_taken = false;
        const std::string name = value.name;
        const auto& receivers = receivers_of(system);
        if (const auto own = receivers.connectors.find(name); own != receivers.connectors.end()) {
            if (!is_parameter(own->second))
                refuse("'" + path + name +
                       "' is given a value, but is no parameter; give inputs of a system by --inputs");
            is_taken = true;
            const auto [first, last] = receivers.wires.equal_range(name);
            for (auto wire = first; wire != last; ++wire) {
                const auto element = receivers.elements.find(wire->second->to_element);
                if (element == receivers.elements.end()) continue;
                fmi::ParameterValue inner = value;
                const auto& [factor, offset] = wire->second->conversion;
                for (double& x : inner.values) x = factor * x + offset;
                inner.name = wire->second->to;
                is_taken = give_to(*element->second, std::move(inner), path) || is_taken;
            }
        }
        for (auto dot = name.find('.'); dot != std::string::npos; dot = name.find('.', dot + 1)) {
            const auto element = receivers.elements.find(std::string_view(name).substr(0, dot));
            if (element == receivers.elements.end()) continue;
            value.name = name.substr(dot + 1);
            is_taken = give_to(*element->second, value, path) || is_taken;
        }
        return is_taken;
    }

    /// What takes the values that are given to a system.
    struct Receivers {
        std::map<std::string_view, fmi::SystemElement*> elements;
        std::map<std::string_view, fmi::Causality> connectors;   ///< its own
        std::multimap<std::string_view, const fmi::Wire*> wires; ///< from these
    };
    const Receivers& receivers_of(fmi::SystemElement& system) {
        const auto [known, is_new] = receivers_.try_emplace(&system);
        if (is_new) {
            for (auto& element : system.elements) known->second.elements[element.name] = &element;
            for (const auto& c : system.connectors) known->second.connectors[c.name] = c.kind;
            for (const auto& wire : system.wires)
                if (wire.from_element.empty()) known->second.wires.emplace(wire.from, &wire);
        }
        return known->second;
    }
    bool give_to(fmi::SystemElement& element, fmi::ParameterValue value, const std::string& path) {
        if (element.is_system) return give(element, std::move(value), path + element.name + ".");
        element.parameters.push_back(std::move(value));
        return true;
    }

    /// The ends of an element's connectors as connections of the model write them.
    using Ends = std::map<std::string, model::Endpoint>;
    /// Some of the connectors in a system: those of its elements, and its own, whose element is "".
    using Connectors = std::set<std::pair<std::string, std::string>>;
    /// Those that are clocks, and when they tick, where somebody says so.
    using Clocks = std::map<std::pair<std::string, std::string>, std::optional<fmi::Ticks>>;

    /// Gives the system's own ends.
    Ends fill(const fmi::SystemElement& from, model::System& to, const std::string& path) {
        std::set<std::string> names;
        Connectors driven;
        for (const auto& wire : from.wires) driven.emplace(wire.to_element, wire.to);
        std::map<std::string, Ends> ends; // by element
        Clocks clocks;
        const auto add_clocks = [&](const std::string& element, const auto& connectors) {
            for (const auto& c : connectors)
                if (c.type == fmi::Type::clock) clocks[{element, c.name}] = c.ticks;
        };
        add_clocks("", from.connectors);
        for (const auto& c : from.connectors) {
            if (c.type == fmi::Type::clock) continue;
            const bool is_input = c.kind == fmi::Causality::input;
            if (!is_input && c.kind != fmi::Causality::output) continue;
            if (!is_input && !driven.contains({"", c.name})) continue; // nothing gives it a value
            const std::string name = name_of(c.name, names);
            (is_input ? to.inputs : to.outputs).push_back({.name = name, .unit = c.unit});
            ends[""][c.name] = {.block = {}, .port = name};
        }
        for (const auto& element : from.elements) {
            model::Block block{.name = name_of(element.name, names), .doc = element.doc};
            place(element, path + block.name);
            if (element.is_system) {
                add_clocks(element.name, element.connectors);
                block.system = std::make_unique<model::System>();
                for (const auto& [connector, end] : fill(element, *block.system, path + block.name + "."))
                    ends[element.name][connector] = {block.name, end.port};
            } else {
                fill_component(element, driven, block, to, names, ends[element.name], clocks);
            }
            to.blocks.push_back(std::move(block));
        }
        connect(from, to, path, names, ends, clocks);
        return ends[""];
    }

    void fill_component(const fmi::SystemElement& from, const Connectors& driven, model::Block& block,
                        model::System& system, std::set<std::string>& names, Ends& ends, Clocks& clocks) {
        const auto& description = descriptions_.at(from.source);
        const auto kind = from.kind                   ? *from.kind
                          : description.co_simulation ? fmi::Kind::co_simulation
                                                      : fmi::Kind::model_exchange;
        block.type = kind == fmi::Kind::co_simulation ? "FMI/FMU" : "FMI/ModelExchange";
        block.settings.push_back({"fmu", {.text = from.source, .quotes = model::Quotes::single}});
        const auto own = [&](const char* name) {
            const auto found = from.own.find(name);
            return found == from.own.end() ? std::nullopt : std::optional(of(found->second));
        };
        block.period = own("period");
        block.offset = own("offset");
        if (kind == fmi::Kind::co_simulation && !block.period) block.period = model_.step;

        const auto block_names = fmi::block_names(description, kind);
        std::map<std::string, std::size_t> variables;
        for (std::size_t i = 0; i < block_names.size(); ++i) variables[description.variables[i].name] = i;
        for (const auto& c : from.connectors) {
            const auto found = variables.find(c.name);
            if (found == variables.end())
                refuse("the connector '" + from.name + "." + c.name + "' is no variable of " + from.source +
                       " (SSP 2.0, section 5.2.1)");
            const auto& v = description.variables[found->second];
            if (!c.dimensions.empty() && c.dimensions != v.dimensions && !std::ranges::count(c.dimensions, 0))
                refuse("the connector '" + from.name + "." + c.name + "' has " + size_text(c.dimensions) +
                       " elements, but the variable of " + from.source + " has " + size_text(v.dimensions) +
                       " (SSP 2.0, section 5.2.1)");
            if (c.type && (c.type == fmi::Type::clock) != (v.type == fmi::Type::clock))
                refuse("one of the connector '" + from.name + "." + c.name + "' and the variable of " +
                       from.source + " is a clock, and the other is none (SSP 2.0, section 5.2.1)");
            if (v.type == fmi::Type::clock) {
                if (c.ticks) agree(*c.ticks, v.ticks, from.name + "." + c.name, from.source);
                clocks[{from.name, c.name}] = v.ticks;
            }
            const std::string& port = block_names[found->second];
            if (!port.empty()) ends[c.name] = {block.name, port};
        }
        std::map<std::string, const fmi::ParameterValue*> given; // the last one of each
        for (const auto& p : from.parameters) given[p.name] = &p;
        for (const auto& item : given) {
            const std::string& name = item.first;
            const auto found = variables.find(name);
            if (found == variables.end()) {
                warn_of(*item.second, from.name + "." + name);
                continue;
            }
            const auto& v = description.variables[found->second];
            const std::string& known = block_names[found->second];
            if (known.empty() || v.causality == fmi::Causality::output)
                refuse("'" + from.name + "." + name + "' is given a value, but is no number that may be set");
            const std::string text = value_text(from.name + "." + name, v, *item.second);
            if (v.causality != fmi::Causality::input) {
                block.settings.push_back({known, of(text)});
            } else if (!driven.contains({from.name, name})) {
                model::Block constant{.name = name_of(from.name + "_" + known, names), .type = "Constant"};
                constant.settings.push_back({"value", of(text)});
                system.connections.push_back({{constant.name}, {{block.name, known}}});
                system.blocks.push_back(std::move(constant));
            }
        }
    }

    /// Two that say when one clock ticks must say the same.
    void agree(const fmi::Ticks& a, const std::optional<fmi::Ticks>& b, const std::string& of_a,
               const std::string& of_b) const {
        if (a.interval && b && b->interval && (*a.interval != *b->interval || a.shift != b->shift))
            refuse("the clock '" + of_a + "' ticks every " + number_text(*a.interval) + " s from " +
                   number_text(a.shift) + " s on, but by " + of_b + " every " + number_text(*b->interval) +
                   " s from " + number_text(b->shift) + " s on; give both the same interval and shift");
    }

    /// What values of that type are, as far as one kind cannot be given for another.
    static std::string kind_of(fmi::Type type) {
        return type == fmi::Type::boolean  ? "a boolean"
               : fmi::has_values(type)     ? "a number"
               : type == fmi::Type::string ? "a text"
                                           : "no number";
    }

    /// The value of a parameter as the block takes it.
    std::string value_text(const std::string& name, const fmi::Variable& v,
                           const fmi::ParameterValue& given) const {
        std::vector<double> values = given.values;
        if (!fmi::has_values(given.type) ||
            (given.type == fmi::Type::boolean) != (v.type == fmi::Type::boolean))
            refuse("'" + name + "' is " + kind_of(v.type) + ", but is given " + kind_of(given.type) +
                   "; give it a value of its type");
        const auto count = static_cast<std::size_t>(v.count());
        if (values.size() == 1) values.resize(count, values.front());
        if (values.size() != count)
            refuse("'" + name + "' has " + std::to_string(count) + " elements, but is given " +
                   std::to_string(given.values.size()));
        if (!given.unit.empty() && !v.unit.empty() && given.unit != v.unit)
            refuse("'" + name + "' is in " + v.unit + ", but its value in " + given.unit +
                   "; give it in the former");
        const bool is_input = v.causality == fmi::Causality::input;
        std::string text;
        for (std::size_t i = 0; i < count; ++i) {
            const bool is_row_end = (i + 1) % static_cast<std::size_t>(v.cols()) == 0;
            text += (v.type == fmi::Type::boolean ? std::string(values[i] != 0 ? "true" : "false")
                                                  : model::Value(values[i]).text) +
                    (i + 1 == count ? ""
                     : is_row_end   ? "; "
                                    : " ");
        }
        if (!v.dimensions.empty()) text = "[" + text + "]";
        static constexpr std::pair<fmi::Type, const char*> typed[] = {
            {fmi::Type::float32, "single"}, {fmi::Type::int8, "int8"},        {fmi::Type::uint8, "uint8"},
            {fmi::Type::int16, "int16"},    {fmi::Type::uint16, "uint16"},    {fmi::Type::int32, "int32"},
            {fmi::Type::uint32, "uint32"},  {fmi::Type::enumeration, "int32"}};
        if (is_input) // a constant has the type of its value
            for (const auto& [type, function] : typed)
                if (type == v.type) text = std::string(function) + "(" + text + ")";
        return text;
    }

    void connect(const fmi::SystemElement& from, model::System& to, const std::string& path,
                 std::set<std::string>& names, std::map<std::string, Ends>& ends, const Clocks& clocks) {
        Connectors parameters;
        const auto add_parameters = [&](const std::string& element, const auto& connectors) {
            for (const auto& c : connectors)
                if (is_parameter(c.kind)) parameters.emplace(element, c.name);
        };
        add_parameters("", from.connectors);
        for (const auto& element : from.elements) add_parameters(element.name, element.connectors);
        std::map<std::string, std::size_t> by_source;
        const auto add = [&](const model::Endpoint& a, const model::Endpoint& b) {
            const auto [known, is_new] = by_source.emplace(a.text(), to.connections.size());
            if (is_new)
                to.connections.push_back({a, {b}});
            else
                to.connections[known->second].to.push_back(b);
        };
        for (const auto& wire : from.wires) {
            const auto find = [&](const std::string& element,
                                  const std::string& connector) -> const model::Endpoint* {
                const auto& its = ends[element];
                const auto found = its.find(connector);
                return found == its.end() ? nullptr : &found->second;
            };
            const auto *a = find(wire.from_element, wire.from), *b = find(wire.to_element, wire.to);
            if (is_of_clocks(wire, path, clocks)) continue;
            if (parameters.contains({wire.to_element, wire.to})) {
                if (wire.from_element.empty() && parameters.contains({"", wire.from}))
                    continue; // its value is given already
                refuse("a signal leads to the parameter '" + path + wire.to_element + "." + wire.to +
                       "', which is not known here; connect it to an input");
            }
            if (!a || !b)
                refuse("'" + path + (a ? wire.to : wire.from) +
                       "' is connected, but is no number that a signal has");
            model::Endpoint source = *a;
            const auto convert = [&](const char* type, const char* setting, double x) {
                model::Block block{.name = name_of(b->text() + " " + setting, names), .type = type};
                block.settings.push_back({setting, of(x)});
                add(source, {block.name});
                source = {block.name};
                to.blocks.push_back(std::move(block));
            };
            if (wire.conversion.factor != 1) convert("Gain", "K", wire.conversion.factor);
            if (wire.conversion.offset != 0) convert("Bias", "bias", wire.conversion.offset);
            add(source, *b);
            if (wire.xs.empty()) continue;
            model::Bends bends{path + b->text()};
            for (std::size_t i = 0; i < wire.xs.size(); ++i)
                bends.points.push_back(point(wire.xs[i], wire.ys[i]));
            if (std::all_of(bends.points.begin(), bends.points.end(), is_drawn))
                model_.layout.wires.push_back(std::move(bends));
        }
    }

    /// One of clocks is no signal: blocks tick the periodic clocks of their FMUs by themselves.
    bool is_of_clocks(const fmi::Wire& wire, const std::string& path, const Clocks& clocks) const {
        const auto from = clocks.find({wire.from_element, wire.from}),
                   to = clocks.find({wire.to_element, wire.to});
        if (from == clocks.end() && to == clocks.end()) return false;
        const std::string source =
            path + (wire.from_element.empty() ? "" : wire.from_element + ".") + wire.from;
        const std::string destination =
            path + (wire.to_element.empty() ? "" : wire.to_element + ".") + wire.to;
        if (from == clocks.end() || to == clocks.end())
            refuse("'" + source + "' and '" + destination +
                   "' are connected, of which one is a clock and the other none (SSP 2.0, section 5.3.2)");
        if (!wire.from_element.empty())
            refuse("'" + source + "' drives '" + destination +
                   "', but is a clock that an FMU triggers, which no signal of a diagram does");
        if (from->second) agree(*from->second, to->second, source, "'" + destination + "'");
        return true;
    }

    static model::Point point(double x, double y) {
        return {x * pixels_per_millimetre, -y * pixels_per_millimetre};
    }
    static bool is_drawn(const model::Point& p) { return std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6; }

    /// Rotations are by quarters here; sizes are those before it there, as drawn here.
    void place(const fmi::SystemElement& element, const std::string& path) {
        if (!element.place) return;
        const auto& its = *element.place;
        const auto middle = point((its.x1 + its.x2) / 2, (its.y1 + its.y2) / 2);
        model::Point size{std::abs(its.x2 - its.x1) * pixels_per_millimetre,
                          std::abs(its.y2 - its.y1) * pixels_per_millimetre};
        const double quarters = std::round(-its.rotation / 90);
        if (!is_drawn(middle) || !is_drawn(size) || !(std::abs(quarters) < 1e6) || size.x < 1 || size.y < 1)
            return;
        const int turns = static_cast<int>(std::fmod(std::fmod(quarters, 4) + 4, 4));
        if (turns % 2 == 1) std::swap(size.x, size.y);
        model_.layout.blocks.push_back({.path = path,
                                        .at = {middle.x - size.x / 2, middle.y - size.y / 2},
                                        .size = size,
                                        .flipped = its.x1 > its.x2,
                                        .rotated = static_cast<model::Rotation>(turns)});
    }

    fmi::SystemStructure its_;
    const fs::path& folder_;
    const std::string& package_;
    model::Model model_;
    std::map<std::string, fmi::Description> descriptions_;     ///< by source
    std::map<const fmi::SystemElement*, Receivers> receivers_; ///< by system
    double step_ = 0;                                          ///< the shortest that an FMU names, s
    double ticks_ = 0; ///< of which all ticks of clocks are multiples, s
};

} // namespace

std::string fmu_name(const DiagramNode& node) {
    for (const auto& [name, value] : node.arguments)
        if (name == "fmu") return value.text;
    return {};
}

std::map<std::string, fs::path> fmus_of(const Diagram& diagram) {
    std::map<std::string, fs::path> all;
    for (const auto& node : diagram.nodes)
        if (node.library == "FMI") all[fmu_name(node)] = fmi::find_fmu(fmu_name(node));
    return all;
}

model::Model open_system(const fs::path& package, const std::vector<Override>& overrides) {
    // Blocks open their FMUs when a run starts, wherever in the command that is.
    static std::vector<std::unique_ptr<fmi::TemporaryFolder>> folders;
    folders.push_back(std::make_unique<fmi::TemporaryFolder>("system"));
    const fs::path& folder = folders.back()->path();
    fmi::extract(package, folder, {}, fmi::system_archive);
    const std::string name = package.string();
    model::Model model = SystemModel(fmi::read_system(folder, name), folder, name, overrides).model();
    const char* variable = "BLOCKFACTORY_PLUGIN_PATH";
    const char* before = std::getenv(variable);
    ::setenv(variable, (folder.string() + (before ? std::string(":") + before : "")).c_str(), 1);
    return model;
}

} // namespace bf::tools
