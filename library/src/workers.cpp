#include "workers.hpp"

#include "bf/run/run.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <optional>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bf {

namespace {

/// All bytes, or false at the end of the stream.
bool read_all(int file, void* to, std::size_t count) {
    for (auto* at = static_cast<char*>(to); count > 0;) {
        const ssize_t got = ::read(file, at, count);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got;
        count -= static_cast<std::size_t>(got);
    }
    return true;
}

bool write_all(int file, const void* from, std::size_t count) {
    for (const auto* at = static_cast<const char*>(from); count > 0;) {
        const ssize_t put = ::write(file, at, count);
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) return false;
        at += put;
        count -= static_cast<std::size_t>(put);
    }
    return true;
}

/// A process that works, one item after the other.
class Worker {
  public:
    explicit Worker(const std::function<std::string(std::size_t)>& work) {
        int to[2], from[2];
        if (::pipe2(to, O_CLOEXEC) != 0 || ::pipe2(from, O_CLOEXEC) != 0)
            throw RunError(std::string("cannot open pipes to the workers: ") + std::strerror(errno) +
                           "; give fewer --jobs");
        std::fflush(nullptr); // else the child would write what waits in the buffers once more
        id_ = ::fork();
        if (id_ < 0)
            throw RunError(std::string("cannot start a worker: ") + std::strerror(errno) +
                           "; give fewer --jobs");
        if (id_ == 0) {
            ::close(to[1]);
            ::close(from[0]);
            serve(to[0], from[1], work);
        }
        ::close(to[0]);
        ::close(from[1]);
        to_ = to[1];
        from_ = from[0];
    }
    ~Worker() {
        ::close(to_);
        ::close(from_);
        if (id_ <= 0) return;
        ::kill(id_, SIGKILL);
        ::waitpid(id_, nullptr, 0);
    }
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    int answers() const { return from_; }
    std::optional<std::size_t> item; ///< that it works on

    /// A dead worker is found when its answer is read.
    void begin(std::size_t i) {
        item = i;
        const std::uint64_t number = i;
        static_cast<void>(write_all(to_, &number, sizeof number));
    }
    std::optional<std::string> answer() {
        std::uint64_t size = 0;
        if (!read_all(from_, &size, sizeof size)) return std::nullopt;
        std::string text(size, '\0');
        if (!read_all(from_, text.data(), size)) return std::nullopt;
        return text;
    }
    /// Why it died.
    std::string death() {
        int status = 0;
        ::waitpid(id_, &status, 0);
        id_ = 0;
        if (WIFSIGNALED(status)) return std::string("the run crashed: ") + ::strsignal(WTERMSIG(status));
        return "the run ended its process with exit code " + std::to_string(WEXITSTATUS(status));
    }

  private:
    [[noreturn]] static void serve(int from, int to, const std::function<std::string(std::size_t)>& work) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        // Ctrl-C reaches the whole group of processes; the parent decides what follows from it.
        std::signal(SIGINT, SIG_IGN);
        std::signal(SIGTERM, SIG_DFL);
        if (const int nothing = ::open("/dev/null", O_WRONLY); nothing >= 0) {
            ::dup2(nothing, STDOUT_FILENO);
            ::dup2(nothing, STDERR_FILENO);
        }
        std::uint64_t item = 0;
        while (read_all(from, &item, sizeof item)) {
            const std::string answer = work(item);
            const std::uint64_t size = answer.size();
            if (!write_all(to, &size, sizeof size) || !write_all(to, answer.data(), answer.size())) break;
        }
        ::_exit(0);
    }

    pid_t id_ = 0;
    int to_ = -1, from_ = -1;
};

} // namespace

void share(std::size_t count, int jobs, const std::function<std::string(std::size_t)>& work,
           const std::function<void(std::size_t, const std::string&, const std::string&)>& done,
           const std::function<bool()>& go_on) {
    // A dead worker is seen by the end of its answers; writing to it must not end this program.
    const auto before = std::signal(SIGPIPE, SIG_IGN);
    std::size_t next = 0, open = count;
    std::vector<std::unique_ptr<Worker>> workers;
    const auto hire = [&](std::size_t place) {
        workers[place] = nullptr;
        if (next == count) return;
        workers[place] = std::make_unique<Worker>(work);
        workers[place]->begin(next++);
    };
    workers.resize(std::min(count, static_cast<std::size_t>(std::max(jobs, 1))));
    for (std::size_t place = 0; place < workers.size(); ++place) hire(place);
    while (open > 0 && go_on()) {
        std::vector<pollfd> files;
        for (const auto& worker : workers) files.push_back({worker ? worker->answers() : -1, POLLIN, 0});
        if (::poll(files.data(), files.size(), 200) <= 0) continue;
        for (std::size_t place = 0; place < workers.size(); ++place) {
            if (files[place].revents == 0) continue;
            Worker& worker = *workers[place];
            const std::size_t item = *worker.item;
            const auto answer = worker.answer();
            done(item, answer.value_or(""), answer ? "" : worker.death());
            --open;
            if (!answer || next == count)
                hire(place);
            else
                worker.begin(next++);
        }
    }
    workers.clear();
    std::signal(SIGPIPE, before);
}

} // namespace bf
