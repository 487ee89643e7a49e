#include "bf/udp/robot.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "packet.hpp"
#include "socket.hpp"

#include <cstring>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

namespace bf::udp {

using middleware::Bell;
using middleware::Counts;
using middleware::ExchangeBuffer;
using middleware::now;
using middleware::RobotDescription;
using middleware::RobotLayout;
using middleware::Stamp;

namespace {

constexpr double pause = 0.005;      ///< s until what may have been lost is sent again
constexpr double gone_after = 1;     ///< s of silence
constexpr int repeats_of_gains = 20; ///< pauses

/// One kind of vector that goes out: the step writes, the thread of the socket sends.
class Outgoing {
  public:
    Outgoing(Kind kind, int size) : kind_(kind), newest_(size), values_(static_cast<std::size_t>(size)) {}
    void write(const double* values) noexcept { newest_.write(values, 0); }
    /// Sends the newest one, or the last one again if `repeats`. False: nothing.
    bool send(const Key& key, std::uint64_t session, std::uint64_t& sequence, const Socket& socket,
              const Address& to, bool repeats) {
        if (newest_.newest() != taken_.number && newest_.read(values_.data(), taken_))
            ++number_;
        else if (!repeats || number_ == 0)
            return false;
        key.seal({kind_, session, ++sequence, number_}, bytes_of(values_), datagram_);
        socket.send(datagram_, to);
        return true;
    }
    /// For another receiver.
    void begin() {
        taken_ = {};
        number_ = 0;
    }
    const std::vector<double>& last() const { return values_; } ///< that was sent

  private:
    const Kind kind_;
    ExchangeBuffer newest_;
    std::vector<double> values_;
    Stamp taken_;
    std::uint64_t number_ = 0;
    std::vector<std::byte> datagram_;
};

/// One kind of vector that comes in.
class Incoming {
  public:
    explicit Incoming(int size) : newest_(size), values_(static_cast<std::size_t>(size)) {}
    /// False where it is of another size.
    bool come(std::uint64_t number, std::span<const std::byte> content) {
        if (content.size() != values_.size() * sizeof(double)) return false;
        if (number > last_) { // otherwise a newer one has come, or it was sent again
            last_ = number;
            copy(content, values_);
            newest_.write(values_.data(), now());
        }
        return true;
    }
    void begin() { last_ = 0; }
    bool is_there() const noexcept { return newest_.newest() != taken_.number; }
    bool take(double* values, Stamp& stamp) noexcept {
        if (!is_there() || !newest_.read(values, taken_)) return false;
        stamp = taken_;
        return true;
    }
    const std::vector<double>& last() const { return values_; }

  private:
    ExchangeBuffer newest_;
    std::vector<double> values_;
    Stamp taken_; ///< of the step
    std::uint64_t last_ = 0;
};

std::string versions(std::span<const std::byte> theirs) {
    const auto letters = [](const void* bytes) {
        std::string text(static_cast<const char*>(bytes), 4);
        if (text[3] < ' ' || text[3] > '~') text[3] = '?';
        return text;
    };
    return letters(theirs.data()) + ", and this program " + letters(&Head::magic);
}

class Link final : public middleware::RobotLink {
  public:
    Link(const std::string& address, std::string key)
        : address_(address), key_file_(std::move(key)), name_("robot at " + address + " (UDP)") {}
    ~Link() override { stop(); }

