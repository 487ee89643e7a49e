#include "bf/library/load.hpp"

#include "bf/base/files.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/library/stand_ins.hpp"

#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace bf {

namespace fs = std::filesystem;

namespace {

void collect(const std::vector<model::Variable>& variables, const std::string& prefix,
             std::vector<Override>& to) {
    for (const auto& variable : variables)
        if (variable.fields.empty())
            to.push_back({prefix + variable.name, variable.value.matlab(), variable.value.where});
        else
            collect(variable.fields, prefix + variable.name + ".", to);
}

/// Texts of the model and of all it refers to.
void collect(const model::Model& model, const fs::path& file, formats::Files& texts) {
    if (!texts.emplace(file, formats::write_yaml(model)).second) return;
    const auto visit = [&](const auto& self, const model::System& system) -> void {
        for (const auto& block : system.blocks) {
            if (block.reference && block.reference->model)
                collect(*block.reference->model,
                        (file.parent_path() / block.reference->file).lexically_normal(), texts);
            else if (block.content())
                self(self, *block.content());
        }
    };
    visit(visit, model.root);
}

ModelSource source_of(const model::Model& model, const fs::path& file) {
    ModelSource source{fs::absolute(file).lexically_normal(), {}, {}};
    collect(model, source.file, source.texts);
    return source;
}

/// `shown` stands for the file in messages.
ExaminedModel examine(ModelSource source, const fs::path& shown, const std::vector<Override>& overrides) {
    source.file = fs::absolute(source.file).lexically_normal();
    ExaminedModel found{{make_registry(), std::move(source), {}}, {}};
    for (const auto& [name, text, where] : overrides) found.source.overrides.emplace_back(name, text);
    const model::Model model = formats::read_yaml(shown, found.source.texts);
    Examined elaborated =
        examine(model, *found.registry, {overrides, found.source.file.parent_path().string()});
    found.diagram = std::move(elaborated.diagram);
    found.diagnostics = std::move(elaborated.diagnostics);
    return found;
}

LoadedModel load(ModelSource source, const fs::path& shown, const std::vector<Override>& overrides) {
    ExaminedModel found = examine(std::move(source), shown, overrides);
    if (!found.diagnostics.empty()) throw model::Errors(std::move(found.diagnostics));
    return found;
}

/// For plugins that are not there, as far as the search path has their declarations.
void add_stand_ins(Registry& registry) {
    std::set<std::string> known;
    for (const auto& name : registry.available_plugins()) known.insert(name);
    for (const auto& folder : registry.search_path()) {
        std::error_code unreadable;
        for (const auto& entry : fs::directory_iterator(folder, unreadable)) {
            std::string name = entry.path().filename();
            if (!name.ends_with(declarations_ending)) continue;
            name.resize(name.size() - std::string_view(declarations_ending).size());
            if (known.insert(name).second) registry.add(stand_ins(read_text_file(entry.path())));
        }
    }
}

} // namespace

std::unique_ptr<Registry> make_registry() {
    auto registry = std::make_unique<Registry>();
    registry->add(standard_library());
    // Plugins stand beside libbf_core.so, which they share with this program: a build has the folders of an
    // installation, and an installation does not look where it was built.
    if (const fs::path core = core_file(); !core.empty())
        registry->add_search_path(core.parent_path() / "blockfactory");
    add_stand_ins(*registry);
    return registry;
}

ExaminedModel examine(const fs::path& file, const std::vector<Override>& overrides) {
    return examine(ModelSource{file, {}, {}}, file, overrides);
}

LoadedModel load(const fs::path& file, const std::vector<Override>& overrides,
                 std::map<fs::path, std::string> texts) {
    return load(ModelSource{file, std::move(texts), {}}, file, overrides);
}

LoadedModel load(const ModelSource& source) {
    std::vector<Override> overrides;
    for (const auto& [name, text] : source.overrides) overrides.push_back({name, text, {}});
    LoadedModel loaded = load(ModelSource{source.file, source.texts, {}}, source.file, overrides);
    for (const auto& [file, text] : loaded.source.texts)
        if (!source.texts.contains(file)) throw FileError(file.string() + " is not in the recording");
    return loaded;
}

LoadedModel load(const model::Model& model, const fs::path& file, const std::vector<Override>& overrides) {
    return load(source_of(model, file), file, overrides);
}

ExaminedModel examine(const model::Model& model, const fs::path& file,
                      const std::vector<Override>& overrides) {
    return examine(source_of(model, file), file, overrides);
}

ExaminedModel examine(const model::Model& model, ModelSource source, const std::set<fs::path>* files,
                      std::unique_ptr<Registry> registry) {
    if (!registry) registry = make_registry();
    ExaminedModel found{{std::move(registry), std::move(source), {}}, {}};
    std::vector<Override> overrides;
    for (const auto& [name, text] : found.source.overrides) overrides.push_back({name, text, {}});
    Examined elaborated =
        examine(model, *found.registry, {overrides, found.source.file.parent_path().string(), files});
    found.diagram = std::move(elaborated.diagram);
    found.diagnostics = std::move(elaborated.diagnostics);
    return found;
}

std::vector<Override> read_overrides(const fs::path& file) {
    std::vector<Override> overrides;
    collect(formats::read_yaml_variables(read_text_file(file, std::size_t{64} << 20), file.string()), "",
            overrides);
    // `Gain.Kp: 1` and `Gain: {Kp: 2}` are different keys of YAML.
    std::map<std::string_view, const model::Location*> seen;
    std::vector<model::Diagnostic> doubles;
    for (const auto& [name, text, where] : overrides)
        if (const auto [first, is_new] = seen.try_emplace(name, &where); !is_new)
            doubles.push_back({where, "", "a second '" + name + "'",
                               "remove or rename one; the first is at " + first->second->text()});
    if (!doubles.empty()) throw model::Errors(std::move(doubles));
    return overrides;
}

codegen::Options generation_options(const LoadedModel& loaded, codegen::Options options) {
    const fs::path folder = loaded.source.file.parent_path();
    const auto relative = [&](const fs::path& file) {
        return file.lexically_relative(folder).generic_string();
    };
    options.folder = folder.string();
    options.model_file = relative(loaded.source.file);
    for (const auto& [file, text] : loaded.source.texts) options.texts[relative(file)] = text;
    options.overrides = loaded.source.overrides;
    return options;
}

} // namespace bf
