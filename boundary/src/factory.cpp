#include "BlockFactory/Core/FactorySingleton.h"

#include "BlockFactory/Core/Block.h"
#include "bf/base/library_file.hpp"
#include "bf/boundary/as_legacy_block.hpp"
#include "bf/core/registry.hpp"

#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <map>
#include <mutex>
#include <sstream>

namespace fs = std::filesystem;

namespace {

std::vector<std::string> folders_of(const std::string& list) {
    std::vector<std::string> folders;
    std::istringstream stream(list);
    for (std::string folder; std::getline(stream, folder, ':');)
        if (!folder.empty()) folders.push_back(folder);
    return folders;
}
std::string environment(const char* variable) {
    const char* value = std::getenv(variable);
    return value ? value : "";
}

} // namespace

namespace sharedlibpp {

bool SharedLibrary::open(const char* filename) {
    close();
    // A name without a folder is looked for where the system keeps libraries.
    if (std::strchr(filename, '/'))
        if (error_ = bf::why_not_loadable(filename); !error_.empty()) return false;
    dlerror();
    handle_ = dlopen(filename, RTLD_LAZY | RTLD_LOCAL);
    if (!handle_) {
        const char* reason = dlerror();
        error_ = reason ? reason : "unknown reason";
    }
    return isValid();
}

bool SharedLibrary::close() {
    error_.clear();
    if (handle_ && dlclose(handle_) != 0) error_ = "the library cannot be closed";
    handle_ = nullptr;
    return error_.empty();
}

void* SharedLibrary::getSymbol(const char* symbolName) {
    if (!handle_) return nullptr;
    dlerror();
    void* symbol = dlsym(handle_, symbolName);
    error_.clear();
    if (const char* reason = symbol ? nullptr : dlerror()) error_ = reason;
    return symbol;
}

struct SharedLibraryFactory::Native {
    std::shared_ptr<const bf::Library> library;
};

SharedLibraryFactory::SharedLibraryFactory() : api_(), status_(Status::None), references_(1) {}
SharedLibraryFactory::SharedLibraryFactory(const char* dll_name, const char* factory_name)
    : SharedLibraryFactory() {
    open(dll_name, factory_name);
}
SharedLibraryFactory::SharedLibraryFactory(const char* dll_name, std::int32_t startCheck,
                                           std::int32_t endCheck, std::int32_t systemVersion,
                                           const char* factory_name)
    : SharedLibraryFactory() {
    open(dll_name, startCheck, endCheck, systemVersion, factory_name);
}
SharedLibraryFactory::~SharedLibraryFactory() = default;

bool SharedLibraryFactory::openNative(const std::string& class_name) {
    void* entry = library_.getSymbol(bf::plugin_symbol);
    Dl_info found;
    if (!entry || !dladdr(entry, &found) || !found.dli_fname) return false;
    // A plugin of the old kind has no entry of its own; what is found then is the one of this library.
    static const char inside = 0;
    Dl_info here;
    if (dladdr(&inside, &here) && here.dli_fbase == found.dli_fbase) return false;
    const fs::path file(found.dli_fname);
    auto library = std::make_shared<bf::Library>(file.stem().string(), file);
    bf::fill_from_plugin(*library, library_.handle());
    for (const auto& listed : library->classes()) {
        if (listed.name != class_name) continue;
        native_ = std::make_unique<Native>(Native{library});
        class_name_ = class_name;
        base_class_name_ = "blockfactory::core::Block";
        status_ = Status::OK;
        error_.clear();
        return true;
    }
    return false;
}

void* SharedLibraryFactory::createObject() const {
    if (!isValid()) return nullptr;
    if (!native_) return api_.create();
    return static_cast<blockfactory::core::Block*>(new bf::boundary::AsLegacyBlock(native_->library, name_));
}

void SharedLibraryFactory::destroyObject(void* object) const {
    if (!object || !isValid()) return;
    if (native_)
        delete static_cast<blockfactory::core::Block*>(object);
    else
        api_.destroy(object);
}

void SharedLibraryFactory::extendSearchPath(const std::string& path) {
    for (const auto& folder : folders_of(path)) search_path_.push_back(folder);
}

bool SharedLibraryFactory::fail(Status status, const std::string& error) {
    status_ = status;
    error_ = error;
    return false;
}

bool SharedLibraryFactory::open(const char* dll_name, const char* factory_name) {
    return open(dll_name, SHLIBPP_DEFAULT_START_CHECK, SHLIBPP_DEFAULT_END_CHECK,
                SHLIBPP_DEFAULT_SYSTEM_VERSION, factory_name);
}

bool SharedLibraryFactory::open(const char* dll_name, std::int32_t startCheck, std::int32_t endCheck,
                                std::int32_t systemVersion, const char* factory_name) {
    const std::string name(dll_name);
    name_ = factory_name ? factory_name : SHLIBPP_DEFAULT_FACTORY_NAME_STRING;
    std::vector<std::string> folders = search_path_;
    for (const auto& folder : folders_of(environment("SHLIBPP_PLUGIN_PATH"))) folders.push_back(folder);

    std::string file, searched;
    if (name.find('/') != std::string::npos) {
        if (fs::exists(name)) file = name;
        searched = name;
    } else {
        for (const auto& folder : folders) {
            searched += (searched.empty() ? "" : ", ") + folder;
            for (const auto& candidate :
                 {"lib" + name + ".so", "lib" + name + ".dylib", name + ".dll", name + ".so"})
                if (file.empty() && fs::exists(fs::path(folder) / candidate))
                    file = fs::absolute(fs::path(folder) / candidate).string();
        }
    }
    if (!file.empty()) {
        if (!library_.open(file.c_str()))
            return fail(Status::LibraryNotLoaded,
                        "the plugin " + file + " cannot be loaded: " + library_.error());
    } else if (name.find('/') != std::string::npos ||
               (!library_.open(dll_name) && !library_.open(("lib" + name + ".so").c_str())))
        return fail(Status::LibraryNotFound,
                    "the plugin '" + name + "' was not found: searched " +
                        (searched.empty() ? "no folder" : searched) +
                        " and the system's; set BLOCKFACTORY_PLUGIN_PATH to the folder that holds it");

    const std::string where = "the plugin '" + name + "'";
    // A function that happens to be called like the class must not be called as a factory.
    auto* hook = reinterpret_cast<std::int32_t (*)(void*, std::size_t)>(library_.getSymbol(name_.c_str()));
    if (!hook || !library_.getSymbol((name_ + "_getAbi").c_str())) {
        try {
            if (openNative(name_)) return true;
        } catch (const std::exception& problem) {
            return fail(Status::FactoryNotFunctional, problem.what());
        }
        return fail(Status::FactoryNotFound,
                    where + " has no class '" + name_ +
                        "': no such symbol of SHLIBPP_DEFINE_SHARED_SUBCLASS is exported");
    }
    const std::int32_t answer = hook(&api_, sizeof(api_));
    constexpr std::int32_t other_size = -1; // of the struct, in other headers
    if (answer != startCheck && answer != other_size)
        return fail(Status::FactoryNotFound,
                    where + ", class '" + name_ + "', is meant for other programs: its marks are others");
    if (answer != startCheck || api_.startCheck != startCheck || api_.endCheck != endCheck ||
        api_.structureSize != static_cast<std::int32_t>(sizeof(api_)) ||
        api_.systemVersion != systemVersion || !api_.create || !api_.destroy) {
        const std::string found = api_.startCheck == startCheck && api_.systemVersion > 0
                                      ? std::to_string(api_.systemVersion)
                                      : "unknown";
        return fail(Status::FactoryNotFunctional,
                    where + ", class '" + name_ + "', was built against another interface version (" + found +
                        ", here " + std::to_string(systemVersion) + "): rebuild it");
    }
    char text[256];
    api_.getClassName(text, sizeof(text));
    class_name_ = text;
    api_.getBaseClassName(text, sizeof(text));
    base_class_name_ = text;
    status_ = Status::OK;
    error_.clear();
    return true;
}

} // namespace sharedlibpp

