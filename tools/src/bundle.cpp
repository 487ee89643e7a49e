#include "bundle.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/packages.hpp"
#include "files.hpp"
#include "robots.hpp"

#include <algorithm>
#include <dlfcn.h>
#include <link.h>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

/// A shared library of this process, as its own tables describe it.
class Loaded {
  public:
    explicit Loaded(const link_map* map) : map_(map) {
        for (auto* entry = map->l_ld; entry->d_tag != DT_NULL; ++entry)
            if (entry->d_tag == DT_STRTAB) names_ = reinterpret_cast<const char*>(entry->d_un.d_ptr);
    }
    fs::path file() const { return map_->l_name; }
    /// By which others look for it.
    std::string name() const {
        const auto names = all(DT_SONAME);
        return names.empty() ? file().filename().string() : names.front();
    }
    std::vector<std::string> needs() const { return all(DT_NEEDED); }

  private:
    std::vector<std::string> all(ElfW(Sxword) tag) const {
        std::vector<std::string> found;
        for (auto* entry = map_->l_ld; entry->d_tag != DT_NULL; ++entry)
            if (entry->d_tag == tag) found.emplace_back(names_ + entry->d_un.d_val);
        return found;
    }
    const link_map* map_;
    const char* names_ = "";
};

bool is_of_c_library(const std::string& name) {
    for (const char* its : {"libc.so.", "libm.so.", "libdl.so.", "libpthread.so.", "librt.so.", "ld-linux"})
        if (name.starts_with(its)) return true;
    return false;
}

/// Of libbf_core.so, whatever links lead there.
fs::path real_core_file() {
    const fs::path core = core_file();
    if (core.empty()) throw CommandError("libbf_core.so is not where this program can see it");
    return fs::weakly_canonical(core);
}

/// All libraries of this process, by their names.
std::map<std::string, Loaded> all_loaded() {
    std::map<std::string, Loaded> all;
    void* const program = ::dlopen(nullptr, RTLD_LAZY); // which is the first one
    link_map* map = nullptr;
    if (!program || ::dlinfo(program, RTLD_DI_LINKMAP, static_cast<void*>(&map)) != 0)
        throw CommandError("the libraries of this program cannot be listed");
    ::dlclose(program);
    for (; map; map = map->l_next)
        if (map->l_name && map->l_name[0] == '/') all.emplace(Loaded(map).name(), Loaded(map));
    return all;
}

fs::path file_of_plugin(const std::string& plugin, const Registry& registry) {
    for (const auto& folder : registry.search_path())
        for (const auto& name : {plugin + ".so", "lib" + plugin + ".so"})
            if (fs::exists(folder / name)) return fs::absolute(folder / name);
    throw CommandError("the file of plugin '" + plugin + "' is not in the folders of plugins");
}

/// The values of an attribute in XML, whatever element has it.
std::vector<std::string> values_of(const std::string& attribute, const std::string& text) {
    std::vector<std::string> all;
    const std::string name = attribute + "=";
    for (auto at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
        const auto begin = at + name.size() + 1;
        const auto end = begin < text.size() ? text.find(text[begin - 1], begin) : std::string::npos;
        if (end == std::string::npos) break;
        all.push_back(text.substr(begin, end - begin));
    }
    return all;
}

/// The meshes that a URDF names, as far as they are files: a world needs no others. Throws CommandError for
/// those that it names in a way that no other computer has.
FileSet meshes_of(const fs::path& urdf, const fs::path& model_folder) {
    FileSet meshes;
    const std::string text = read_text_file(urdf);
    auto folders = values_of("meshdir", text);
    folders.resize(1);
    for (const auto& address : values_of("filename", text))
        for (const auto& file : mesh_candidates(
                 address, urdf, {model_folder, fs::path(BF_ROBOT_MODELS), fs::path(BF_ROBOT_MODELS) / "iCub"},
                 folders.front())) {
            std::error_code error;
            if (!fs::is_regular_file(file, error)) continue;
            if (address.starts_with(file_scheme))
                throw CommandError("cannot bundle the mesh " + address + " of " + urdf.string() +
                                   ": it is looked for at that place alone; name it relative to the URDF");
            meshes.insert(file.lexically_normal());
            break;
        }
    return meshes;
}

} // namespace

