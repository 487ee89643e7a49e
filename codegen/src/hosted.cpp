// Blocks that the program makes through the factory.
#include "generator.hpp"

#include "bf/elaborate/structure.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>

namespace bf::codegen {

namespace {

/// The name that CMake's MAKE_C_IDENTIFIER gives the entry of a plugin that is linked.
std::string entry_of(const std::string& plugin) {
    std::string name = "bf_plugin_v1_" + plugin;
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
    return name;
}

} // namespace

bool Generator::uses_standard_library() const {
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
        if (is_hosted(static_cast<int>(n)) && diagram_.nodes[n].type.find('/') == std::string::npos)
            return true;
    return false;
}

std::vector<std::string> Generator::plugins() const {
    std::set<std::string> names;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
        if (const auto& type = diagram_.nodes[n].type; is_hosted(static_cast<int>(n)) || is_dynamic())
            if (const auto slash = type.find('/'); slash != std::string::npos)
                names.insert(type.substr(0, slash));
    return {names.begin(), names.end()};
}

std::string Generator::library_declarations() const {
    std::string text = is_fmu_             ? "#include \"bf/codegen/fmu_hosted.hpp\"\n"
                       : plugins().empty() ? ""
                                           : "#include \"bf/codegen/linked.hpp\"\n";
    if (uses_standard_library() || is_dynamic()) text += "\n#include \"bf/blocks/standard.hpp\"\n";
    if (plugins().empty() || is_fmu_) return text + "\n";
    text += "\n#ifdef BF_LINK_PLUGINS\n";
    for (const auto& name : plugins()) text += "extern \"C\" void " + entry_of(name) + "(bf::Library&);\n";
    return text + "#endif\n\n";
}

std::string Generator::add_libraries(const std::string& registry) const {
    std::string text;
    if (uses_standard_library() || is_dynamic())
        text += "    " + registry + ".add(bf::standard_library());\n";
    if (is_fmu_) {
        std::string names;
        for (const auto& name : plugins()) names += (names.empty() ? "" : ", ") + literal(name);
        return text + "    bf::generated::load_own_plugins(" + registry + ", {" + names + "});\n";
    }
    if (!plugins().empty()) {
        text += "#ifdef BF_LINK_PLUGINS\n";
        for (const auto& name : plugins())
            text += "    " + registry + ".add(bf::generated::linked(" + literal(name) + ", " +
                    entry_of(name) + "));\n";
        text += "#endif\n";
    }
    return text + "#ifdef BF_PLUGIN_FOLDER\n    " + registry +
           ".add_search_path(BF_PLUGIN_FOLDER);\n#endif\n";
}

std::string Generator::hosted_slot(int n, int s) const {
    const Slot& slot = block(n).resolution().slots[static_cast<std::size_t>(s)];
    constexpr const char* roles[] = {"input",     "output", "parameter", "discrete_state", "continuous_state",
                                     "workspace", "guard"};
    const auto address = [](const Place& place) {
        return place.member.empty() ? "nullptr" : "&" + place.text();
    };
    Node::End end{n, s};
    const bool is_wired = slot.role == Role::input && node(n).sources[static_cast<std::size_t>(s)].node >= 0;
    if (is_wired) end = node(n).sources[static_cast<std::size_t>(s)];
    std::string memory = address(place_of(end)), more;
    if (slot.role == Role::discrete_state)
        more = ", " + address(next_[static_cast<std::size_t>(n)][static_cast<std::size_t>(s)]);
    if (slot.role == Role::continuous_state) {
        Place rate = place_of(end);
        rate.structure = "rates_";
        more = ", nullptr, " + address(rate); // events write the next state into memory of their own
    }
    if (is_wired) more = ", nullptr, nullptr, true";
    return "{" + literal(slot.name) + ", Role::" + roles[static_cast<std::size_t>(slot.role)] +
           ", Type::" + enumerator(slot.type) + ", {" + number(slot.size.rows) + ", " +
           number(slot.size.cols) + ", " + (slot.size.is_matrix ? "true" : "false") + "}, {" + memory + more +
           "}}";
}

std::string Generator::hosted_source() const {
    const auto& d = diagram_;
    std::string adds;
    const auto argument = [](const Value& value) -> std::string {
        const auto list = [](const auto& items, auto&& print) {
            std::string text;
            for (const auto& item : items) text += (text.empty() ? "" : ", ") + print(item);
            return text;
        };
        const auto quoted = [](const std::string& text) { return literal(text); };
        if (value.kind == Value::Kind::text) return "Value(std::string(" + literal(value.text) + "))";
        if (value.kind == Value::Kind::texts)
            return "Value(std::vector<std::string>{" + list(value.texts, quoted) + "})";
        return "value(Type::" + std::string(enumerator(value.type)) + ", " + number(value.rows) + ", " +
               number(value.cols) + ", {" +
               list(value.data, [](double x) { return literal(x, Type::float64); }) + "})";
    };
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
        if (!is_hosted(static_cast<int>(n))) continue;
        const auto& node = d.nodes[n];
        std::string arguments, slots, providers;
        for (const auto& [name, value] : node.arguments)
            arguments += (arguments.empty() ? "" : ",\n         ") +
                         ("{" + literal(name) + ", " + argument(value) + "}");
        const auto& all = node.block->resolution().slots;
        for (std::size_t s = 0; s < all.size(); ++s)
            if (all[s].role != Role::workspace &&
                (all[s].role != Role::guard ||
                 !place_of({static_cast<int>(n), static_cast<int>(s)}).member.empty()))
                slots += (slots.empty() ? "" : ",\n         ") +
                         hosted_slot(static_cast<int>(n), static_cast<int>(s));
        for (const auto& from : node.providers)
            providers += (providers.empty() ? "{" : ", {") +
                         number(hosted_[static_cast<std::size_t>(from.node)]) + ", " + number(from.slot) +
                         "}";
        const std::string own = node.arguments.folder.empty() ? "." : node.arguments.folder;
        const auto elsewhere = folders_.find(node.path);
        const std::string subfolder = elsewhere != folders_.end() ? elsewhere->second
                                                                  : std::filesystem::absolute(own)
                                                                        .lexically_normal()
                                                                        .lexically_relative(options_.folder)
                                                                        .generic_string();
        adds += "    blocks->add(" + literal(node.path) + ", " + literal(node.type) + ", " +
                number(node.rate) + ",\n        {" + arguments + "},\n        " +
                literal(subfolder.empty() ? own : subfolder) + ",\n        {" + slots + "},\n        {" +
                providers + "});\n";
    }
    std::string periods, tasks, names;
    for (std::size_t n = 0; n < d.nodes.size(); ++n)
        if (is_hosted(static_cast<int>(n)))
            for (const auto& known : d.nodes[n].block->declaration().arguments)
                names += "        {" + literal(d.nodes[n].path + "." + known.name) + ", " +
                         literal(known.doc) + "},\n";
    for (std::size_t r = 0; r < d.rates.size(); ++r)
        periods += (r ? ", " : "") +
                   literal(d.rates[r].is_continuous ? 0 : d.period(static_cast<int>(r)), Type::float64);
    for (const auto& task : tasks_)
        tasks += std::string(tasks.empty() ? "" : ",\n                    ") + "{" +
                 number(hosted_[static_cast<std::size_t>(task.node)]) + ", Phase::" +
                 (task.phase == Phase::output       ? "output"
                  : task.phase == Phase::update     ? "update"
                  : task.phase == Phase::derivative ? "derivative"
                                                    : "guards") +
                 ", " + number(task.index) + "}";
    return "// Blocks made through the factory, from the plugins in BLOCKFACTORY_PLUGIN_PATH.\n#include \"" +
           file_ + ".hpp\"\n\n#include \"bf/codegen/hosted_blocks.hpp\"\n" + library_declarations() +
           "bf::generated::FixedNames " + class_ + "::argument_table() noexcept {\n" +
           (names.empty()
                ? "    return {nullptr, 0};\n"
                : "    static constexpr bf::generated::FixedName rows[] = {\n" + names +
                      "    };\n    return {rows, static_cast<int>(sizeof rows / sizeof rows[0])};\n") +
           "}\n\nstd::unique_ptr<bf::generated::Hosted> " + class_ +
           "::make_hosted_blocks() {\n    using bf::Phase;\n    using bf::Role;\n    using bf::Type;\n    "
           "using "
           "bf::Value;\n    using bf::generated::value;\n    auto blocks = "
           "std::make_unique<bf::generated::HostedBlocks>(folder, "
           "std::vector<double>{" +
           periods + "});\n    blocks->change_arguments(arguments_);\n" +
           add_libraries("blocks->registry()") + adds + "    blocks->finish({" + tasks +
           "});\n    return blocks;\n}\n\nbool " + class_ +
           "::prepare_hosted_blocks() noexcept {\n    try {\n        if (!hosted_) hosted_ = "
           "make_hosted_blocks();\n    } "
           "catch (const std::exception& error) {\n        problem_ = error.what();\n        return "
           "fail(\"\", "
           "problem_.c_str());\n    }\n    hosted_->prepare();\n    return true;\n}\n";
}

