// An object of a plugin's class that is destroyed with its holder.
#ifndef SHAREDLIBPP_SHAREDLIBRARYCLASS_H
#define SHAREDLIBPP_SHAREDLIBRARYCLASS_H

#include "sharedlibpp/SharedLibraryClassFactory.h"

namespace sharedlibpp {

template <class T> class SharedLibraryClass {
  public:
    SharedLibraryClass() = default;
    explicit SharedLibraryClass(SharedLibraryClassFactory<T>& factory) { open(factory); }
    SharedLibraryClass(const SharedLibraryClass&) = delete;
    SharedLibraryClass& operator=(const SharedLibraryClass&) = delete;
    virtual ~SharedLibraryClass() { close(); }

    bool open(SharedLibraryClassFactory<T>& factory) {
        close();
        content_ = factory.create();
        if (!content_) return false;
        factory_ = &factory;
        factory_->addRef();
        return true;
    }
    bool close() {
        if (content_) {
            factory_->destroy(content_);
            factory_->removeRef();
        }
        content_ = nullptr;
        factory_ = nullptr;
        return true;
    }
    bool isValid() const { return content_ != nullptr; }
    T& getContent() const { return *content_; }
    T& operator*() const { return *content_; }
    T* operator->() const { return content_; }
    operator T*() const { return content_; }

  private:
    T* content_ = nullptr;
    SharedLibraryClassFactory<T>* factory_ = nullptr;
};

} // namespace sharedlibpp

#endif
