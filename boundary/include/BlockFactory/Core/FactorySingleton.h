// Finding plugins and the blocks in them.
#ifndef BLOCKFACTORY_CORE_FACTORYSINGLETON_H
#define BLOCKFACTORY_CORE_FACTORYSINGLETON_H

#include "BlockFactory/Core/Log.h"
#include "sharedlibpp/SharedLibrary.h"
#include "sharedlibpp/SharedLibraryClass.h"

#include <memory>
#include <string>
#include <utility>

namespace blockfactory {
namespace core {
class Block;
class ClassFactorySingleton;
} // namespace core
} // namespace blockfactory

/// The factories of this process, made when first asked for. Plugins are searched in the folders of
/// BLOCKFACTORY_PLUGIN_PATH (read at first use), then those added here, then those of SHLIBPP_PLUGIN_PATH.
class blockfactory::core::ClassFactorySingleton {
  public:
    using ClassFactory = sharedlibpp::SharedLibraryClassFactory<Block>;
    using ClassFactoryPtr = std::shared_ptr<ClassFactory>;
    using ClassFactoryName = std::string;
    using ClassFactoryLibrary = std::string;
    using ClassFactoryData = std::pair<ClassFactoryLibrary, ClassFactoryName>; ///< {library, class}

    ClassFactorySingleton(const ClassFactorySingleton&) = delete;
    ClassFactorySingleton& operator=(const ClassFactorySingleton&) = delete;
    ~ClassFactorySingleton();

    static ClassFactorySingleton& getInstance();

    /// Null, and an error that says why, when there is no such plugin or class.
    ClassFactoryPtr getClassFactory(const ClassFactoryData& factorydata);
    /// False when the factory is unknown or somebody still holds it.
    bool destroyFactory(const ClassFactoryData& factorydata);
    void extendPluginSearchPath(const std::string& path);

  private:
    ClassFactorySingleton();
    class impl;
    std::unique_ptr<impl> pImpl;
};

#endif
