// bf publish: a folder that shows and runs a model in any browser.
#include "bf/base/base64.hpp"
#include "bf/base/files.hpp"
#include "bf/base/open_file.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "files.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct PublishOptions {
    std::string file, folder;
    std::vector<std::string> recordings;
};

/// A published page has the standard blocks alone.
void require_standard_blocks(const LoadedModel& loaded) {
    std::string others;
    for (const auto& node : loaded.diagram.nodes)
        if (!loaded.registry->find(node.type).library.empty())
            others += "\n  " + node.path + " (" + node.type + ")";
    if (!others.empty())
        throw CommandError(
            "a published page runs the standard blocks alone, and these come from plugins:" + others +
            "\nput standard blocks in their place, or show the model as a picture (bf draw) and "
            "its run as a plot (bf plot)");
}

/// All that the model reads, also in variants that are not used now.
FileSet files_to_publish(const LoadedModel& loaded) {
    FileSet files, all = files_of(loaded);
    all.merge(files_of(loaded.source.file, loaded.source.texts));
    for (const auto& file : all) files.insert(fs::absolute(file).lexically_normal());
    return files;
}

/// The innermost folder that all of them are in.
fs::path common_folder(const FileSet& files) {
    fs::path folder = files.begin()->parent_path();
    for (const auto& file : files)
        while (file.lexically_relative(folder).generic_string().starts_with(".."))
            folder = folder.parent_path();
    return folder;
}

/// A name that begins at the root of this computer is nothing in a page.
void require_relative_names(const LoadedModel& loaded) {
    const auto require = [](const std::string& path, const std::string& text) {
        if (fs::path(text).is_absolute() && fs::exists(text))
            throw CommandError(path + ": cannot publish " + text +
                               ", which is named by its place on this computer; put it beside the model and "
                               "name it relative to that");
    };
    for (const auto& node : loaded.diagram.nodes)
        for (const auto& [name, value] : node.arguments) {
            if (value.kind == Value::Kind::text) require(node.path, value.text);
            for (const auto& text : value.texts) require(node.path, text);
        }
    formats::Files texts = loaded.source.texts;
    model::walk(formats::read_yaml(loaded.source.file, texts),
                [&](const std::string& path, const model::Block& block) {
                    if (block.reference) require(path, block.reference->file);
                });
}

void execute(const PublishOptions& options) {
    const LoadedModel loaded = load(options.file);
    require_standard_blocks(loaded);
    require_relative_names(loaded);
    const fs::path page = shared_folder("published");
    if (!fs::exists(page / "engine.js"))
        throw CommandError("the parts of published pages are not in " + page.string() +
                           "; 'make wasm' installs emscripten and builds them");

    const FileSet files = files_to_publish(loaded);
    const fs::path common = common_folder(files);
    nlohmann::json contents = nlohmann::json::object();
    const auto add = [&](const fs::path& name, const fs::path& file) {
        if (!contents.emplace(name.generic_string(), base64(read_text_file(file))).second)
            throw CommandError("two files would be '" + name.generic_string() + "' in the page; rename one");
    };
    for (const auto& file : files) add(file.lexically_relative(common), file);
    const fs::path model = fs::absolute(options.file).lexically_normal().lexically_relative(common);
    for (const fs::path recording : options.recordings)
        add(model.parent_path() / recording.filename(), recording);

    OutputFolder folder(options.folder);
    for (const auto& entry : fs::directory_iterator(page)) folder.copy(entry.path(), entry.path().filename());
    folder.write("model.js",
                 "blockfactory.model = " +
                     nlohmann::json{{"file", model.generic_string()}, {"files", contents}}.dump() + ";\n");
    folder.commit();
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(options.folder)) bytes += entry.file_size();
    std::printf("%s (%s MB); open %s in a browser, or put the folder on a web server\n",
                options.folder.c_str(), number(std::round(static_cast<double>(bytes) / 1e5) / 10).c_str(),
                (fs::path(options.folder) / "index.html").c_str());
}

} // namespace

void add_publish(CLI::App& app) {
    auto* command = app.add_subcommand("publish", "write a page that shows and runs a model in any browser");
    auto options = std::make_shared<PublishOptions>();
    command->add_option("MODEL", options->file, "model file, of standard blocks")->required()->type_name("");
    command->add_option("-o,--output", options->folder, "folder of the page; must be empty or not exist")
        ->type_name("DIR")
        ->required();
    command
        ->add_option("--recording", options->recordings,
                     "MCAP file that the page shows beside the run; may be repeated")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""))
        ->allow_extra_args(false);
    command->footer("The page computes in the browser, from a web server or from the file system, and asks "
                    "nothing of any "
                    "network.\nEdits live in the page alone, and can be downloaded.\n"
                    "Example: bf publish docs/start/motor.yaml -o motor");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
