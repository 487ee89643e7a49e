#include "terminal.hpp"

#include "bf/base/escape.hpp"

#include <BlockFactory/Core/Log.h>
#include <chrono>
#include <cstdio>
#include <map>
#include <sstream>
#include <sys/ioctl.h>
#include <unistd.h>

namespace bf::tools {

namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// As many characters of UTF-8 text as fit in the terminal without a line break.
std::string cut(const std::string& text) {
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < 2) return text;
    std::size_t end = 0;
    for (int columns = size.ws_col - 1; end < text.size(); ++end) {
        const bool is_start = (static_cast<unsigned char>(text[end]) & 0xC0) != 0x80;
        if (is_start && columns-- == 0) break;
    }
    return text.substr(0, end);
}

void write(const std::string& text, bool stays) {
    if (isatty(STDERR_FILENO))
        std::fprintf(stderr, "\r%s\033[K%s", cut(text).c_str(), stays ? "\n" : "");
    else
        std::fprintf(stderr, "%s\n", text.c_str());
    std::fflush(stderr);
}

} // namespace

bool StatusLine::is_due() const { return now() - shown_ > (isatty(STDERR_FILENO) ? 0.2 : 10); }

void StatusLine::show(const std::string& text) {
    if (!is_due()) return;
    shown_ = now();
    write(text, false);
}

void StatusLine::finish(const std::string& text) { write(text, true); }

Waiting::Waiting(std::string what) : thread_([this, what = std::move(what)] { run(what); }) {}

Waiting::~Waiting() {
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    changed_.notify_one();
    thread_.join();
}

void Waiting::run(const std::string& what) {
    std::unique_lock lock(mutex_);
    const auto over = [this] { return is_over_; };
    if (changed_.wait_for(lock, std::chrono::seconds(1), over)) return;
    const double begin = now() - 1;
    StatusLine line;
    do line.show("  " + what + " ... " + std::to_string(static_cast<int>(now() - begin)) + " s");
    while (!changed_.wait_for(lock, std::chrono::milliseconds(300), over));
    if (isatty(STDERR_FILENO)) std::fputs("\r\033[K", stderr);
}

recording::Recording load_recording(const std::string& file) {
    const Waiting waiting("reading " + file);
    auto recording = recording::load(file);
    if (!recording.complete)
        std::fprintf(stderr, "bf: %s is not complete: %s; the rest is taken\n", file.c_str(),
                     recording.defect.c_str());
    if (recording.unchecked)
        std::fprintf(stderr,
                     "bf: parts of %s have no checksum, so nobody can tell whether they were changed\n",
                     file.c_str());
    return recording;
}

void refuse_incomplete(const recording::Recording& recording, const std::string& file,
                       const std::string& output) {
    if (!recording.complete)
        throw CommandError(output + " holds only what could be read of " + file + ", which is not complete");
}

InterruptGuard::InterruptGuard() {
    look_for_interrupt(flag());
    listen_to_waits(
        [](const char* what) { std::fprintf(stderr, "  waits for %s\n", escape::terminal(what).c_str()); });
}

InterruptGuard::~InterruptGuard() {
    look_for_interrupt(nullptr);
    listen_to_waits(nullptr);
}

std::string without_interruption(std::string failure) {
    return InterruptGuard::signal() != 0 && is_interruption(failure) ? std::string() : failure;
}

void show_warnings() {
    auto& log = blockfactory::core::Log::getSingleton();
    std::istringstream lines(log.getWarnings());
    log.clearWarnings();
    std::map<std::string, int> counts;
    std::vector<std::string> order;
    for (std::string line; std::getline(lines, line);)
        if (++counts[line] == 1) order.push_back(line);
    for (const auto& line : order) {
        const int count = counts[line];
        std::fprintf(stderr, "bf: warning: %s%s\n", line.c_str(),
                     count > 1 ? (" (" + std::to_string(count) + " times)").c_str() : "");
    }
}

} // namespace bf::tools
