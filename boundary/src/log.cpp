#include "BlockFactory/Core/Log.h"
#include "log_capture.hpp"

#include <algorithm>
#include <deque>
#include <mutex>

namespace bf::boundary {
namespace {

using blockfactory::core::Log;

constexpr std::size_t limit = 1000;
thread_local LogCapture* current = nullptr;

struct Message {
    Log::Type type;
    std::string text;
    const LogCapture* owner; // null: everybody's
};

struct Store {
    std::mutex mutex;
    std::deque<Message> messages;
};
/// Never destroyed: threads may log until the process is gone.
Store& store() {
    static Store* const only = new Store;
    return *only;
}

/// The message that this thread is writing.
struct Pending {
    std::stringstream stream;
    Log::Type type = Log::Type::ERROR;
    const LogCapture* owner = nullptr;
    bool is_open = false;

    ~Pending() { finish(); }
    void finish() {
        if (!is_open) return;
        is_open = false;
        const std::lock_guard lock(store().mutex);
        auto& messages = store().messages;
        messages.push_back({type, stream.str(), owner});
        if (messages.size() > limit) messages.pop_front();
    }
};
Pending& pending() {
    thread_local Pending mine;
    return mine;
}

std::string read(Log::Type type) {
    pending().finish();
    const std::lock_guard lock(store().mutex);
    std::string text;
    for (const auto& message : store().messages)
        if (message.type == type && message.owner == current)
            text += (text.empty() ? "" : "\n") + message.text;
    return text;
}

template <class Predicate> void remove(Predicate predicate) {
    pending().finish();
    const std::lock_guard lock(store().mutex);
    auto& messages = store().messages;
    messages.erase(std::remove_if(messages.begin(), messages.end(), predicate), messages.end());
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
    std::string text = read(Log::Type::ERROR);
    const std::string warnings = read(Log::Type::WARNING);
    if (!warnings.empty()) text += (text.empty() ? "" : "\n") + warnings;
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
    Pending& message = pending();
    message.finish();
    message.stream = std::stringstream();
    message.type = type;
    message.owner = current;
    message.is_open = true;
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
