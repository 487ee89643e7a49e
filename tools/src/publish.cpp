// bf publish: a folder that shows and runs models in any browser.
#include "bf/base/base64.hpp"
#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/base/open_file.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/library/stand_ins.hpp"
#include "bf/model/edit.hpp"
#include "bf/recording/writer.hpp"
#include "bf/run/replay.hpp"
#include "bf/view/draw.hpp"
#include "files.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <libdeflate.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct PublishOptions {
    std::vector<std::string> files, recordings;
    std::string folder;
};

/// A model with what is put beside it, and the folder of its page; empty: that of all.
struct Page {
    fs::path file;
    LoadedModel loaded;
    model::Model model;
    fs::path folder;
    std::vector<fs::path> recordings;
    std::map<std::string, std::string> declarations; ///< of the plugins whose blocks it has
};

/// A page runs the standard blocks alone. A model with others is shown with what was recorded of it.
void find_declarations(Page& page) {
    std::string others;
    for (const auto& node : page.loaded.diagram.nodes)
        if (!node.library.empty()) others += "\n  " + node.path + " (" + node.type + ")";
    if (others.empty()) return;
    if (page.recordings.empty())
        throw CommandError(
            "a published page runs the standard blocks alone, and these come from plugins:" + others +
            "\nput standard blocks in their place, or give what was recorded of the model, which the page "
            "then shows: --recording RUN.mcap");
    page.declarations = declarations_of(page.loaded.diagram, *page.loaded.registry);
    if (const std::string path = block_that_differs(page.loaded, page.declarations); !path.empty())
        throw CommandError("a published page cannot show " + page.file.string() + ": without its plugins, " +
                           path + " would be another block there");
}

editor::Drawing drawing_of(const Page& page, const std::string& system) {
    return editor::draw(page.model, system, page.loaded.diagram, {}, {.folder = page.file.parent_path()});
}

/// Images that drawings of the model show: of the model's folder, of bounded size, PNG or SVG.
FileSet images_of(const Page& page) {
    FileSet images;
    const auto look_at = [&](const std::string& system) {
        for (const auto& element : drawing_of(page, system).elements)
            for (const auto& shape : element.shapes)
                if (shape.kind == editor::Shape::Kind::image) images.insert(shape.text);
    };
    look_at("");
    model::walk(page.model, [&](const std::string& path, const model::Block& block) {
        if (block.content()) look_at(path);
    });
    return images;
}

/// All that the model reads, also in variants that are not used now, and the images of its drawings.
FileSet files_to_publish(const Page& page) {
    FileSet files, all = files_of(page.loaded.source.file, page.loaded.source.texts);
    if (page.declarations.empty()) all.merge(files_of(page.loaded)); // else nobody reads what blocks found
    all.merge(images_of(page));
    for (const auto& file : without_secrets(std::move(all), page.loaded))
        files.insert(fs::absolute(file).lexically_normal());
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
void require_relative_names(const Page& page) {
    const auto require = [](const std::string& path, const std::string& text) {
        if (fs::path(text).is_absolute() && fs::exists(text))
            throw CommandError(path + ": cannot publish " + text +
                               ", which is named by its place on this computer; put it beside the model and "
                               "name it relative to that");
    };
    for (const auto& node : page.loaded.diagram.nodes)
        for (const auto& [name, value] : node.arguments) {
            if (value.kind == Value::Kind::text) require(node.path, value.text);
            for (const auto& text : value.texts) require(node.path, text);
        }
    model::walk(page.model, [&](const std::string& path, const model::Block& block) {
        if (block.reference) require(path, block.reference->file);
    });
}

/// The models, each with a page of its own; where there are several, they are named as they lie to each
/// other.
std::vector<Page> pages_of(const std::vector<std::string>& names) {
    std::vector<Page> pages;
    FileSet files;
    for (const auto& name : names) {
        const fs::path file = fs::absolute(name).lexically_normal();
        LoadedModel loaded = load(name);
        formats::Files texts = loaded.source.texts;
        model::Model model = formats::read_yaml(loaded.source.file, texts);
        pages.push_back({file, std::move(loaded), std::move(model), {}, {}, {}});
        require_relative_names(pages.back());
        files.insert(file);
    }
    if (pages.size() == 1) return pages;
    const fs::path common = common_folder(files);
    std::set<fs::path> folders;
    for (auto& page : pages) {
        page.folder = page.file.lexically_relative(common).replace_extension();
        if (!folders.insert(page.folder).second)
            throw CommandError("two models would have the page '" + page.folder.string() +
                               "'; give each once, or rename one");
    }
    return pages;
}

/// A recording goes to the page of its model.
void add_recording(std::vector<Page>& pages, const std::string& file) {
    auto of = pages.begin();
    if (pages.size() > 1) {
        const fs::path model = recorded_source(load_recording(file)).file;
        of = std::ranges::find(pages, model, &Page::file);
        if (of == pages.end())
            throw CommandError(file + " is a recording of " + model.string() + ", which is not published");
    }
    of->recordings.push_back(file);
}

/// A recording with nothing but its signals, and what was set for the run: what it says besides of the model
/// and of the computer that ran it stays here.
std::string signals_of(const fs::path& file, const fs::path& scratch) {
    const recording::Recording recording = load_recording(file);
    struct Sample {
        std::int64_t time;
        const std::byte* data;
        recording::ChannelId channel;
    };
    std::vector<Sample> samples;
    recording::Writer writer(scratch);
    for (const auto& channel : recording.channels) {
        const auto id = writer.add_channel(channel.name, channel.info);
        for (std::size_t k = 0; k < channel.samples(); ++k)
            samples.push_back({channel.time_ns[k], channel.sample(k).data(), id});
    }
    if (const auto overrides = recording.metadata.find("overrides"); overrides != recording.metadata.end())
        writer.add_metadata("overrides", overrides->second);
    std::ranges::stable_sort(samples, {}, &Sample::time);
    writer.begin();
    for (const auto& [time, data, channel] : samples) writer.append(channel, time, data);
    writer.close();
    std::string bytes = read_text_file(scratch);
    fs::remove(scratch);
    return bytes;
}

/// Compressed as gzip, as base64.
std::string packed(const std::string& bytes) {
    constexpr int most = 12; // of the levels of libdeflate
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(most), &libdeflate_free_compressor);
    std::string gzip(libdeflate_gzip_compress_bound(compressor.get(), bytes.size()), '\0');
    gzip.resize(
        libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(), gzip.data(), gzip.size()));
    return base64(gzip);
}

