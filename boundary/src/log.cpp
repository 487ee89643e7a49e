#include "BlockFactory/Core/Log.h"
#include "log_capture.hpp"

#include <algorithm>
#include <deque>
#include <memory>
#include <mutex>
#include <streambuf>

namespace bf::boundary {
namespace {

using blockfactory::core::Log;

constexpr std::size_t limit = 1000;
thread_local LogCapture* current = nullptr;

/// Guards the messages and their texts.
std::mutex& guard() {
    static std::mutex* const only = new std::mutex; // threads may log until the process is gone
    return *only;
}

/// One message. What its thread writes is there for all at once: the expression that writes it may call what
/// logs, too, so nothing tells when it is complete.
class Message final : std::streambuf {
  public:
    Message(Log::Type its_type, const LogCapture* its_owner) : type(its_type), owner(its_owner) {
        stream.std::ios::rdbuf(this);
    }
    const Log::Type type;
    const LogCapture* const owner; // null: everybody's
    std::stringstream stream;
    std::string text;

  private:
    std::streamsize xsputn(const char* characters, std::streamsize count) override {
        const std::lock_guard lock(guard());
        text.append(characters, static_cast<std::size_t>(count));
        return count;
    }
    int_type overflow(int_type character) override {
        const char one = traits_type::to_char_type(character);
        return xsputn(&one, 1) == 1 ? traits_type::not_eof(character) : traits_type::eof();
    }
};
using Messages = std::deque<std::shared_ptr<Message>>;

/// Never destroyed, as the mutex.
Messages& store() {
    static Messages* const only = new Messages;
    return *only;
}

/// Adds a message, which lives until it is removed and until its thread has made as many new ones: somebody
/// else may clear the log while it is written.
Message& add(Log::Type type) {
    thread_local Messages mine;
    const auto message = std::make_shared<Message>(type, current);
    const auto keep = [&](Messages& messages) {
        messages.push_back(message);
        if (messages.size() > limit) messages.pop_front();
    };
    keep(mine);
    const std::lock_guard lock(guard());
    keep(store());
    return *message;
}

std::string read(Log::Type type) {
    const std::lock_guard lock(guard());
    std::string text;
    for (const auto& message : store())
        if (message->type == type && message->owner == current) text += message->text + "\n";
    return text;
}

template <class Predicate> void remove(Predicate predicate) {
    const std::lock_guard lock(guard());
    auto& messages = store();
    messages.erase(
        std::remove_if(messages.begin(), messages.end(), [&](const auto& m) { return predicate(*m); }),
        messages.end());
}

} // namespace

struct LogAccess {
    static void mark(LogCapture* capture) {
        if (capture) capture->used_ = true;
    }
};

LogCapture::LogCapture() noexcept : outer_(current) { current = this; }
LogCapture::~LogCapture() {
    if (used_) remove([this](const Message& m) { return m.owner == this; });
    current = outer_;
}
std::string LogCapture::take() {
    if (!used_) return {};
    std::string text = read(Log::Type::ERROR) + read(Log::Type::WARNING);
    if (!text.empty()) text.pop_back(); // the last line break
    remove([this](const Message& m) { return m.owner == this; });
    used_ = false;
    return text;
}

} // namespace bf::boundary

namespace blockfactory::core {

using namespace bf::boundary;

Log& Log::getSingleton() {
    static Log only;
    return only;
}

std::stringstream& Log::getLogStringStream(const Type& type, const std::string& file, const unsigned& line,
                                           const std::string& function, const Verbosity& verbosity) {
    Message& message = add(type);
    LogAccess::mark(current);
    if (verbosity == Verbosity::DEBUG) message.stream << file << "@" << function << ":" << line << "\n";
    return message.stream;
}

std::string Log::getErrors() const { return read(Type::ERROR); }
std::string Log::getWarnings() const { return read(Type::WARNING); }
void Log::clearErrors() {
    remove([](const Message& m) { return m.type == Type::ERROR && m.owner == current; });
}
void Log::clearWarnings() {
    remove([](const Message& m) { return m.type == Type::WARNING && m.owner == current; });
}
void Log::clear() {
    remove([](const Message& m) { return m.owner == current; });
}

} // namespace blockfactory::core
