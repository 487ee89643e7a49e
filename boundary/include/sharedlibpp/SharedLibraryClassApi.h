// The C functions by which a plugin offers one class.
#ifndef SHAREDLIBPP_SHAREDLIBRARYCLASSAPI_H
#define SHAREDLIBPP_SHAREDLIBRARYCLASSAPI_H

#include <cstring>

#if defined(_WIN32)
#define SHLIBPP_SHARED_CLASS_FN extern "C" __declspec(dllexport)
#else
#define SHLIBPP_SHARED_CLASS_FN extern "C" __attribute__((visibility("default")))
#endif

#define SHLIBPP_START_CODE 0x50504853 /* 'SHPP' */
#define SHLIBPP_END_CODE 0x47554C50   /* 'PLUG' */
/// Of the struct below. A plugin with another version is refused.
#ifndef SHLIBPP_SYSTEM_VERSION
#define SHLIBPP_SYSTEM_VERSION 5
#endif

extern "C" {
/// Filled by the function that is called like the class.
struct SharedLibraryClassApi {
    int startCheck;
    int structureSize;
    int systemVersion;
    void* (*create)();
    void (*destroy)(void* object);
    int (*getVersion)(char* text, int length);
    int (*getAbi)(char* text, int length);
    int (*getClassName)(char* text, int length);
    int (*getBaseClassName)(char* text, int length);
    int endCheck;
};
}

namespace sharedlibpp {
/// Copies a text into `length` characters, cut if need be; returns the characters it needs.
inline int copyText(const char* from, char* to, int length) {
    if (length > 0) {
        std::strncpy(to, from, static_cast<std::size_t>(length));
        to[length - 1] = '\0';
    }
    return static_cast<int>(std::strlen(from)) + 1;
}
} // namespace sharedlibpp

/// Offers the class that `maker` makes and `breaker` destroys under the name `label`, a C identifier.
#define SHLIBPP_DEFINE_HOOK(label, maker, breaker, classname, basename)                                      \
    SHLIBPP_SHARED_CLASS_FN void* label##_create() { return maker; }                                         \
    SHLIBPP_SHARED_CLASS_FN void label##_destroy(void* object) { breaker; }                                  \
    SHLIBPP_SHARED_CLASS_FN int label##_getVersion(char* text, int length) {                                 \
        return ::sharedlibpp::copyText("5", text, length);                                                   \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN int label##_getAbi(char* text, int length) {                                     \
        return ::sharedlibpp::copyText("C++14", text, length);                                               \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN int label##_getClassName(char* text, int length) {                               \
        return ::sharedlibpp::copyText(classname, text, length);                                             \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN int label##_getBaseClassName(char* text, int length) {                           \
        return ::sharedlibpp::copyText(basename, text, length);                                              \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN int label(void* api, int length) {                                               \
        auto* to = static_cast<SharedLibraryClassApi*>(api);                                                 \
        if (length < static_cast<int>(sizeof(SharedLibraryClassApi))) return -1;                             \
        to->startCheck = SHLIBPP_START_CODE;                                                                 \
        to->structureSize = static_cast<int>(sizeof(SharedLibraryClassApi));                                 \
        to->systemVersion = SHLIBPP_SYSTEM_VERSION;                                                          \
        to->create = label##_create;                                                                         \
        to->destroy = label##_destroy;                                                                       \
        to->getVersion = label##_getVersion;                                                                 \
        to->getAbi = label##_getAbi;                                                                         \
        to->getClassName = label##_getClassName;                                                             \
        to->getBaseClassName = label##_getBaseClassName;                                                     \
        to->endCheck = SHLIBPP_END_CODE;                                                                     \
        return SHLIBPP_START_CODE;                                                                           \
    }

/// Offers class `subclass`, seen through its base, under the name `label`.
#define SHLIBPP_DEFINE_SHARED_SUBCLASS(label, subclass, basename)                                            \
    SHLIBPP_DEFINE_HOOK(label, static_cast<basename*>(new subclass), delete static_cast<basename*>(object),  \
                        #subclass, #basename)
#define SHLIBPP_DEFINE_SHARED_CLASS(label, name) SHLIBPP_DEFINE_SHARED_SUBCLASS(label, name, name)
#define SHLIBPP_DEFINE_DEFAULT_SHARED_CLASS(name) SHLIBPP_DEFINE_SHARED_CLASS(shlibpp_default_factory, name)
#define SHLIBPP_DEFAULT_FACTORY_NAME "shlibpp_default_factory"

#endif
