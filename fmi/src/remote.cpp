// FMUs in processes of their own: the calls of an instance as messages over a socket.
#include "bf/fmi/instance.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <poll.h>
#include <span>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace bf::fmi {

namespace {

namespace fs = std::filesystem;

enum class Operation : std::uint32_t {
    open,
    enter_initialization,
    exit_initialization,
    get,
    set,
    do_step,
    terminate,
    reset,
    set_time,
    set_states,
    get_states,
    get_derivatives,
    get_indicators,
    differentiate,
    complete_step,
    enter_event_mode,
    handle_event,
    enter_continuous_time,
    enter_step_mode,
    activate,
    get_interval,
    save,
    restore,
    log ///< what the FMU said, before the answer
};

/// Before the bytes of a question or an answer.
struct Head {
    Operation operation;
    std::uint32_t is_good = 0, state = 0;
    std::uint32_t type = 0, references = 0, values = 0; ///< of values on their way
    double a = 0, b = 0;
    std::uint64_t size = 0;     ///< bytes that follow
    std::uint64_t has_more = 0; ///< of a question: another one follows, and one answer is for both
};

using Bytes = std::vector<std::uint8_t>;
constexpr std::size_t most_message_bytes = std::size_t{2} << 30; ///< of one message
using Part = std::span<const std::uint8_t>;

template <class T> Part bytes_of(const T* from, std::size_t count) {
    return {reinterpret_cast<const std::uint8_t*>(from), count * sizeof(T)};
}

/// One end of the socket; false where the other one is gone or, with a timeout in s, late.
class End {
  public:
    explicit End(int file) : file_(file) {}
    /// What is kept and sent up to that size allocates nothing.
    void reserve(std::size_t bytes) { kept_.reserve(bytes); }
    /// Sent with the next one that is not kept back. The bytes are in two parts.
    void keep(Head head, Part first, Part second) {
        head.size = first.size() + second.size();
        const auto* const its = reinterpret_cast<const std::uint8_t*>(&head);
        kept_.insert(kept_.end(), its, its + sizeof head);
        kept_.insert(kept_.end(), first.begin(), first.end());
        kept_.insert(kept_.end(), second.begin(), second.end());
    }
    bool send(const Head& head, Part first = {}, Part second = {}) {
        keep(head, first, second);
        const bool is_good = write(kept_.data(), kept_.size());
        kept_.clear();
        return is_good;
    }
    bool receive(Head& head, Bytes& bytes, double timeout) noexcept {
        if (!read(&head, sizeof head, timeout)) return false;
        // Whatever an FMU does to its descriptors, no more is believed than a saved state may have.
        is_garbled_ = head.size > most_message_bytes;
        if (is_garbled_) return false;
        try {
            bytes.resize(head.size);
        } catch (const std::bad_alloc&) {
            is_garbled_ = true;
            return false;
        }
        return read(bytes.data(), bytes.size(), timeout);
    }
    bool is_late() const { return is_late_; }
    bool is_garbled() const { return is_garbled_; }

  private:
    bool write(const std::uint8_t* from, std::size_t count) const noexcept {
        for (const auto* at = from; count > 0;) {
            const auto done = ::send(file_, at, count, MSG_NOSIGNAL);
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) return false;
            at += done, count -= static_cast<std::size_t>(done);
        }
        return true;
    }
    bool read(void* to, std::size_t count, double timeout) noexcept {
        for (auto* at = static_cast<char*>(to); count > 0;) {
            if (begin_ == end_ && !fill(timeout)) return false;
            const std::size_t part = std::min(count, end_ - begin_);
            std::memcpy(at, buffer_ + begin_, part);
            begin_ += part, at += part, count -= part;
        }
        return true;
    }
    /// Reads what has come, or waits for it.
    bool fill(double timeout) noexcept {
        for (;;) {
            pollfd waits{file_, POLLIN, 0};
            const int ready =
                timeout > 0 ? ::poll(&waits, 1, static_cast<int>(std::min(1000 * timeout, 2e9))) : 1;
            if (ready < 0 && errno == EINTR) continue;
            is_late_ = ready == 0;
            if (ready <= 0) return false;
            const auto done = ::recv(file_, buffer_, sizeof buffer_, 0);
            if (done < 0 && errno == EINTR) continue;
            begin_ = 0, end_ = done > 0 ? static_cast<std::size_t>(done) : 0;
            return done > 0;
        }
    }

