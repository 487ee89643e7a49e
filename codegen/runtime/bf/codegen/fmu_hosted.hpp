// Blocks of an FMU's model that are made from the plugins beside its library.
#pragma once

#include "bf/codegen/fmu_variables.hpp"

#include "bf/core/registry.hpp"

#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace bf::generated {

/// The folder of the library that holds this function.
inline std::filesystem::path own_folder() {
    Dl_info own{};
    if (::dladdr(reinterpret_cast<const void*>(&own_folder), &own) == 0)
        throw std::runtime_error("the folder of the FMU's library is not known");
    return std::filesystem::absolute(own.dli_fname).parent_path();
}

/// Loads the plugins beside this library, whatever others the environment names. Throws PluginError.
/// libbf_core.so stands beside it, too, but a program that has one already gives that to all its libraries.
inline void load_own_plugins(Registry& registry, std::initializer_list<const char*> names) {
    const auto core = core_file();
    void* const its = core.empty() ? nullptr : ::dlopen(core.c_str(), RTLD_NOW | RTLD_NOLOAD);
    void* const layout = its ? ::dlsym(its, "bf_plugin_layout") : nullptr;
    if (!layout || reinterpret_cast<std::uint64_t (*)()>(layout)() != plugin_layout)
        throw PluginError(std::string("this program has another version of libbf_core.so in use (") +
                          (its ? core.string() : "unknown") +
                          ") than the FMU was made with; export it again with that version, or run it in a "
                          "program without BlockFactory");
    ::dlclose(its);
    for (const char* const name : names) registry.load_plugin((own_folder() / name).string() + ".so");
}

template <class Model> struct HostOf {
    static Model& of(bf_run_model* model) noexcept { return *reinterpret_cast<Model*>(model); }
    static constexpr std::size_t alignment = 64;
    static std::size_t own_bytes(bf_run_model* model) noexcept {
        return (of(model).own_bytes() + alignment - 1) / alignment * alignment;
    }
    static bool make(bf_run_model* model, std::string& folder) {
        const auto beside = own_folder().parent_path().parent_path() / "resources";
        folder = ((folder.empty() ? beside : std::filesystem::path(folder)) / "model").string();
        of(model).folder = folder.c_str();
        return of(model).make_blocks();
    }
    static std::size_t snapshot_size(bf_run_model* model) noexcept {
        const auto size = of(model).made_blocks().snapshot_size();
        return size < 0 ? 0 : own_bytes(model) + std::size_t(size);
    }
    static void save(bf_run_model* model, unsigned char* to) noexcept {
        std::memcpy(to, static_cast<const void*>(&of(model)), of(model).own_bytes());
        save_blocks(model, to + own_bytes(model));
    }
    static void restore(bf_run_model* model, const unsigned char* from) noexcept {
        const char* const folder = of(model).folder;
        std::memcpy(static_cast<void*>(&of(model)), from, of(model).own_bytes());
        of(model).folder = folder;
        restore_blocks(model, from + own_bytes(model));
    }
    static void save_blocks(bf_run_model* model, unsigned char* to) noexcept {
        of(model).made_blocks().save(to);
    }
    static void restore_blocks(bf_run_model* model, const unsigned char* from) noexcept {
        of(model).made_blocks().restore(from);
    }
    static constexpr FmuHost functions{make,      snapshot_size, save,          restore,
                                       own_bytes, save_blocks,   restore_blocks};
};

} // namespace bf::generated
