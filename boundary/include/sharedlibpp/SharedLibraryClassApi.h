// The C functions by which a plugin offers one class.
#ifndef SHAREDLIBPP_SHAREDLIBRARYCLASSAPI_H
#define SHAREDLIBPP_SHAREDLIBRARYCLASSAPI_H

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(_WIN32)
#define SHLIBPP_SHARED_CLASS_FN extern "C" __declspec(dllexport)
#else
#define SHLIBPP_SHARED_CLASS_FN extern "C" __attribute__((visibility("default")))
#endif

/// What stands at both ends of the struct below, and the version of the interface. A plugin with others is
/// refused, unless its factory is opened for them.
constexpr std::int32_t SHLIBPP_DEFAULT_START_CHECK = 0x50504853; // 'SHPP'
constexpr std::int32_t SHLIBPP_DEFAULT_END_CHECK = 0x47554C50;   // 'PLUG'
constexpr std::int32_t SHLIBPP_DEFAULT_SYSTEM_VERSION = 5;

namespace sharedlibpp {

/// Filled by the function that is called like the class.
struct SharedLibraryClassApi {
    std::int32_t startCheck;
    std::int32_t structureSize;
    std::int32_t systemVersion;
    void* (*create)();
    void (*destroy)(void* object);
    std::int32_t (*getVersion)(char* text, std::size_t length);
    std::int32_t (*getAbi)(char* text, std::size_t length);
    std::int32_t (*getClassName)(char* text, std::size_t length);
    std::int32_t (*getBaseClassName)(char* text, std::size_t length);
    std::int32_t endCheck;
};

/// Copies a text into `length` characters, cut if need be; returns the characters it needs.
inline std::int32_t copyText(const char* from, char* to, std::size_t length) {
    if (length > 0) {
        std::strncpy(to, from, length);
        to[length - 1] = '\0';
    }
    return static_cast<std::int32_t>(std::strlen(from)) + 1;
}

} // namespace sharedlibpp

namespace shlibpp = sharedlibpp; // its name until BlockFactory 1.0

/// Offers the class that `maker` makes and `breaker` destroys under the name `label`, a C identifier.
#define SHLIBPP_DEFINE_HOOK(start, end, version, label, maker, breaker, classname, basename)                 \
    SHLIBPP_SHARED_CLASS_FN void* label##_create() { return maker; }                                         \
    SHLIBPP_SHARED_CLASS_FN void label##_destroy(void* object) { breaker; }                                  \
    SHLIBPP_SHARED_CLASS_FN std::int32_t label##_getVersion(char* text, std::size_t length) {                \
        return ::sharedlibpp::copyText("5", text, length);                                                   \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN std::int32_t label##_getAbi(char* text, std::size_t length) {                    \
        return ::sharedlibpp::copyText("C++14", text, length);                                               \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN std::int32_t label##_getClassName(char* text, std::size_t length) {              \
        return ::sharedlibpp::copyText(classname, text, length);                                             \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN std::int32_t label##_getBaseClassName(char* text, std::size_t length) {          \
        return ::sharedlibpp::copyText(basename, text, length);                                              \
    }                                                                                                        \
    SHLIBPP_SHARED_CLASS_FN std::int32_t label(void* api, std::size_t length) {                              \
        if (length < sizeof(::sharedlibpp::SharedLibraryClassApi)) return -1;                                \
        auto* to = static_cast<::sharedlibpp::SharedLibraryClassApi*>(api);                                  \
        to->startCheck = start;                                                                              \
        to->structureSize = static_cast<std::int32_t>(sizeof(::sharedlibpp::SharedLibraryClassApi));         \
        to->systemVersion = version;                                                                         \
        to->create = label##_create;                                                                         \
        to->destroy = label##_destroy;                                                                       \
        to->getVersion = label##_getVersion;                                                                 \
        to->getAbi = label##_getAbi;                                                                         \
        to->getClassName = label##_getClassName;                                                             \
        to->getBaseClassName = label##_getBaseClassName;                                                     \
        to->endCheck = end;                                                                                  \
        return start;                                                                                        \
    }

/// Offers class `subclass`, seen through its base, under the name `label`, with other marks or another
/// version.
#define SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM(start, end, version, label, subclass, basename)                \
    SHLIBPP_DEFINE_HOOK(start, end, version, label, static_cast<basename*>(new subclass),                    \
                        delete static_cast<basename*>(object), #subclass, #basename)
/// Offers class `subclass`, seen through its base, under the name `label`.
#define SHLIBPP_DEFINE_SHARED_SUBCLASS(label, subclass, basename)                                            \
    SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM(SHLIBPP_DEFAULT_START_CHECK, SHLIBPP_DEFAULT_END_CHECK,            \
                                          SHLIBPP_DEFAULT_SYSTEM_VERSION, label, subclass, basename)
#define SHLIBPP_DEFINE_SHARED_CLASS(label, name) SHLIBPP_DEFINE_SHARED_SUBCLASS(label, name, name)
#define SHLIBPP_DEFINE_DEFAULT_SHARED_CLASS(name) SHLIBPP_DEFINE_SHARED_CLASS(shlibpp_default_factory, name)
#define SHLIBPP_DEFAULT_FACTORY_NAME shlibpp_default_factory
#define SHLIBPP_DEFAULT_FACTORY_NAME_STRING "shlibpp_default_factory"

#endif