    int file_;
    bool is_late_ = false, is_garbled_ = false;
    Bytes kept_;
    std::size_t begin_ = 0, end_ = 0; ///< of what was read and is not taken yet
    char buffer_[4096];
};

/// Values as the other side has them; the references come before the values.
Values values_of(const Head& head, const Bytes& bytes, int version) {
    Values values(version, static_cast<Type>(head.type));
    std::vector<std::uint32_t> references(head.references);
    std::memcpy(references.data(), bytes.data(), references.size() * sizeof(std::uint32_t));
    for (std::size_t i = 0; i < references.size(); ++i) {
        Variable v;
        v.reference = references[i];
        v.type = values.type();
        // How many elements each has matters to nobody: the last one has all others.
        v.dimensions = {i + 1 < references.size() ? 0 : static_cast<int>(head.values)};
        values.add(v);
    }
    return values;
}

/// What the process of the FMU does: it answers until nobody asks.
class Server {
  public:
    Server(int file, char* doing) : end_(file), doing_(doing) {}

    void run(const fs::path& archive, const Description& description, Kind kind, const Structure& structure,
             const std::string& name) {
        try {
            std::snprintf(doing_, LocalInstance::longest_name, "its opening");
            const Library library(archive, description, kind, structure);
            version_ = library.description().version;
            LocalInstance instance(
                library, name,
                [this](int status, const std::string& category, const std::string& text) {
                    const std::string both = category + '\0' + text;
                    end_.send({Operation::log, 1, 0, static_cast<std::uint32_t>(status)},
                              bytes_of(both.data(), both.size()));
                },
                doing_);
            Head head{Operation::open, 1, instance.state()};
            head.a = instance.state_count(), head.b = instance.indicator_count();
            if (!end_.send(head)) return;
            bool has_failed = false;
            while (end_.receive(head, bytes_, 0)) {
                // After a failure nothing more is done until whoever asks knows of it.
                has_failed = has_failed || !answer(instance, head);
                if (head.has_more != 0) continue;
                head.is_good = !std::exchange(has_failed, false);
                head.state = instance.state();
                const Part answer = head.is_good
                                        ? Part(bytes_)
                                        : bytes_of(instance.failure(), std::strlen(instance.failure()));
                if (!end_.send(head, answer)) return;
            }
            std::snprintf(doing_, LocalInstance::longest_name, "its closing");
        } catch (const std::exception& error) {
            const std::string text = error.what();
            end_.send({Operation::open}, bytes_of(text.data(), text.size()));
        }
    }

