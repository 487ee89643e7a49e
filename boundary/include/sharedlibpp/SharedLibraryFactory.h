// One class of a plugin: finds the library and the functions that make and destroy its objects.
#ifndef SHAREDLIBPP_SHAREDLIBRARYFACTORY_H
#define SHAREDLIBPP_SHAREDLIBRARYFACTORY_H

#include "sharedlibpp/SharedLibrary.h"
#include "sharedlibpp/SharedLibraryClassApi.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace sharedlibpp {

class SharedLibraryFactory {
  public:
    enum class Status {
        None = 0,
        OK = 1,
        LibraryNotFound = 2,
        LibraryNotLoaded = 3,
        FactoryNotFound = 4,
        FactoryNotFunctional = 5
    };

    SharedLibraryFactory();
    /// Like open().
    explicit SharedLibraryFactory(const char* dll_name, const char* factory_name = nullptr);
    SharedLibraryFactory(const char* dll_name, std::int32_t startCheck, std::int32_t endCheck,
                         std::int32_t systemVersion, const char* factory_name = nullptr);
    SharedLibraryFactory(const SharedLibraryFactory&) = delete;
    SharedLibraryFactory& operator=(const SharedLibraryFactory&) = delete;
    virtual ~SharedLibraryFactory();

    /// Opens lib<dll_name>.so of the search path (or the file, when the name has a slash) and takes the
    /// functions of the class `factory_name` from it. A plugin without them that lists a native block of that
    /// name offers it as a blockfactory::core::Block.
    bool open(const char* dll_name, const char* factory_name = nullptr);
    /// For classes of SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM with these marks and version.
    bool open(const char* dll_name, std::int32_t startCheck, std::int32_t endCheck,
              std::int32_t systemVersion, const char* factory_name = nullptr);
    /// Adds a folder (or several, separated by ':') to be searched before SHLIBPP_PLUGIN_PATH.
    void extendSearchPath(const std::string& path);

    Status getStatus() const { return status_; }
    bool isValid() const { return status_ == Status::OK; }
    /// Why it is not valid: where was searched, which symbol is missing, which version was found.
    std::string getError() const { return error_; }
    std::string getName() const { return name_; }
    std::string getClassName() const { return class_name_; }
    std::string getBaseClassName() const { return base_class_name_; }

    /// Users of the factory; starts at 1.
    int getReferenceCount() const { return references_; }
    int addRef() { return ++references_; }
    int removeRef() { return --references_; }

    /// A new object, and its end; used by SharedLibraryClassFactory.
    void* createObject() const;
    void destroyObject(void* object) const;

  private:
    bool openNative(const std::string& class_name);
    bool fail(Status status, const std::string& error);

    struct Native; // a class of a plugin that lists native blocks

    std::vector<std::string> search_path_;
    SharedLibrary library_;
    SharedLibraryClassApi api_;
    std::unique_ptr<Native> native_;
    Status status_;
    int references_;
    std::string name_, class_name_, base_class_name_, error_;
};

} // namespace sharedlibpp

#endif