namespace blockfactory::core {

class ClassFactorySingleton::impl {
  public:
    std::mutex mutex;
    std::vector<std::string> folders = folders_of(environment("BLOCKFACTORY_PLUGIN_PATH"));
    std::map<ClassFactoryData, ClassFactoryPtr> factories;
};

ClassFactorySingleton::ClassFactorySingleton() : pImpl(std::make_unique<impl>()) {}
ClassFactorySingleton::~ClassFactorySingleton() = default;

ClassFactorySingleton& ClassFactorySingleton::getInstance() {
    static ClassFactorySingleton only;
    return only;
}

ClassFactorySingleton::ClassFactoryPtr ClassFactorySingleton::getClassFactory(
    const ClassFactoryData& factorydata) {
    const std::lock_guard lock(pImpl->mutex);
    const auto known = pImpl->factories.find(factorydata);
    if (known != pImpl->factories.end()) return known->second;
    auto factory = std::make_shared<ClassFactory>();
    for (const auto& folder : pImpl->folders) factory->extendSearchPath(folder);
    if (!factory->open(factorydata.first.c_str(), factorydata.second.c_str())) {
        bfError << "Failed to create factory";
        bfError << "Factory error (" << static_cast<int>(factory->getStatus())
                << "): " << factory->getError();
        return nullptr;
    }
    pImpl->factories.emplace(factorydata, factory);
    return factory;
}

bool ClassFactorySingleton::destroyFactory(const ClassFactoryData& factorydata) {
    const std::lock_guard lock(pImpl->mutex);
    const auto known = pImpl->factories.find(factorydata);
    if (known == pImpl->factories.end()) {
        bfError << "There is no factory of class '" << factorydata.second << "' in plugin '"
                << factorydata.first << "'.";
        return false;
    }
    if (known->second.use_count() != 1) {
        bfError << "The factory of class '" << factorydata.second << "' in plugin '" << factorydata.first
                << "' is in use.";
        return false;
    }
    pImpl->factories.erase(known);
    return true;
}

void ClassFactorySingleton::extendPluginSearchPath(const std::string& path) {
    const std::lock_guard lock(pImpl->mutex);
    for (const auto& folder : folders_of(path)) pImpl->folders.push_back(folder);
}

} // namespace blockfactory::core
