#include "files.hpp"

#include "bf/base/open_file.hpp"
#include "bf/formats/yaml.hpp"
#include "robots.hpp"

#include <algorithm>
#include <functional>
#include <sys/utsname.h>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

/// The file that a text names for a block of a model's file in `folder`; empty when it is none.
fs::path file_of(const std::string& text, const fs::path& folder) {
    std::error_code ignored;
    const fs::path file = folder / text;
    return !text.empty() && text.size() < 4096 && fs::is_regular_file(file, ignored) ? file : fs::path();
}

/// Of all settings, those of unused variants, too.
using FoundFile = std::function<void(const fs::path&, const model::Block&, const std::string& setting)>;
void each_file(const model::System& system, const FoundFile& found) {
    for (const auto& block : system.blocks) {
        const fs::path folder = block.where.file ? fs::path(*block.where.file).parent_path() : fs::path();
        for (const auto& setting : block.settings) {
            std::string text = setting.value.text; // which may hold quotes within quotes: "'table.csv'"
            if (text.size() > 2 && text.front() == '\'' && text.back() == '\'')
                text = text.substr(1, text.size() - 2);
            if (const auto file = file_of(text, folder); !file.empty()) found(file, block, setting.name);
        }
        if (const auto* content = block.content()) each_file(*content, found);
    }
}

/// Devices and pipes take what several write.
bool will_be_one_file(const fs::path& a, const fs::path& b) {
    std::error_code error;
    if (fs::exists(a, error)) return is_one_file(a.string(), b.string());
    const fs::path real = fs::weakly_canonical(fs::absolute(a, error), error);
    return !real.empty() && real == fs::weakly_canonical(fs::absolute(b, error), error);
}

bool is_inside(const fs::path& file, const fs::path& folder) {
    const auto relative = file.lexically_relative(folder);
    return !relative.empty() && *relative.begin() != "..";
}

} // namespace

FileSet files_of(const DiagramNode& node) {
    FileSet files;
    for (const auto& [name, value] : node.arguments) {
        auto names = value.texts;
        if (value.kind == Value::Kind::text) names.push_back(value.text);
        for (const auto& text : names)
            if (const auto file = file_of(text, node.arguments.folder); !file.empty()) files.insert(file);
    }
    if (const auto urdf = urdf_of(node.block->resolution()); !urdf.empty()) files.insert(urdf);
    return files;
}

FileSet files_of(const LoadedModel& loaded) {
    FileSet files;
    for (const auto& [file, text] : loaded.source.texts) files.insert(file);
    for (const auto& node : loaded.diagram.nodes) files.merge(files_of(node));
    return files;
}

bool is_installed_robot(const fs::path& file) {
    return is_inside(fs::weakly_canonical(file), fs::weakly_canonical(BF_ROBOT_MODELS));
}

fs::path packed_place(const fs::path& file, const fs::path& model_folder, const char* purpose) {
    const auto named = fs::absolute(file).lexically_normal();
    if (is_inside(named, model_folder)) return "model" / named.lexically_relative(model_folder);
    if (is_installed_robot(file))
        return "share" / fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(BF_ROBOT_MODELS));
    throw CommandError(std::string("cannot ") + purpose + " " + file.string() +
                       ": it is neither in the model's folder " + model_folder.string() +
                       " nor an installed robot; put it beside the model");
}

FileSet files_of(const fs::path& model, std::map<fs::path, std::string> texts) {
    FileSet files;
    each_file(formats::read_yaml(model, texts).root,
              [&](const fs::path& file, const model::Block&, const std::string&) { files.insert(file); });
    for (const auto& [file, text] : texts) files.insert(file);
    return files;
}

FileSet secrets_of(const Diagram& diagram) {
    FileSet secrets;
    for (const auto& node : diagram.nodes)
        for (const auto& argument : node.block->declaration().arguments) {
            if (!argument.is_secret) continue;
            const auto given =
                std::ranges::find(node.arguments, argument.name, [](const auto& a) { return a.first; });
            secrets.insert(fs::path(node.arguments.folder) /
                           (given == node.arguments.end() ? argument.initial : given->second).text);
        }
    return secrets;
}

FileSet without_secrets(FileSet files, const LoadedModel& loaded) {
    FileSet secrets = secrets_of(loaded.diagram);
    auto texts = loaded.source.texts;
    each_file(formats::read_yaml(loaded.source.file, texts).root,
              [&](const fs::path& file, const model::Block& block, const std::string& setting) {
                  try {
                      const auto made = loaded.registry->find(block.type).make({});
                      for (const auto& argument : made->declaration().arguments)
                          if (argument.is_secret && argument.name == setting) secrets.insert(file);
                  } catch (const PluginError&) { // of an unused variant, whose plugin is not here
                  }
              });
    std::erase_if(files, [&](const fs::path& file) {
        return std::ranges::any_of(
            secrets, [&](const fs::path& secret) { return is_one_file(file.string(), secret.string()); });
    });
    return files;
}

fs::path shared_folder(const char* name) {
    // Beside the libraries of this program: a build has the folders of an installation.
    const fs::path core = core_file();
    return core.empty() ? core : core.parent_path().parent_path() / "share" / "blockfactory" / name;
}

std::string machine() {
    utsname system{};
    uname(&system);
    return system.machine;
}

void refuse_overwriting(const std::vector<WrittenFile>& written, const FileSet& read) {
    for (std::size_t i = 0; i < written.size(); ++i) {
        const auto& [option, file] = written[i];
        if (file.empty()) continue;
        const std::string named = option + " " + file.string();
        for (const auto& input : read)
            if (will_be_one_file(file, input))
                throw CommandError(named + " is a file that is read; give another name");
        for (std::size_t j = 0; j < i; ++j)
            if (!written[j].file.empty() && will_be_one_file(file, written[j].file))
                throw CommandError(named + " is the file of " + written[j].option + "; give another name");
    }
}

} // namespace bf::tools
