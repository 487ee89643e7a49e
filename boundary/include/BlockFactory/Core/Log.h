// Where blocks leave messages for the engine that called them.
#ifndef BLOCKFACTORY_CORE_LOG_H
#define BLOCKFACTORY_CORE_LOG_H

#include <memory> // for plugins that rely on it
#include <sstream>
#include <string>

namespace blockfactory {
namespace core {
class Log;
} // namespace core
} // namespace blockfactory

#ifndef BF_LOG_VERBOSITY
#ifdef NDEBUG
#define BF_LOG_VERBOSITY RELEASE
#else
#define BF_LOG_VERBOSITY DEBUG
#endif
#endif

#define bfError                                                                                              \
    ::blockfactory::core::Log::getSingleton().getLogStringStream(::blockfactory::core::Log::Type::ERROR,     \
                                                                 __FILE__, __LINE__, __FUNCTION__)
#define bfWarning                                                                                            \
    ::blockfactory::core::Log::getSingleton().getLogStringStream(::blockfactory::core::Log::Type::WARNING,   \
                                                                 __FILE__, __LINE__, __FUNCTION__)

#ifdef ERROR
#undef ERROR // a macro of Windows headers
#endif

/// Use: bfError << "what, value, remedy";
///
/// May be used by several threads. While an engine of this library calls a block, the messages of that
/// thread go to that call alone; all others can be read by everybody. The oldest are dropped beyond 1000.
class blockfactory::core::Log {
  public:
    enum class Type { ERROR, WARNING };
    /// DEBUG prefixes messages with file, line and function.
    enum class Verbosity { RELEASE, DEBUG };

    static Log& getSingleton();

    /// A stream for one new message, of this thread alone. What is written is in the log at once; an
    /// expression that writes may call what logs itself.
    std::stringstream& getLogStringStream(const Type& type, const std::string& file, const unsigned& line,
                                          const std::string& function,
                                          const Verbosity& verbosity = Verbosity::BF_LOG_VERBOSITY);

    /// All messages, each with a line break behind it; reading does not clear.
    std::string getErrors() const;
    std::string getWarnings() const;
    void clearErrors();
    void clearWarnings();
    void clear();

  private:
    Log() = default;
};

#endif
