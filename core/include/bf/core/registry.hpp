// Which blocks exist, and the plugins that bring them.
#pragma once

#include "bf/core/block.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf {

/// A class of blocks that can be made by name.
struct BlockClass {
    std::string library, name; ///< "WholeBodyToolbox", "MassMatrix"; standard blocks have library ""
    std::string group;         ///< where palettes and pages show it
    std::string doc;           ///< first sentence: what it does; then equation, source, errors
    std::function<std::unique_ptr<Block>(const Arguments&)> make;
    Block::Methods methods;
    /// The name models use: "MassMatrix" for standard blocks, "WholeBodyToolbox/MassMatrix" for others.
    std::string qualified_name() const { return library.empty() ? name : library + "/" + name; }
};

/// What a plugin fills: its blocks by group.
class Library {
  public:
    explicit Library(std::string name, std::filesystem::path file = {})
        : name_(std::move(name)), file_(std::move(file)) {}
    Library(Library&&) = default;
    /// `auto group = library.group("a")` would fill a copy that nobody reads; write `auto&`.
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;

    /// The group of the blocks that follow.
    Library& group(std::string name) {
        group_ = std::move(name);
        return *this;
    }
    /// Lists block class B, whose constructor takes `const Arguments&`.
    template <class B> Library& add(const char* name, const char* doc) {
        classes_.push_back({name_, name, group_, doc,
                            [](const Arguments& arguments) -> std::unique_ptr<Block> {
                                return std::make_unique<B>(arguments);
                            },
                            methods_of<B>()});
        return *this;
    }
    /// Lists a class that is known only at run time, e.g. from a plugin of another kind.
    Library& add(BlockClass block_class) {
        classes_.push_back(std::move(block_class));
        return *this;
    }
    const std::string& name() const { return name_; }
    /// Of the plugin; empty for blocks that are linked in.
    const std::filesystem::path& file() const { return file_; }
    const std::vector<BlockClass>& classes() const { return classes_; }

  private:
    std::string name_, group_;
    std::filesystem::path file_;
    std::vector<BlockClass> classes_;
};

/// A plugin is a shared library with this one function. Its name carries the interface version, so that a
/// plugin built for another one is refused by name.
///   extern "C" void bf_plugin_v1(bf::Library& library) { library.group("math").add<Gain>("Gain", "..."); }
inline constexpr const char* plugin_symbol = "bf_plugin_v1";

/// What a plugin and the program that loads it must agree on, since they share these objects: a number in the
/// upper half that changes with their meaning, and the sizes of the types with Eigen's alignment in the
/// lower.
inline constexpr std::uint64_t plugin_layout = [] {
    constexpr std::uint64_t number = 1;
    std::uint32_t hash = 2166136261u; // FNV-1a
    for (const std::size_t size : {sizeof(Block),
                                   sizeof(Block::Methods),
                                   sizeof(BlockClass),
                                   sizeof(Library),
                                   sizeof(Declaration),
                                   sizeof(ArgumentDeclaration),
                                   sizeof(Slot),
                                   sizeof(About),
                                   sizeof(AboutArgument<double>),
                                   sizeof(Call),
                                   sizeof(Call::Reference),
                                   sizeof(ObjectDeclaration),
                                   sizeof(ProvisionDeclaration),
                                   sizeof(RequirementDeclaration),
                                   sizeof(Object),
                                   sizeof(Value),
                                   sizeof(Arguments),
                                   sizeof(Frame),
                                   sizeof(Clock),
                                   sizeof(Size),
                                   sizeof(Status),
                                   static_cast<std::size_t>(EIGEN_MAX_ALIGN_BYTES)})
        hash = (hash ^ static_cast<std::uint32_t>(size)) * 16777619u;
    return number << 32 | hash;
}();

/// Has the opened plugin `handle` list its blocks in `library`. Throws PluginError when it has no entry or
/// was built with another layout.
void fill_from_plugin(Library& library, void* handle);

/// The file of this library, libbf_core.so, beside which a build and an installation have theirs; empty: the
/// system does not tell.
std::filesystem::path core_file();

/// A plugin or block that cannot be had: which paths were searched, which file, which symbol, the remedy.
struct PluginError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// All known block classes. An ordinary object: two registries do not know of each other.
class Registry {
  public:
    Registry();
    ~Registry();
    Registry(const Registry&) = delete;
    Registry& operator=(const Registry&) = delete;

    void add(const Library& library);
    /// Loads the plugin `name` ("WholeBodyToolbox", found as WholeBodyToolbox.so or libWholeBodyToolbox.so in
    /// the search path) or the file of that path. Does nothing when it is loaded already. Throws PluginError.
    void load_plugin(const std::string& name);

    /// Folders where plugins are searched: those of BLOCKFACTORY_PLUGIN_PATH, then those added here.
    const std::vector<std::filesystem::path>& search_path() const { return search_path_; }
    void add_search_path(std::filesystem::path folder) { search_path_.push_back(std::move(folder)); }
    /// Names of the plugins in the search path, loaded or not.
    std::vector<std::string> available_plugins() const;

    /// The class of that qualified name; loads the plugin "Library" for "Library/Block" when needed.
    /// Throws PluginError that names similar blocks.
    const BlockClass& find(const std::string& qualified_name);
    const std::vector<std::unique_ptr<BlockClass>>& classes() const { return classes_; }

  private:
    struct Loaded;
    std::vector<std::unique_ptr<BlockClass>> classes_;
    std::vector<std::filesystem::path> search_path_;
    std::vector<Loaded> plugins_; // keeps code alive as long as the registry
};

} // namespace bf

/// Every plugin carries the layout that it was built with; `fill_from_plugin` compares it before anything
/// else.
extern "C" [[gnu::used, gnu::visibility("default")]] inline std::uint64_t bf_plugin_layout() noexcept {
    return bf::plugin_layout;
}
