// bf describe: which blocks exist and what they declare.
#include "bf/base/names.hpp"
#include "reference.hpp"
#include "session.hpp"
#include "simulink_library.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

namespace bf::tools {

namespace {

struct DescribeOptions {
    std::string what;
    bool as_json = false, as_markdown = false, as_simulink = false;
    std::string file;
};

constexpr const char* standard = "standard"; // what people call the library without a name

void add_limits(nlohmann::ordered_json& json, const Limits& limits) {
    if (std::isfinite(limits.minimum)) json["minimum"] = limits.minimum;
    if (std::isfinite(limits.above)) json["above"] = limits.above;
    if (std::isfinite(limits.maximum)) json["maximum"] = limits.maximum;
}

nlohmann::ordered_json to_json(const Declared& block) {
    nlohmann::ordered_json json{{"name", block.qualified_name}, {"group", block.group}, {"doc", block.doc}};
    for (const char* list : {"arguments", "quantities", "needs", "provides"})
        json[list] = nlohmann::ordered_json::array();
    for (const auto& a : block.arguments) {
        json["arguments"].push_back(
            {{"name", a.name}, {"type", a.type}, {"default", a.initial}, {"doc", a.doc}});
        if (!a.choices.empty()) json["arguments"].back()["choices"] = a.choices;
        add_limits(json["arguments"].back(), a.limits);
    }
    for (const auto& q : block.quantities) {
        json["quantities"].push_back({{"name", q.name},
                                      {"role", name(q.role)},
                                      {"size", q.size},
                                      {"type", q.type},
                                      {"unit", q.unit},
                                      {"doc", q.doc}});
        if (!q.initial.empty()) json["quantities"].back()["initial"] = q.initial;
        if (!q.condition.empty()) json["quantities"].back()["only_with"] = q.condition;
        add_limits(json["quantities"].back(), q.limits);
        if (!q.at_least.empty()) json["quantities"].back()["at_least"] = q.at_least;
    }
    for (const auto& need : block.needs)
        json["needs"].push_back({{"resource", need.type}, {"doc", need.doc}});
    for (const auto& provided : block.provides) json["provides"].push_back({{"resource", provided.type}});
    return json;
}

/// Rows with their columns aligned; UTF-8 takes one column per character.
void print_table(const std::vector<std::vector<std::string>>& rows) {
    const auto width = [](const std::string& text) {
        return std::count_if(text.begin(), text.end(),
                             [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
    };
    std::vector<std::ptrdiff_t> widths(rows.front().size());
    for (const auto& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
    for (const auto& row : rows) {
        std::string line = "   ";
        for (std::size_t i = 0; i < row.size(); ++i)
            if (widths[i] > 0)
                line +=
                    " " + row[i] + std::string(static_cast<std::size_t>(widths[i] - width(row[i])) + 1, ' ');
        std::printf("%s\n", line.substr(0, line.find_last_not_of(' ') + 1).c_str());
    }
}

void print(const Declared& block) {
    std::printf("%s\n  %s\n", block.qualified_name.c_str(), block.doc.c_str());
    std::vector<std::vector<std::string>> rows;
    const auto section = [&](const char* heading) {
        if (rows.empty()) return;
        std::printf("\n  %s\n", heading);
        print_table(rows);
        rows.clear();
    };
    for (const auto& a : block.arguments) {
        std::string choices;
        for (const auto& c : a.choices) choices += (choices.empty() ? "one of " : ", ") + c;
        const std::string doc = with_limits(a.doc, a.limits);
        rows.push_back(
            {a.name, "= " + a.initial, doc + (doc.empty() || choices.empty() ? "" : "; ") + choices});
    }
    section("arguments (fixed when the block is made)");
    for (const auto& [role, heading] : shown_roles) {
        for (const auto& q : block.quantities)
            if (q.role == role)
                rows.push_back({q.name, q.initial.empty() ? "" : "= " + q.initial, q.size, q.type, q.unit,
                                with_limits(q.doc, q.limits, q.at_least) +
                                    (q.condition.empty() ? "" : " (only with " + q.condition + ")")});
        section(heading);
    }
    for (const auto& need : block.needs)
        std::printf("\n  needs a %s around it: %s\n", need.type.c_str(), need.doc.c_str());
    for (const auto& provided : block.provides) std::printf("\n  provides a %s\n", provided.type.c_str());
}

void print(const std::vector<Declared>& blocks) {
    for (std::size_t i = 0; i < blocks.size();) {
        const auto &library = blocks[i].library, &group = blocks[i].group;
        std::printf("%s%s / %s\n", i ? "\n" : "", library.empty() ? standard : library.c_str(),
                    group.c_str());
        std::vector<std::vector<std::string>> rows;
        for (; i < blocks.size() && blocks[i].library == library && blocks[i].group == group; ++i)
            rows.push_back({blocks[i].name, first_sentence(blocks[i].doc)});
        print_table(rows);
    }
}

/// The library that `what` names, or nothing: then it is a block. Plugins are loaded as far as needed.
std::optional<std::string> find_library(Registry& registry, const std::string& what) {
    if (what.empty() || what.find('/') != std::string::npos) return std::nullopt;
    if (what == standard) return "";
    const auto plugins = registry.available_plugins();
    if (std::find(plugins.begin(), plugins.end(), what) == plugins.end()) return std::nullopt;
    registry.load_plugin(what);
    return what;
}

/// What a class of blocks declares. Throws CommandError for one that cannot be made.
Declared declared_by_name(const BlockClass& type) {
    try {
        return declared(type);
    } catch (const std::exception& error) {
        throw CommandError("block '" + type.qualified_name() + "' cannot be made: " + error.what());
    }
}

/// A plugin that cannot be loaded hides no other.
void load_all(Registry& registry) {
    for (const auto& plugin : registry.available_plugins()) {
        try {
            registry.load_plugin(plugin);
        } catch (const PluginError& error) {
            std::fprintf(stderr, "bf: left out: %s\n", error.what());
        }
    }
}

const BlockClass& find_block(Registry& registry, const std::string& what) {
    try {
        return registry.find(what);
    } catch (const PluginError&) {
        load_all(registry);
        std::vector<std::string> names = registry.available_plugins();
        names.emplace_back(standard);
        if (const auto hint = did_you_mean(what, names); !hint.empty())
            throw CommandError("there is no library or block '" + what + "'" + hint);
        return registry.find(what);
    }
}

void execute(const DescribeOptions& options) {
    auto registry = make_registry();
    const auto library = find_library(*registry, options.what);
    std::vector<Declared> blocks;
    if (!library && !options.what.empty()) {
        blocks.push_back(declared_by_name(find_block(*registry, options.what)));
    } else {
        if (!library) load_all(*registry);
        for (const auto& type : registry->classes()) try {
                if (!library || type->library == *library) blocks.push_back(declared_by_name(*type));
            } catch (const CommandError& error) { // it hides no other
                std::fprintf(stderr, "bf: left out: %s\n", error.what());
            }
        std::stable_sort(blocks.begin(), blocks.end(), [](const Declared& a, const Declared& b) {
            return std::pair(a.library, a.group) < std::pair(b.library, b.group);
        });
    }
    const bool is_block = !library && !options.what.empty();
    if (!options.file.empty() && !options.as_simulink)
        throw CommandError("-o goes with --simulink-library; redirect the output of the other kinds");
    if (options.as_simulink) {
        if (!library)
            throw CommandError("--simulink-library writes one library: give 'standard' or a plugin's name");
        std::vector<const BlockClass*> classes;
        for (const auto& type : registry->classes())
            if (type->library == *library) classes.push_back(type.get());
        const std::string text = simulink_library(options.what, classes);
        if (options.file.empty()) {
            std::fputs(text.c_str(), stdout);
        } else {
            OutputFile file(options.file);
            file.write(text);
            file.commit();
        }
    } else if (options.as_markdown) {
        if (!library)
            throw CommandError(
                "--markdown writes the page of one library: give 'standard' or a plugin's name");
        std::fputs(reference_page(*library, blocks).c_str(), stdout);
    } else if (options.as_json) {
        auto list = nlohmann::ordered_json::array();
        for (const auto& block : blocks) list.push_back(to_json(block));
        std::fputs(to_text(is_block ? list[0] : list).c_str(), stdout);
    } else if (is_block) {
        print(blocks.front());
    } else {
        print(blocks);
    }
}

} // namespace

void add_describe(CLI::App& app) {
    auto* command = app.add_subcommand("describe", "which blocks exist and what they declare");
    auto options = std::make_shared<DescribeOptions>();
    command
        ->add_option("WHAT", options->what,
                     "a library, or a block as BLOCK or LIBRARY/BLOCK; nothing: everything")
        ->type_name("");
    auto* json = command->add_flag("--json", options->as_json, "print as JSON");
    auto* markdown = command->add_flag("--markdown", options->as_markdown, "print a library's reference page")
                         ->excludes(json);
    command
        ->add_flag("--simulink-library", options->as_simulink,
                   "write a library as a Simulink library of masked blocks (.mdl)")
        ->excludes(json)
        ->excludes(markdown);
    command->add_option("-o,--output", options->file, "file of the Simulink library")->type_name("FILE");
    command->footer("Examples:\n"
                    "  bf describe WholeBodyToolbox/MassMatrix\n"
                    "  bf describe --markdown standard > standard.md\n"
                    "  bf describe --simulink-library WholeBodyToolbox -o WholeBodyToolbox.mdl");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