  private:
    bool answer(Instance& instance, Head& head) {
        const auto* const question = reinterpret_cast<const double*>(bytes_.data());
        const auto row = [&](int count, auto&& f) {
            bytes_.resize(static_cast<std::size_t>(count) * sizeof(double));
            return f(reinterpret_cast<double*>(bytes_.data()));
        };
        switch (head.operation) {
        case Operation::get: {
            Values values = values_of(head, bytes_, version_);
            const bool is_good = instance.get(values);
            bytes_.assign(static_cast<std::uint8_t*>(values.data()),
                          static_cast<std::uint8_t*>(values.data()) + values.bytes());
            return is_good;
        }
        case Operation::set: {
            Values values = values_of(head, bytes_, version_);
            std::memcpy(values.data(), bytes_.data() + head.references * sizeof(std::uint32_t),
                        values.bytes());
            bytes_.clear();
            return instance.set(values);
        }
        case Operation::get_states:
            return row(instance.state_count(), [&](double* x) { return instance.get_states(x); });
        case Operation::get_derivatives:
            return row(instance.state_count(), [&](double* x) { return instance.get_derivatives(x); });
        case Operation::get_indicators:
            return row(instance.indicator_count(), [&](double* z) { return instance.get_indicators(z); });
        case Operation::set_states: return instance.set_states(question);
        case Operation::differentiate: { // behind the direction, the references of what changes
            Values along = values_of(head, bytes_, version_);
            const std::size_t before = head.references * sizeof(std::uint32_t);
            std::memcpy(along.data(), bytes_.data() + before, along.bytes());
            Head of_change = head;
            of_change.references = static_cast<std::uint32_t>(head.a);
            of_change.values = static_cast<std::uint32_t>(head.b);
            bytes_.erase(bytes_.begin(),
                         bytes_.begin() + static_cast<std::ptrdiff_t>(before + along.bytes()));
            Values change = values_of(of_change, bytes_, version_);
            const bool is_good = instance.differentiate(along, change);
            bytes_.assign(static_cast<std::uint8_t*>(change.data()),
                          static_cast<std::uint8_t*>(change.data()) + change.bytes());
            return is_good;
        }
        case Operation::activate: {
            std::vector<std::uint32_t> clocks(bytes_.size() / sizeof(std::uint32_t));
            std::memcpy(clocks.data(), bytes_.data(), bytes_.size());
            bytes_.clear();
            return instance.activate(clocks);
        }
        case Operation::save: return instance.save(bytes_);
        case Operation::restore: return instance.restore(bytes_, static_cast<State>(head.state));
        default: break;
        }
        bytes_.clear();
        switch (head.operation) {
        case Operation::enter_initialization: return instance.enter_initialization(head.a);
        case Operation::exit_initialization: return instance.exit_initialization();
        case Operation::do_step: return instance.do_step(head.a, head.b);
        case Operation::terminate: return instance.terminate();
        case Operation::reset: return instance.reset();
        case Operation::set_time: return instance.set_time(head.a);
        case Operation::complete_step: {
            bool wants_event = false;
            const bool is_good = instance.complete_step(wants_event);
            head.a = wants_event;
            return is_good;
        }
        case Operation::enter_event_mode: return instance.enter_event_mode();
        case Operation::handle_event: {
            Event event;
            const bool is_good = instance.handle_event(event);
            head.a = event.has_jumped, head.b = event.next;
            return is_good;
        }
        case Operation::enter_continuous_time: return instance.enter_continuous_time();
        case Operation::enter_step_mode: return instance.enter_step_mode();
        case Operation::get_interval: return instance.get_interval(head.references, head.a, head.b);
        default: return instance.fail("", "nobody knows this question");
        }
    }

    End end_;
    char* doing_;
    int version_ = 3;
    Bytes bytes_;
};

class RemoteInstance final : public Instance {
  public:
    RemoteInstance(const fs::path& archive, const Description& description, Kind kind,
                   const Structure& structure, const std::string& name, double timeout, Log log)
        : Instance(archive.filename().string(), description.version), folder_(archive.stem().string()),
          timeout_(timeout), log_(std::move(log)) {
        void* const page = ::mmap(nullptr, LocalInstance::longest_name, PROT_READ | PROT_WRITE,
                                  MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        int files[2];
        if (page == MAP_FAILED || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, files) != 0)
            throw FmuError(archive.string() + ": it gets no process of its own: " + std::strerror(errno));
        doing_ = static_cast<char*>(page);
        std::fflush(nullptr);
        child_ = ::fork();
        if (child_ == 0) {
            UnderWay::leave_to_others();
            serve(files[1], archive, description, kind, structure, name);
        }
        ::close(files[1]);
        file_ = files[0];
        end_ = End(file_);
        if (!receive()) {
            const std::string text = head_.operation == Operation::open && has_answer_
                                         ? std::string(bytes_.begin(), bytes_.end())
                                         : failure_;
            close();
            throw FmuError(text);
        }
        state_count_ = static_cast<int>(head_.a), indicator_count_ = static_cast<int>(head_.b);
        // Time, states and all variables, twice as much as is ever on its way.
        std::size_t bytes =
            sizeof failure_ + sizeof(double) * static_cast<std::size_t>(state_count_ + indicator_count_);
        for (const auto& v : description.variables)
            if (v.causality != Causality::local && has_values(v.type))
                bytes += sizeof(std::uint32_t) + sizeof(double) * static_cast<std::size_t>(v.count());
        bytes_.reserve(bytes);
        end_.reserve(2 * bytes + 100 * sizeof(Head));
    }
    ~RemoteInstance() override { close(); }

