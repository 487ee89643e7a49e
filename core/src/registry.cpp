#include "bf/core/registry.hpp"

#include "bf/base/library_file.hpp"
#include "bf/base/names.hpp"

#include <algorithm>
#include <cstdlib>
#include <dlfcn.h>
#include <sstream>

namespace bf {

namespace fs = std::filesystem;

namespace {

/// "Name" of Name.so and libName.so.
std::string plugin_name(const fs::path& file) {
    std::string name = file.stem().string();
    if (name.starts_with("lib")) name.erase(0, 3);
    return name;
}

constexpr const char* is_no_exception = "is no std::exception; throw one, which says what is wrong";

std::string layout_text(std::uint64_t layout) {
    if (!layout) return "0 (none is given)";
    std::ostringstream text;
    text << (layout >> 32) << '.' << std::hex << static_cast<std::uint32_t>(layout);
    return text.str();
}

std::string list(const std::vector<fs::path>& paths) {
    std::string text;
    for (const auto& path : paths) text += (text.empty() ? "" : ", ") + path.string();
    return text.empty() ? "no folder at all" : text;
}

} // namespace

fs::path core_file() {
    Dl_info its{};
    return dladdr(reinterpret_cast<const void*>(&core_file), &its) != 0 ? its.dli_fname : fs::path();
}

struct Registry::Loaded {
    std::string name;
    fs::path file;
    void* handle;
};

Registry::Registry() {
    if (const char* path = std::getenv("BLOCKFACTORY_PLUGIN_PATH")) {
        std::istringstream folders(path);
        for (std::string folder; std::getline(folders, folder, ':');)
            if (!folder.empty()) search_path_.emplace_back(folder);
    }
}

Registry::~Registry() {
    classes_.clear(); // their code is in the plugins
    for (auto& plugin : plugins_) dlclose(plugin.handle);
}

void Registry::add(const Library& library) {
    for (const auto& added : library.classes()) {
        for (const auto& known : classes_)
            if (known->qualified_name() == added.qualified_name())
                throw PluginError("block '" + added.qualified_name() +
                                  "' is registered twice; give one of them another name");
        auto& listed = *classes_.emplace_back(std::make_unique<BlockClass>(added));
        listed.make = [make = added.make, name = added.qualified_name()](const Arguments& arguments) {
            try {
                return make(arguments);
            } catch (const std::exception&) {
                throw;
            } catch (...) { // nobody who makes blocks expects it
                throw PluginError("the constructor of block '" + name + "' throws what " + is_no_exception);
            }
        };
    }
}

void Registry::load_plugin(const std::string& name) {
    const auto loaded = [&](const auto& p) { return p.name == name || p.file == name; };
    if (std::any_of(plugins_.begin(), plugins_.end(), loaded)) return;
    // Something else may stand for the plugin.
    if (std::ranges::any_of(classes_, [&](const auto& known) { return known->library == name; })) return;

    fs::path file;
    if (name.find('/') != std::string::npos)
        file = name;
    else
        for (const auto& folder : search_path_)
            for (const auto& candidate : {name + ".so", "lib" + name + ".so"})
                if (file.empty() && fs::exists(folder / candidate)) file = folder / candidate;
    if (std::error_code unseen; file.empty() || (!fs::exists(file, unseen) && !unseen))
        throw PluginError("plugin '" + name + "' was not found: searched " +
                          (file.empty() ? list(search_path_) : file.string()) +
                          did_you_mean(name, available_plugins()) +
                          "; set BLOCKFACTORY_PLUGIN_PATH to the folder that holds " + name +
                          ".so, or let the model name the file: plugins: [FOLDER/" + name + ".so]");

    if (const std::string wrong = why_not_loadable(file.string()); !wrong.empty())
        throw PluginError("plugin " + file.string() + " cannot be loaded: " + wrong);
    dlerror();
    void* handle = dlopen(fs::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
        const char* reason = dlerror();
        throw PluginError("plugin " + file.string() +
                          " cannot be loaded: " + (reason ? reason : "unknown reason") +
                          "; install what it misses or build it against this version");
    }
    plugins_.push_back({name, file, handle});
    try {
        Library library(plugin_name(file), fs::absolute(file));
        fill_from_plugin(library, handle);
        add(library);
    } catch (...) {
        plugins_.back() = {"", "", handle}; // not loaded, but its code may be in use
        throw;
    }
}

void fill_from_plugin(Library& library, void* handle) {
    const std::string plugin = "plugin " + library.file().string();
    void* entry = dlsym(handle, plugin_symbol);
    if (!entry)
        throw PluginError(
            plugin + " has no symbol " + plugin_symbol +
            ": it is no BlockFactory plugin or was built for another interface version; rebuild it");
    // A look-up goes on in the libraries that the plugin was linked to, which carry a layout of their own.
    void* carried = dlsym(handle, "bf_plugin_layout");
    Dl_info entry_place{}, carried_place{};
    if (!carried || !dladdr(entry, &entry_place) || !dladdr(carried, &carried_place) ||
        entry_place.dli_fbase != carried_place.dli_fbase)
        carried = nullptr;
    const std::uint64_t layout = carried ? reinterpret_cast<std::uint64_t (*)()>(carried)() : 0;
    if (layout != plugin_layout)
        throw PluginError(plugin + " was built for interface layout " + layout_text(layout) +
                          ", this program has " + layout_text(plugin_layout) +
                          "; build the plugin again with the headers of this installation");
    const std::string failure = plugin + " cannot register its blocks: ";
    try {
        reinterpret_cast<void (*)(Library&)>(entry)(library);
    } catch (const std::exception& error) {
        throw PluginError(failure + error.what());
    } catch (...) {
        throw PluginError(failure + plugin_symbol + " throws what " + is_no_exception);
    }
}

std::vector<std::string> Registry::available_plugins() const {
    std::vector<std::string> names;
    for (const auto& folder : search_path_) {
        std::error_code unreadable;
        for (const auto& entry : fs::directory_iterator(folder, unreadable))
            if (entry.path().extension() == ".so") names.push_back(plugin_name(entry.path()));
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

const BlockClass& Registry::find(const std::string& qualified_name) {
    const auto lookup = [&]() -> const BlockClass* {
        for (const auto& known : classes_)
            if (known->qualified_name() == qualified_name) return known.get();
        return nullptr;
    };
    if (const auto* known = lookup()) return *known;
    if (const auto slash = qualified_name.find('/'); slash != std::string::npos) {
        load_plugin(qualified_name.substr(0, slash));
        if (const auto* known = lookup()) return *known;
    }
    std::vector<std::string> names;
    for (const auto& known : classes_) names.push_back(known->qualified_name());
    const auto same_name = [&] {
        return std::ranges::find(classes_, qualified_name, [](const auto& known) { return known->name; });
    };
    const bool has_similar = !similar(qualified_name, names).empty();
    if (qualified_name.find('/') == std::string::npos && same_name() == classes_.end() && !has_similar)
        for (const auto& plugin : available_plugins()) try {
                load_plugin(plugin);
            } catch (const PluginError&) { // which is told to those who ask for that one
            }
    // A block of a library asked for without its library is the commonest slip.
    if (const auto its = same_name(); its != classes_.end())
        throw PluginError(
            "there is no block '" + qualified_name + "'; did you mean '" + (*its)->qualified_name() +
            "'? It is in a plugin, which the model names by plugins: [" + (*its)->library + "]");
    throw PluginError("there is no block '" + qualified_name + "'" + did_you_mean(qualified_name, names) +
                      (!has_similar ? "; `bf describe` lists all blocks" : ""));
}

} // namespace bf