    RobotDescription start(double timeout) override {
        stop();
        server_ = address_of(address_);
        key_.emplace(key_file_, false);
        nonce_ = random_number();
        session_ = sequence_ = 0;
        arrivals_.begin();
        refusal_.clear();
        wrong_size_ = -1;
        vectors_.reset();
        is_ready_ = false;
        is_closing_ = false;
        heard_ = now();
        socket_.open_towards(server_);
        socket_.run([this](auto datagram, const Address& from) { receive(datagram, from); },
                    [this] { send(); }, pause);
        const double begin = now();
        for (bool is_told = false; !is_ready_.load(std::memory_order_acquire);) {
            if (now() - begin > timeout) {
                const std::lock_guard lock(mutex_);
                throw std::runtime_error(
                    !refusal_.empty()
                        ? refusal_
                        : "nobody answers within " + Value(timeout).describe() +
                              " s; look whether it is served there, e.g. by bf serve MODEL --udp " +
                              address_ + " --key FILE, and whether the key is the same on both sides");
            }
            if (is_interrupted()) throw std::runtime_error(interrupted);
            if (!is_told && now() - begin > 0.5) {
                tell_wait((name_ + ", which bf serve MODEL --udp " + address_ + " serves").c_str());
                is_told = true;
            }
            const timespec short_pause{0, 2'000'000};
            nanosleep(&short_pause, nullptr);
        }
        return RobotDescription::read(text_); // throws what is wrong with it
    }
    void stop() noexcept override {
        is_closing_ = true;
        socket_.close();
    }

    bool take_state(double* state, Stamp& stamp) noexcept override {
        return vectors_->state.take(state, stamp);
    }
    bool take_gains(double* gains) noexcept override {
        Stamp stamp;
        return vectors_->gains.take(gains, stamp);
    }
    void send_command(const double* command) noexcept override {
        vectors_->command.write(command);
        socket_.wake();
    }
    void send_settings(const double* settings) noexcept override { vectors_->settings.write(settings); }
    void wait(double timeout) noexcept override {
        bell_.wait(timeout, [&] { return vectors_->state.is_there(); });
    }
    bool is_gone() noexcept override { return now() - heard_ > gone_after; }
    const char* how_gone() const noexcept override { return "has ended, or nothing of it has come for 1 s"; }
    int wrong_size() const noexcept override { return wrong_size_; }
    Counts counts() const noexcept override { return arrivals_.counts(); }
    const std::string& name() const noexcept override { return name_; }

  private:
    struct Vectors {
        explicit Vectors(const RobotLayout& at)
            : state(at.state_size()), gains(at.settings_size()), command(Kind::command, at.command_size()),
              settings(Kind::settings, at.settings_size()) {}
        Incoming state, gains;
        Outgoing command, settings;
    };

    // In the socket's thread.
    void receive(std::span<const std::byte> datagram, const Address& from) {
        Head head;
        const auto content = key_->open(datagram, head);
        const bool is_ready = is_ready_.load(std::memory_order_relaxed);
        if (head.kind == Kind{} || head.session != nonce_ || !(from == server_)) {
            if (!is_ready && from == server_ && Key::is_of_other_version(datagram))
                refuse("it speaks another version, " + versions(datagram) +
                       "; use the same BlockFactory on both sides");
            arrivals_.reject();
            return;
        }
        if (head.kind == Kind::busy && !is_ready) {
            refuse(text_of(content));
        } else if (head.kind == Kind::welcome) {
            if (!is_ready) welcome(head.number, text_of(content));
        } else if (!is_ready || !vectors_) {
            arrivals_.reject();
        } else if (arrivals_.come(head.sequence)) {
            heard_ = now();
            if (head.kind == Kind::here) return;
            auto& incoming = head.kind == Kind::gains ? vectors_->gains : vectors_->state;
            if ((head.kind == Kind::state || head.kind == Kind::gains) &&
                incoming.come(head.number, content)) {
                if (head.kind == Kind::state) bell_.ring();
            } else {
                arrivals_.reject();
                if (head.kind == Kind::state) wrong_size_ = static_cast<int>(content.size() / sizeof(double));
            }
        }
    }
    static std::string text_of(std::span<const std::byte> content) {
        return {reinterpret_cast<const char*>(content.data()), content.size()};
    }
    void refuse(const std::string& why) {
        const std::lock_guard lock(mutex_);
        refusal_ = why;
    }
    void welcome(std::uint64_t session, std::string text) {
        session_ = session;
        text_ = std::move(text);
        try {
            vectors_.emplace(RobotLayout(RobotDescription::read(text_)));
        } catch (const std::exception&) {
            vectors_.reset(); // start() says what is wrong
        }
        heard_ = now();
        is_ready_.store(true, std::memory_order_release);
    }
    void send() {
        if (!is_ready_) {
            key_->seal({Kind::hello, 0, 0, nonce_}, {}, datagram_);
            socket_.send(datagram_, server_);
            return;
        }
        if (!vectors_) return;
        // Settings are repeated until the robot has taken them, and go first: a robot that waits for a
        // command waits for what was set before it, too.
        const auto& settings = vectors_->settings.last();
        const auto& state = vectors_->state.last();
        vectors_->settings.send(*key_, session_, sequence_, socket_, server_,
                                state[RobotLayout::owner] != settings[RobotLayout::of] ||
                                    state[RobotLayout::settings] != settings[RobotLayout::count]);
        // The last word is said thrice, as nobody repeats it.
        bool is_said = false;
        for (int said = 0; said < (is_closing_ ? 3 : 1); ++said)
            is_said = vectors_->command.send(*key_, session_, sequence_, socket_, server_, true);
        if (!is_said) {
            key_->seal({Kind::here, session_, ++sequence_, 0}, {}, datagram_);
            socket_.send(datagram_, server_);
        }
    }