    bool enter_initialization(double start) noexcept override {
        return ask(Operation::enter_initialization, start);
    }
    bool exit_initialization() noexcept override { return ask(Operation::exit_initialization); }
    bool get(Values& values) noexcept override {
        return ask(head_of(Operation::get, values), references_of(values)) &&
               take(values.data(), values.bytes());
    }
    bool set(const Values& values) noexcept override {
        return tell(head_of(Operation::set, values), references_of(values),
                    {static_cast<const std::uint8_t*>(values.data()), values.bytes()});
    }
    bool do_step(double time, double step) noexcept override { return ask(Operation::do_step, time, step); }
    bool terminate() noexcept override { return ask(Operation::terminate); }
    bool reset() noexcept override { return ask(Operation::reset); }
    bool set_time(double time) noexcept override {
        return tell({.operation = Operation::set_time, .a = time});
    }
    bool set_states(const double* x) noexcept override {
        return tell({Operation::set_states}, bytes_of(x, static_cast<std::size_t>(state_count_)));
    }
    bool get_states(double* x) noexcept override { return get_row(Operation::get_states, x, state_count_); }
    bool get_derivatives(double* rates) noexcept override {
        return get_row(Operation::get_derivatives, rates, state_count_);
    }
    bool get_indicators(double* z) noexcept override {
        return get_row(Operation::get_indicators, z, indicator_count_);
    }
    bool complete_step(bool& wants_event) noexcept override {
        const bool is_good = ask(Operation::complete_step);
        wants_event = head_.a != 0;
        return is_good;
    }
    bool enter_event_mode() noexcept override { return ask(Operation::enter_event_mode); }
    bool handle_event(Event& event) noexcept override {
        const bool is_good = ask(Operation::handle_event);
        event = {head_.a != 0, head_.b};
        return is_good;
    }
    bool enter_continuous_time() noexcept override { return ask(Operation::enter_continuous_time); }
    bool enter_step_mode() noexcept override { return ask(Operation::enter_step_mode); }
    bool activate(const std::vector<std::uint32_t>& clocks) noexcept override {
        return tell({Operation::activate}, bytes_of(clocks.data(), clocks.size()));
    }
    bool get_interval(std::uint32_t clock, double& interval, double& shift) noexcept override {
        if (!ask({.operation = Operation::get_interval, .references = clock})) return false;
        interval = head_.a, shift = head_.b;
        return true;
    }
    bool differentiate(const Values& along, Values& change) noexcept override {
        const auto* const direction = static_cast<const std::uint8_t*>(along.data());
        Bytes question;
        for (const Part part : {references_of(along), Part(direction, along.bytes()), references_of(change)})
            question.insert(question.end(), part.begin(), part.end());
        Head head = head_of(Operation::differentiate, along);
        head.a = static_cast<double>(change.references().size());
        head.b = static_cast<double>(change.size());
        return ask(head, question) && take(change.data(), change.bytes());
    }
    bool save(std::vector<std::uint8_t>& bytes) noexcept override {
        if (!ask(Operation::save)) return false;
        bytes = bytes_;
        return true;
    }
    bool restore(const std::vector<std::uint8_t>& bytes, State state) noexcept override {
        return ask({Operation::restore, 0, state}, bytes);
    }
    State state() const noexcept override { return state_; }