std::string Generator::elaborated_source() const {
    const auto& d = diagram_;
    std::string texts, overrides, structure, binds, constants, tasks;
    const auto text = [&](const std::string& file) {
        std::string lines;
        const std::string& content = options_.texts.at(file);
        for (std::size_t at = 0; at < content.size();) {
            const auto end = std::min(content.find('\n', at), content.size() - 1);
            lines += "\n         " + literal(content.substr(at, end - at + 1));
            at = end + 1;
        }
        texts += "        {" + literal(file) + "," + (lines.empty() ? " \"\"" : lines) + "},\n";
    };
    text(options_.model_file);
    for (const auto& [file, content] : options_.texts)
        if (file != options_.model_file) text(file);
    for (const auto& [name, value] : options_.overrides)
        overrides += "            {" + literal(name) + ", " + literal(value) + ", {}},\n";
    for (const auto& part : structure_of(d))
        structure += "            {" + literal(part.name) + ", " + std::to_string(part.hash) + "u},\n";
    const auto bind = [&](const char* how, const std::string& member, const Node::End& end) {
        binds += "        model->" + std::string(how) + "(" + member + ", " + number(end.node) + ", " +
                 number(end.slot) + ");\n";
    };
    for (const auto* fields : {&inputs_, &parameters_, &signals_, &states_, &continuous_, &workspace_})
        for (const auto& field : *fields) bind("bind", place_of(field.end).text(), field.end);
    for (const auto& field : outputs_) bind("bind_output", "outputs." + field.member, field.end);
    for (const auto& field : states_) bind("bind_next", "next_." + field.member, field.end);
    for (const auto& field : continuous_) bind("bind_rate", "rates_." + field.member, field.end);
    const auto phase_name = [](Phase phase) {
        return std::string("bf::Phase::") + (phase == Phase::output   ? "output"
                                             : phase == Phase::update ? "update"
                                                                      : "derivative");
    };
    for (const auto& c : constants_)
        constants += "        constants_.push_back(model->constants(" + number(c.node) + ", " +
                     phase_name(c.phase) + ", " + number(c.rule) + ", " + number(c.operand) + "));\n";
    for (const auto& task : tasks_)
        tasks += "        model->add_task(" + number(task.node) + ", " + phase_name(task.phase) + ", " +
                 number(task.index) + ");\n";
    if (!continuous_.empty())
        binds += "        continuous_size_ = model->continuous_size();\n        continuous_elements_ = "
                 "model->continuous();\n        rate_elements_ = model->rates();\n        "
                 "start_.resize(static_cast<std::size_t>(continuous_size_));\n        "
                 "slopes_.resize(start_.size() * bf::kernels::" +
                 solver_name() + ".stages);\n";
    const char* const source =
        R"~(// The model, elaborated when the program starts: sizes, memory and names.
#include "@file@.hpp"

#include "bf/codegen/elaborated.hpp"
@libraries@using bf::generated::ElaboratedModel;
using bf::generated::FixedNames;
using bf::generated::NewValue;
using bf::generated::Quantities;
using bf::generated::Quantity;

namespace {

const std::vector<ElaboratedModel::Text>& texts() {
    static const std::vector<ElaboratedModel::Text> all{
@texts@    };
    return all;
}

const std::vector<std::pair<const char*, std::uint64_t>>& structure() {
    static const std::vector<std::pair<const char*, std::uint64_t>> all{
@structure@    };
    return all;
}

ElaboratedModel* of(const std::unique_ptr<bf::generated::Hosted>& model) {
    return static_cast<ElaboratedModel*>(model.get());
}

} // namespace

std::string @Class@::elaborate(const std::string& parameter_file) {
    try {
        std::vector<bf::ElaborateOptions::Override> overrides{
@overrides@        };
        if (!parameter_file.empty())
            for (auto& given : bf::generated::read_overrides(parameter_file)) overrides.push_back(std::move(given));
        hosted_.reset();
        is_initialized_ = false;
        const auto add_libraries = [](bf::Registry& registry) {
@add_libraries@        };
        auto model = std::make_unique<ElaboratedModel>(add_libraries, folder, texts(), std::move(overrides), structure());
        planned_stop_ = model->stop_time();
        constants_.clear();
@binds@@constants@@tasks@        hosted_ = std::move(model);
        return "";
    } catch (const std::exception& error) {
        return error.what();
    }
}

bool @Class@::prepare_hosted_blocks() noexcept {
    if (!hosted_ && !(problem_ = elaborate("")).empty()) return fail("", problem_.c_str());
    hosted_->prepare();
    return true;
}

Quantities @Class@::parameter_table() const noexcept { return hosted_ ? of(hosted_)->parameters() : Quantities{nullptr, 0}; }
Quantities @Class@::variable_table() const noexcept { return hosted_ ? of(hosted_)->variables() : Quantities{nullptr, 0}; }
Quantities @Class@::input_table() const noexcept { return hosted_ ? of(hosted_)->inputs() : Quantities{nullptr, 0}; }
Quantities @Class@::recorded_table() const noexcept { return hosted_ ? of(hosted_)->recorded() : Quantities{nullptr, 0}; }
Quantities @Class@::check_table() const noexcept { return hosted_ ? of(hosted_)->checks() : Quantities{nullptr, 0}; }
FixedNames @Class@::fixed_table() const noexcept { return hosted_ ? of(hosted_)->fixed() : FixedNames{nullptr, 0}; }

const Quantity* @Class@::find_parameter(const char* name) const noexcept {
    return hosted_ ? of(hosted_)->find_parameter(name) : nullptr;
}

void* @Class@::data(const Quantity& quantity) noexcept { return ElaboratedModel::address(quantity); }
const void* @Class@::data(const Quantity& quantity) const noexcept { return ElaboratedModel::address(quantity); }

const char* @Class@::set_parameter(const char* name, const double* values, int count) noexcept {
    const NewValue change{name, values, count};
    return set_parameters(&change, 1);
}

const char* @Class@::set_parameters(const NewValue* changes, int count) noexcept {
    if (!hosted_) return "sizes are not known yet: call elaborate or initialize first";
    const char* const before = failure_;
    const char* const block = failed_block_;
    const char* const wrong = of(hosted_)->set_parameters(
        changes, count, [this] { return !is_initialized_ || compute_constants(); });
    failure_ = before;
    failed_block_ = block;
    return wrong;
}
)~";
    return filled(source, {{"@file@", file_},
                           {"@Class@", class_},
                           {"@texts@", texts},
                           {"@structure@", structure},
                           {"@overrides@", overrides},
                           {"@binds@", binds},
                           {"@constants@", constants},
                           {"@tasks@", tasks},
                           {"@libraries@", library_declarations()},
                           {"@add_libraries@", add_libraries("registry")}});
}

} // namespace bf::codegen