    const std::string address_, key_file_, name_;
    Address server_;
    std::optional<Key> key_;
    Socket socket_;
    std::uint64_t nonce_ = 0, session_ = 0; ///< of the datagrams to us; to the server
    std::uint64_t sequence_ = 0;            ///< of the last one to the server
    Arrivals arrivals_;
    std::string text_;
    std::optional<Vectors> vectors_;
    std::atomic<bool> is_ready_{false}, is_closing_{false};
    std::atomic<double> heard_{0};
    std::atomic<int> wrong_size_{-1};
    Bell bell_{};
    std::mutex mutex_;
    std::string refusal_;
    std::vector<std::byte> datagram_;
};

class End final : public middleware::RobotEnd {
  public:
    End(const std::string& address, std::string key)
        : address_(address), key_file_(std::move(key)), name_("robot at " + address + " (UDP)") {}

    void start(const RobotDescription& description) override {
        key_.emplace(key_file_, true);
        text_ = description.text();
        if (text_.size() > Key::most_bytes)
            throw std::runtime_error("what it says of itself has " + std::to_string(text_.size()) +
                                     " bytes, which no datagram holds; give it fewer joints or sensors");
        vectors_.emplace(RobotLayout(description));
        socket_.open(address_of(address_));
        socket_.run([this](auto datagram, const Address& from) { receive(datagram, from); },
                    [this] { send(); }, pause);
    }
    void show_state(const double* state, double) noexcept override {
        vectors_->state.write(state);
        socket_.wake();
    }
    void show_gains(const double* gains) noexcept override { vectors_->gains.write(gains); }
    bool take_command(double* command, Stamp& stamp) noexcept override {
        return vectors_->command.take(command, stamp);
    }
    bool take_settings(double* settings) noexcept override {
        Stamp stamp;
        return vectors_->settings.take(settings, stamp);
    }
    void wait(double timeout) noexcept override {
        bell_.wait(timeout, [&] { return vectors_->command.is_there() || vectors_->settings.is_there(); });
    }
    bool is_gone() noexcept override { return now() - heard_ > gone_after; }
    Counts counts() const noexcept override { return arrivals_.counts(); }
    std::string take_news() override {
        if (counts().rejected == 0 || std::exchange(is_told_, true)) return "";
        return "left out a datagram that has another key, version or size, or was sent again by somebody; so "
               "are those that follow";
    }
    const std::string& name() const noexcept override { return name_; }