  private:
    /// In the new process, which ends here.
    [[noreturn]] void serve(int file, const fs::path& archive, const Description& description, Kind kind,
                            const Structure& structure, const std::string& name) noexcept {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (const int signal : {SIGINT, SIGTERM}) ::signal(signal, SIG_IGN); // who asked for it ends it
        for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) ::signal(signal, SIG_DFL);
        ::dup2(file, 3);
        ::close_range(4, ~0u, 0);
        ::setenv("TMPDIR", folder_.path().c_str(), 1);
        Server(3, doing_).run(archive, description, kind, structure, name);
        ::_exit(0);
    }

    /// A question whose answer is no more than success waits, and goes with the next one that is asked: time,
    /// states, inputs and the question for derivatives are one message. Its answer tells of the first that
    /// failed.
    bool tell(Head question, Part first = {}, Part second = {}) noexcept {
        if (child_ < 0) return false; // and why is known
        question.has_more = 1;
        end_.keep(question, first, second);
        return true;
    }
    bool ask(const Head& question, Part bytes = {}) noexcept {
        if (child_ < 0) return false;
        return end_.send(question, bytes) ? receive() : lose();
    }
    bool ask(Operation operation, double a = 0, double b = 0) noexcept {
        return ask({.operation = operation, .a = a, .b = b});
    }
    /// Of a question that values are on their way with.
    static Head head_of(Operation operation, const Values& values) noexcept {
        return {.operation = operation,
                .type = static_cast<std::uint32_t>(values.type()),
                .references = static_cast<std::uint32_t>(values.references().size()),
                .values = static_cast<std::uint32_t>(values.size())};
    }
    static Part references_of(const Values& values) noexcept {
        return bytes_of(values.references().data(), values.references().size());
    }
    bool get_row(Operation operation, double* to, int count) noexcept {
        return ask(operation) && take(to, static_cast<std::size_t>(count) * sizeof(double));
    }
    bool take(void* to, std::size_t count) noexcept {
        if (bytes_.size() != count) return fail("", "its process gave an answer of another size");
        std::memcpy(to, bytes_.data(), count);
        return true;
    }

    /// The answer, after what the FMU logged.
    bool receive() noexcept {
        has_answer_ = false;
        for (;;) {
            if (!end_.receive(head_, bytes_, timeout_)) return lose();
            if (head_.operation != Operation::log) break;
            const auto middle = std::find(bytes_.begin(), bytes_.end(), 0);
            if (!log_ || middle == bytes_.end()) continue;
            try {
                log_(static_cast<int>(head_.type), {bytes_.begin(), middle}, {middle + 1, bytes_.end()});
            } catch (const std::exception&) { // a message that cannot be kept is lost
            }
        }
        has_answer_ = true;
        state_ = static_cast<State>(head_.state);
        if (head_.is_good) return true;
        std::snprintf(failure_, sizeof failure_, "%.*s", static_cast<int>(bytes_.size()),
                      reinterpret_cast<const char*>(bytes_.data()));
        return false;
    }

    /// Says what became of the process.
    bool lose() noexcept {
        char why[200];
        const bool is_late = end_.is_late(), is_garbled = end_.is_garbled();
        if (is_late || is_garbled) ::kill(child_, SIGKILL);
        const int status = end();
        if (is_late)
            std::snprintf(why, sizeof why, " did not return within %g s", timeout_);
        else if (is_garbled)
            std::snprintf(why, sizeof why, " wrote into descriptors of the process that are not its own");
        else if (WIFSIGNALED(status))
            std::snprintf(why, sizeof why, " crashed (%s)", ::strsignal(WTERMSIG(status)));
        else
            std::snprintf(why, sizeof why, " ended its process");
        doing_[LocalInstance::longest_name - 1] = '\0';
        state_ = failed;
        return fail(doing_, why);
    }
    int end() noexcept {
        int status = 0;
        while (child_ > 0 && ::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
        }
        child_ = -1;
        return status;
    }
    /// The FMU may end in its own way, but not take long for it.
    void close() noexcept {
        if (file_ >= 0) ::shutdown(file_, SHUT_WR);
        if (child_ > 0) {
            pollfd ends{file_, POLLIN, 0};
            if (::poll(&ends, 1, static_cast<int>(std::min(1000 * timeout_, 2e9))) == 0)
                ::kill(child_, SIGKILL);
            end();
        }
        if (file_ >= 0) ::close(file_);
        if (doing_) ::munmap(doing_, LocalInstance::longest_name);
        file_ = -1, doing_ = nullptr;
    }

    TemporaryFolder folder_; ///< around what the process leaves behind where it is killed
    double timeout_;
    Log log_;
    char* doing_ = nullptr; ///< shared with the process
    int file_ = -1;
    pid_t child_ = -1;
    End end_{-1};
    Head head_{};
    Bytes bytes_;
    bool has_answer_ = false;
    State state_ = instantiated;
};

} // namespace

std::unique_ptr<Instance> make_remote_instance(const fs::path& archive, const Description& description,
                                               Kind kind, const std::string& name, double timeout,
                                               Instance::Log log, const Structure& structure) {
    return std::make_unique<RemoteInstance>(archive, description, kind, structure, name, timeout,
                                            std::move(log));
}

} // namespace bf::fmi