std::map<std::string, fs::path> libraries_of(const std::vector<std::string>& plugins,
                                             const Registry& registry) {
    constexpr std::pair<const char*, const char*> others[] = {
        {"FMI", "opens FMUs from the folders of plugins; connect the FMUs in the importer"},
        {"Yarp", "needs YARP's own devices and its server; give the FMU inputs and outputs for the robot"}};
    for (const auto& plugin : plugins)
        for (const auto& [name, why] : others)
            if (plugin == name)
                throw CommandError("no FMU can be made of blocks of the plugin " + plugin + ", which " + why);
    const auto loaded = all_loaded();
    std::map<std::string, fs::path> all;
    double total = 0;
    const auto add = [&](const auto& self, const std::string& name, const std::string& plugin) -> void {
        if (is_of_c_library(name) || all.contains(name)) return;
        const auto its = loaded.find(name);
        if (its == loaded.end())
            throw CommandError("plugin " + plugin + " needs " + name + ", which this program has not loaded");
        all[name] = fs::weakly_canonical(its->second.file());
        total += static_cast<double>(fs::file_size(all[name])) / 1e6;
        if (total > bundle_limit)
            throw CommandError("the libraries of plugin " + plugin + " are more than " +
                               number(bundle_limit) + " MB, with " + name + " (" +
                               number(std::round(static_cast<double>(fs::file_size(all[name])) / 1e6)) +
                               " MB); export the part of the model without its blocks");
        for (const auto& needed : its->second.needs()) self(self, needed, plugin);
    };
    add(add, real_core_file().filename(), "");
    for (const auto& plugin : plugins) {
        const auto file = file_of_plugin(plugin, registry);
        void* const handle = ::dlopen(file.c_str(), RTLD_LAZY | RTLD_NOLOAD);
        link_map* map = nullptr;
        if (!handle || ::dlinfo(handle, RTLD_DI_LINKMAP, static_cast<void*>(&map)) != 0)
            throw CommandError("plugin " + file.string() + " is not the one that this program has loaded");
        ::dlclose(handle);
        for (const auto& needed : Loaded(map).needs()) add(add, needed, plugin);
        all[plugin + ".so"] = fs::weakly_canonical(file);
    }
    return all;
}

CoreOptions core_options() {
    const fs::path libraries = real_core_file().parent_path();
    CoreOptions options{" -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MALLOC_ALREADY_ALIGNED=1", {}};
    std::vector<fs::path> folders{libraries.parent_path() / "include"};
    const fs::path source = BF_SOURCE_DIRECTORY;
    if (!fs::exists(folders[0] / "bf/core/registry.hpp"))
        folders = {source / "core/include", source / "base/include", source / "kernels/include",
                   source / "program/include", source / "blocks/include"};
    if (!fs::exists(folders[0] / "bf/core/registry.hpp"))
        throw CommandError("this installation of BlockFactory has no headers (" +
                           (libraries.parent_path() / "include").string() +
                           "), which the code of blocks from plugins is compiled with; export the FMU where "
                           "BlockFactory was built or installed");
    for (const auto& folder : folders) options.compile += " -I" + escape::shell(folder.string());
    options.compile += " -isystem " + escape::shell(BF_EIGEN);
    for (const char* name : {"blocks", "matlab", "base"})
        options.blocks += " " + escape::shell((libraries / ("libbf_" + std::string(name) + ".a")).string());
    return options;
}

std::map<std::string, fs::path> resources_of(const LoadedModel& loaded) {
    const fs::path model_folder = loaded.source.file.parent_path();
    FileSet files;
    for (const auto& node : loaded.diagram.nodes) files.merge(files_of(node));
    for (const auto& file : world_files_of(loaded.diagram)) {
        if (is_installed_robot(file))
            throw CommandError("cannot bundle " + file.string() +
                               ": the file of a world names an installed robot; copy the robot beside it");
        files.insert(file);
        files.merge(meshes_of(file, model_folder));
    }
    if (has_world(loaded.diagram))
        for (const auto& node : loaded.diagram.nodes)
            if (const auto urdf = urdf_of(node.block->resolution()); !urdf.empty())
                files.merge(meshes_of(urdf, model_folder));
    std::map<std::string, fs::path> all;
    for (const auto& file : without_secrets(std::move(files), loaded))
        all[packed_place(file, model_folder, "bundle").generic_string()] = file;
    return all;
}

std::map<std::string, std::string> folders_of(const Diagram& diagram) {
    std::map<std::string, std::string> folders;
    for (const auto& node : diagram.nodes)
        if (const auto urdf = urdf_of(node.block->resolution()); !urdf.empty() && is_installed_robot(urdf))
            folders[node.path] = "..";
    return folders;
}

} // namespace bf::tools
