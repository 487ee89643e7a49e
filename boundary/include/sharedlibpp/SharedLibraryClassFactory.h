// A factory whose objects are seen as T.
#ifndef SHAREDLIBPP_SHAREDLIBRARYCLASSFACTORY_H
#define SHAREDLIBPP_SHAREDLIBRARYCLASSFACTORY_H

#include "sharedlibpp/SharedLibraryFactory.h"

namespace sharedlibpp {

template <class T> class SharedLibraryClassFactory : public SharedLibraryFactory {
  public:
    SharedLibraryClassFactory() = default;
    explicit SharedLibraryClassFactory(const char* dll_name, const char* factory_name = nullptr)
        : SharedLibraryFactory(dll_name, factory_name) {}
    SharedLibraryClassFactory(const char* dll_name, std::int32_t startCheck, std::int32_t endCheck,
                              std::int32_t systemVersion, const char* factory_name = nullptr)
        : SharedLibraryFactory(dll_name, startCheck, endCheck, systemVersion, factory_name) {}

    /// A new object, to be destroyed by destroy(); null when the factory is not valid.
    T* create() const { return static_cast<T*>(createObject()); }
    void destroy(T* object) const { destroyObject(object); }
};

} // namespace sharedlibpp

#endif