/// The model as a script that the page loads.
std::string script_of(const Page& page, const fs::path& scratch) {
    const FileSet files = files_to_publish(page);
    const fs::path common = common_folder(files), model = page.file.lexically_relative(common);
    nlohmann::json contents = nlohmann::json::object();
    const auto add = [&](const fs::path& name, const std::string& bytes) {
        if (!contents.emplace(name.generic_string(), packed(bytes)).second)
            throw CommandError("two files would be '" + name.generic_string() + "' in the page; rename one");
    };
    for (const auto& file : files) add(file.lexically_relative(common), read_text_file(file));
    for (const auto& recording : page.recordings)
        add(model.parent_path() / recording.filename(), signals_of(recording, scratch));
    nlohmann::json all = {{"file", model.generic_string()}, {"files", contents}};
    if (!page.declarations.empty())
        all["recording"] = (model.parent_path() / page.recordings.front().filename()).generic_string();
    for (const auto& [plugin, text] : page.declarations)
        all["plugins"][plugin + declarations_ending] = packed(text);
    return "blockfactory.model = " + all.dump() + ";\n";
}

/// As an attribute of HTML tells where a file is.
std::string address_of(const fs::path& file) {
    std::string text;
    for (const char c : file.generic_string()) {
        const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || std::strchr("/-_.~", c);
        char code[4];
        std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
        text += is_plain ? std::string(1, c) : code;
    }
    return text;
}

/// The text with another one for each of its marks "{MARK}".
std::string filled(std::string text, const std::string& mark, const std::string& by) {
    const std::string whole = "{" + mark + "}";
    for (auto at = text.find(whole); at != text.npos; at = text.find(whole, at + by.size()))
        text.replace(at, whole.size(), by);
    return text;
}

/// What the page that lists all pages says of one, with a picture of its model.
std::string item_of(const Page& page) {
    const std::string folder = address_of(page.folder);
    return "        <li><a href=\"" + folder + "/index.html\"><img src=\"" + folder +
           "/model.svg\" alt=\"\" /><b>" + escape::xml(page.model.name) + "</b></a> " +
           escape::xml(page.model.doc) + "</li>\n";
}

void execute(const PublishOptions& options) {
    std::vector<Page> pages = pages_of(options.files);
    for (const auto& recording : options.recordings) add_recording(pages, recording);
    for (auto& page : pages) find_declarations(page);
    const fs::path parts = shared_folder("published");
    if (!fs::exists(parts / "engine.js"))
        throw CommandError("the parts of published pages are not in " + parts.string() +
                           "; 'make wasm' installs emscripten and builds them");

    // What all pages share stands once, above them.
    const std::string page_text = read_text_file(parts / "model.html"),
                      list = read_text_file(parts / "list.html");
    OutputFolder folder(options.folder);
    for (const auto& entry : fs::directory_iterator(parts))
        if (const fs::path name = entry.path().filename(); name.extension() != ".html")
            folder.copy(entry.path(), name);
    std::string items;
    for (const auto& page : pages) {
        std::string above;
        for (const auto& part : page.folder) above += part.empty() ? "" : "../";
        folder.write(page.folder / "index.html", filled(page_text, "above", above));
        folder.write(page.folder / "model.js", script_of(page, folder.path() / "recording"));
        if (pages.size() == 1) continue;
        folder.write(page.folder / "model.svg", editor::to_svg(drawing_of(page, "")));
        items += item_of(page);
    }
    if (pages.size() > 1) folder.write("index.html", filled(list, "models", items));
    folder.commit();
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::recursive_directory_iterator(options.folder))
        if (entry.is_regular_file()) bytes += entry.file_size();
    std::printf("%s (%s MB); open %s in a browser, or put the folder on a web server\n",
                options.folder.c_str(), number(std::round(static_cast<double>(bytes) / 1e5) / 10).c_str(),
                (fs::path(options.folder) / "index.html").c_str());
}

} // namespace

void add_publish(CLI::App& app) {
    auto* command = app.add_subcommand("publish", "write a page that shows and runs models in any browser");
    auto options = std::make_shared<PublishOptions>();
    command->add_option("MODEL", options->files, "model file; of several each has a page")
        ->required()
        ->type_name("");
    command->add_option("-o,--output", options->folder, "folder of the page; must be empty or not exist")
        ->type_name("DIR")
        ->required();
    command
        ->add_option("--recording", options->recordings,
                     "MCAP file that the page of its model shows beside the run, and in place of one where "
                     "blocks come from plugins; may be repeated")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""))
        ->allow_extra_args(false);
    command->footer("The page computes in the browser, from a web server or from the file system, and asks "
                    "nothing of any network.\nEdits live in the page alone, and can be downloaded.\n"
                    "Examples:\n"
                    "  bf publish docs/start/motor.yaml -o motor\n"
                    "  bf publish docs/start/motor.yaml examples/dc_motor/model.yaml -o models");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
