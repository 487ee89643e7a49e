// A shared library opened at run time.
#ifndef SHAREDLIBPP_SHAREDLIBRARY_H
#define SHAREDLIBPP_SHAREDLIBRARY_H

#include <string>

namespace sharedlibpp {

class SharedLibrary {
  public:
    SharedLibrary() = default;
    explicit SharedLibrary(const char* filename) { open(filename); }
    SharedLibrary(const SharedLibrary&) = delete;
    SharedLibrary& operator=(const SharedLibrary&) = delete;
    virtual ~SharedLibrary() { close(); }

    bool open(const char* filename);
    bool close();
    /// The address of a symbol, or null.
    void* getSymbol(const char* symbolName);
    bool isValid() const { return handle_ != nullptr; }
    /// Of dlopen; null when nothing is open.
    void* handle() const { return handle_; }
    /// Why the last call failed.
    std::string error() const { return error_; }

  private:
    void* handle_ = nullptr;
    std::string error_;
};

} // namespace sharedlibpp

namespace shlibpp = sharedlibpp; // its name until BlockFactory 1.0

#endif
