// Blocks that the program makes through the factory.
#include "generator.hpp"

#include <filesystem>

namespace bf::codegen {

namespace {
std::string number(int i) { return std::to_string(i); }
} // namespace

bool Generator::uses_standard_library() const {
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
        if (is_hosted(static_cast<int>(n)) && diagram_.nodes[n].type.find('/') == std::string::npos)
            return true;
    return false;
}

std::string Generator::hosted_slot(int n, int s) const {
    const Slot& slot = block(n).declaration().slots[static_cast<std::size_t>(s)];
    constexpr const char* roles[] = {"input", "output", "parameter", "discrete_state", "continuous_state"};
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
        more = ", " + memory + ", " + address(rate); // After writes the state itself
    }
    if (is_wired) more = ", nullptr, nullptr, true";
    return "{" + literal(slot.name) + ", Role::" + roles[static_cast<std::size_t>(slot.role)] +
           ", Type::" + enumerator(slot.type) + ", {" + number(slot.size.rows) + ", " +
           number(slot.size.cols) + ", " + (slot.size.is_matrix ? "true" : "false") + "}, {" + memory + more +
           "}}";
}

std::string Generator::hosted_source() const {
    const auto& d = diagram_;
    const bool has_standard = uses_standard_library();
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
        const auto& all = node.block->declaration().slots;
        for (std::size_t s = 0; s < all.size(); ++s)
            if (all[s].role != Role::workspace && all[s].role != Role::guard)
                slots += (slots.empty() ? "" : ",\n         ") +
                         hosted_slot(static_cast<int>(n), static_cast<int>(s));
        for (const auto& from : node.providers)
            providers += (providers.empty() ? "{" : ", {") +
                         number(hosted_[static_cast<std::size_t>(from.node)]) + ", " + number(from.slot) +
                         "}";
        const std::string subfolder =
            std::filesystem::path(node.arguments.folder).lexically_relative(options_.folder).generic_string();
        adds += "    blocks->add(" + literal(node.path) + ", " + literal(node.type) + ", " +
                number(node.rate) + ",\n        {" + arguments + "},\n        " +
                literal(subfolder.empty() ? node.arguments.folder : subfolder) + ",\n        {" + slots +
                "},\n        {" + providers + "});\n";
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
                 (task.phase == Phase::output   ? "output"
                  : task.phase == Phase::update ? "update"
                                                : "derivative") +
                 ", " + number(task.index) + "}";
    return "// Blocks made through the factory, from the plugins in BLOCKFACTORY_PLUGIN_PATH.\n#include \"" +
           file_ + ".hpp\"\n\n#include \"bf/codegen/hosted_blocks.hpp\"\n" +
           (has_standard ? "\n#include \"bf/blocks/standard.hpp\"\n" : "") + "\nbf::generated::FixedNames " +
           class_ + "::argument_table() noexcept {\n" +
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
           (has_standard ? "    blocks->registry().add(bf::standard_library());\n" : "") +
           "#ifdef BF_PLUGIN_FOLDER\n    blocks->registry().add_search_path(BF_PLUGIN_FOLDER);\n#endif\n" +
           adds + "    blocks->finish({" + tasks + "});\n    return blocks;\n}\n\nbool " + class_ +
           "::start_hosted_blocks() noexcept {\n    try {\n        if (!hosted_) hosted_ = "
           "make_hosted_blocks();\n    } "
           "catch (const std::exception& error) {\n        problem_ = error.what();\n        return "
           "fail(\"\", "
           "problem_.c_str());\n    }\n    return hosted_->start() || fail(hosted_->failed_block(), "
           "hosted_->failure());\n}\n";
}

} // namespace bf::codegen