  private:
    struct Vectors {
        explicit Vectors(const RobotLayout& at)
            : state(Kind::state, at.state_size()), gains(Kind::gains, at.settings_size()),
              command(at.command_size()), settings(at.settings_size()) {}
        Outgoing state, gains;
        Incoming command, settings;
    };

    // In the socket's thread.
    void receive(std::span<const std::byte> datagram, const Address& from) {
        Head head;
        const auto content = key_->open(datagram, head);
        if (head.kind == Kind::hello) {
            greet(head.number, from);
        } else if (session_ != 0 && head.session == session_ && from == controller_ &&
                   (head.kind == Kind::command || head.kind == Kind::settings || head.kind == Kind::here)) {
            if (!arrivals_.come(head.sequence)) return;
            heard_ = now();
            if (head.kind == Kind::here) return;
            has_spoken_ = true;
            if (!(head.kind == Kind::command ? vectors_->command : vectors_->settings)
                     .come(head.number, content))
                arrivals_.reject();
            bell_.ring();
        } else {
            arrivals_.reject();
            // Whoever speaks another version sees by this that it is another one; it is shorter than his.
            if (Key::is_of_other_version(datagram)) {
                key_->seal({Kind::busy, 0, 0, 0}, {}, datagram_);
                if (datagram_.size() <= datagram.size()) socket_.send(datagram_, from);
            }
        }
    }
    void greet(std::uint64_t nonce, const Address& from) {
        const bool is_known = session_ != 0 && nonce == nonce_ && from == controller_;
        // A greeting alone, which may have been recorded, keeps nobody out.
        if (!is_known && has_spoken_ && !is_gone()) {
            const std::string text =
                "another program (at " + controller_.text() + ") drives it; end that one first";
            key_->seal({Kind::busy, nonce, 0, 0}, bytes_of(text), datagram_);
        } else {
            if (!is_known) {
                session_ = random_number();
                sequence_ = 0;
                arrivals_.begin();
                has_spoken_ = false;
                nonce_ = nonce;
                controller_ = from;
                for (auto* incoming : {&vectors_->command, &vectors_->settings}) incoming->begin();
                for (auto* outgoing : {&vectors_->state, &vectors_->gains}) outgoing->begin();
            }
            heard_ = now();
            key_->seal({Kind::welcome, nonce, 0, session_}, bytes_of(text_), datagram_);
        }
        socket_.send(datagram_, from);
    }
    void send() {
        if (session_ == 0 || is_gone()) return;
        if (!vectors_->state.send(*key_, nonce_, sequence_, socket_, controller_, true)) {
            key_->seal({Kind::here, nonce_, ++sequence_, 0}, {}, datagram_);
            socket_.send(datagram_, controller_);
        }
        vectors_->gains.send(*key_, nonce_, sequence_, socket_, controller_,
                             ++pauses_ % repeats_of_gains == 0);
    }

    const std::string address_, key_file_, name_;
    std::optional<Key> key_;
    std::string text_;
    std::optional<Vectors> vectors_;
    Address controller_;
    std::uint64_t nonce_ = 0, session_ = 0; ///< of the datagrams to the controller; to us
    std::uint64_t sequence_ = 0;            ///< of the last one to the controller
    Arrivals arrivals_;
    std::atomic<double> heard_{0};
    Bell bell_{};
    std::vector<std::byte> datagram_;
    int pauses_ = 0;
    bool has_spoken_ = false; ///< the controller, by a command
    bool is_told_ = false;    ///< that something was left out
    Socket socket_;           ///< its thread ends first
};

} // namespace

std::string wrong_address(const std::string& address, bool may_choose) {
    try {
        address_of(address, may_choose);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

std::unique_ptr<middleware::RobotLink> make_link(const std::string& address, const std::string& key) {
    return std::make_unique<Link>(address, key);
}
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& address, const std::string& key) {
    return std::make_unique<End>(address, key);
}

} // namespace bf::udp
