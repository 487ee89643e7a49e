#include "streams.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

namespace bf::udp {

using middleware::Bell;
using middleware::ExchangeBuffer;
using toolbox::Taken;

namespace {

constexpr double pause = 0.02;                                ///< s
constexpr double between_announcements = 0.1, gone_after = 1; ///< s
constexpr double forgotten_after = 10;                        ///< s, peers that were not named
constexpr double patience = 0.3; ///< s, for who may be there already when a stream is opened
constexpr std::size_t longest_name = 200, most_peers = 64, most_writers = 1000;

double system_time() noexcept {
    timespec time{};
    clock_gettime(CLOCK_REALTIME, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <class T> void append(std::vector<std::byte>& bytes, const T& value) {
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
}
void append(std::vector<std::byte>& bytes, const std::string& text) {
    append(bytes, static_cast<std::uint16_t>(text.size()));
    const auto from = bytes_of(text);
    bytes.insert(bytes.end(), from.begin(), from.end());
}

/// Takes from the front; false where there is less.
template <class T> bool cut(std::span<const std::byte>& bytes, T& value) {
    if (bytes.size() < sizeof value) return false;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes = bytes.subspan(sizeof value);
    return true;
}
bool cut(std::span<const std::byte>& bytes, std::string& text) {
    std::uint16_t size = 0;
    if (!cut(bytes, size) || bytes.size() < size) return false;
    text.assign(reinterpret_cast<const char*>(bytes.data()), size);
    bytes = bytes.subspan(size);
    return true;
}

} // namespace

/// What a stream is to its blocks: they use it in steps, the thread of the socket beside.
class StreamsConnection::Reader final : public toolbox::StreamReader {
  public:
    explicit Reader(int size) : newest(size + 2), values_(static_cast<std::size_t>(size) + 2) {}

    Taken take(Eigen::Ref<Eigen::VectorXd> values, toolbox::Stamp& stamp) noexcept override {
        if (const auto wrong = wrong_messages.load(); wrong != seen_wrong_) {
            seen_wrong_ = wrong;
            return Taken::wrong_size;
        }
        if (newest.newest() == taken_.number || !newest.read(values_.data(), taken_)) return Taken::nothing;
        stamp = {values_[0], values_[1]};
        values = Eigen::Map<const Eigen::VectorXd>(values_.data() + 2, values.size());
        return Taken::message;
    }
    bool wait(double timeout) noexcept override {
        bell.wait(timeout,
                  [&] { return newest.newest() != taken_.number || wrong_messages.load() != seen_wrong_; });
        return newest.newest() != taken_.number || wrong_messages.load() != seen_wrong_;
    }
    bool has_writer() const noexcept override { return middleware::now() - heard < gone_after; }
    int received_size() const noexcept override { return wrong_size; }

    ExchangeBuffer newest; ///< number, time, values
    Bell bell{};
    std::atomic<double> heard{-1e9}; ///< when somebody said that he writes it, s
    std::atomic<std::uint64_t> wrong_messages{0};
    std::atomic<int> wrong_size{0};
    /// Of the messages, and who wrote them: the last one alone is heard, so that what was recorded of one
    /// before is not taken.
    Arrivals arrivals;
    std::vector<std::uint64_t> writers;
    std::uint64_t last = 0; ///< newest message of the last writer

  private:
    std::vector<double> values_;
    middleware::Stamp taken_;
    std::uint64_t seen_wrong_ = 0;
};

class StreamsConnection::Writer final : public toolbox::StreamWriter {
  public:
    Writer(int size, Socket& socket)
        : newest(size), values(static_cast<std::size_t>(size)), id(random_number()), socket_(socket) {}

    bool write(const Eigen::Ref<const Eigen::VectorXd>& given) noexcept override {
        newest.write(given.data(), system_time());
        socket_.wake();
        return true;
    }
    bool has_reader() const noexcept override { return middleware::now() - heard < gone_after; }

    ExchangeBuffer newest;
    std::vector<double> values;
    const std::uint64_t id; ///< by which readers know it from one of a program before
    std::atomic<double> heard{-1e9};
    middleware::Stamp taken;
    std::uint64_t sent = 0;

  private:
    Socket& socket_;
};

std::shared_ptr<toolbox::StreamConnection> Streams::open() const {
    return std::make_shared<StreamsConnection>(at_, peers_, key_);
}

void StreamsConnection::start() {
    if (socket_.is_open()) return;
    key_.emplace(key_file_, true);
    nonce_ = random_number();
    peers_.clear();
    for (const auto& peer : peer_names_) peers_.push_back({address_of(peer), true, 0, 0});
    socket_.open(address_of(at_, true));
    socket_.run([this](auto datagram, const Address& from) { receive(datagram, from); }, [this] { send(); },
                pause);
}

void StreamsConnection::close() noexcept {
    socket_.close();
    readers_.clear();
    writers_.clear();
}

namespace {

/// Waits a little for somebody at the other end.
template <class F> void wait_for_other_end(F&& is_there) {
    for (const double end = middleware::now() + patience;
         middleware::now() < end && !is_there() && !is_interrupted();) {
        const timespec time{0, 2'000'000};
        nanosleep(&time, nullptr);
    }
}

void check(const std::string& name, int size) {
    if (name.empty() || name.size() > longest_name)
        throw std::runtime_error("stream '" + name + "': its name needs 1 to 200 characters");
    if (static_cast<std::size_t>(size) * sizeof(double) > Key::most_bytes - 1000)
        throw std::runtime_error("stream '" + name + "': " + std::to_string(size) +
                                 " elements are more than a datagram holds, which are 7375");
}

} // namespace

std::shared_ptr<toolbox::StreamReader> StreamsConnection::open_reader(const std::string& name, int size) {
    check(name, size);
    start();
    auto reader = std::make_shared<Reader>(size);
    {
        const std::lock_guard lock(mutex_);
        if (auto& known = readers_[name]; known && known.use_count() > 1)
            throw std::runtime_error("stream '" + name +
                                     "': another block of this program reads it; wire that one's output");
        else
            known = reader;
        announced_ = 0;
    }
    socket_.wake();
    wait_for_other_end([&] { return reader->has_writer(); });
    return reader;
}

std::shared_ptr<toolbox::StreamWriter> StreamsConnection::open_writer(const std::string& name, int size) {
    check(name, size);
    start();
    auto writer = std::make_shared<Writer>(size, socket_);
    {
        const std::lock_guard lock(mutex_);
        if (auto& known = writers_[name]; known && known.use_count() > 1)
            throw std::runtime_error("stream '" + name + "': another block of this program writes it");
        else
            known = writer;
        announced_ = 0;
    }
    socket_.wake();
    wait_for_other_end([&] { return writer->has_reader(); });
    return writer;
}

std::shared_ptr<toolbox::SimulatorConnection> StreamsConnection::open_simulator(const std::string& server,
                                                                                const std::string&, double) {
    throw std::runtime_error("the simulator '" + server +
                             "' cannot be stepped over UDP; use LocalStreams for that, or "
                             "let bf serve wait for a controller");
}
std::shared_ptr<toolbox::SimulatorServer> StreamsConnection::serve_simulator(const std::string& name,
                                                                             double) {
    throw std::runtime_error("the simulator '" + name +
                             "' cannot be served over UDP; use LocalStreams for that, or let "
                             "bf serve wait for a controller");
}

double StreamsConnection::now() const noexcept { return system_time(); }
void StreamsConnection::sleep_until(double time) const noexcept {
    const double duration = time - now();
    if (!(duration > 0)) return;
    const double whole = std::floor(duration);
    timespec left{static_cast<time_t>(whole), static_cast<long>((duration - whole) * 1e9)};
    while (nanosleep(&left, &left) != 0) continue;
}

// ---- in the socket's thread

void StreamsConnection::receive(std::span<const std::byte> datagram, const Address& from) {
    Head head;
    const auto content = key_->open(datagram, head);
    const std::lock_guard lock(mutex_);
    if (head.kind == Kind::here)
        hear(head, content, from);
    else if (head.kind == Kind::message && head.session == nonce_)
        take(head, content);
    else
        ++rejected_;
}

middleware::Counts StreamsConnection::counts() const noexcept {
    middleware::Counts sum;
    sum.rejected = rejected_;
    for (const auto& [name, reader] : readers_) { // which were all opened before the first step
        const auto its = reader->arrivals.counts();
        sum.received += its.received;
        sum.lost += its.lost;
        sum.late += its.late;
        sum.duplicates += its.duplicates;
        sum.rejected += its.rejected;
    }
    return sum;
}

void StreamsConnection::hear(const Head& head, std::span<const std::byte> content, const Address& from) {
    // Who does not know our number may have been recorded long ago: he tells nothing, and hears it.
    if (head.session != nonce_) return announce(from, head.number);
    auto peer = std::find_if(peers_.begin(), peers_.end(), [&](const Peer& p) { return p.at == from; });
    if (peer == peers_.end()) {
        if (peers_.size() >= most_peers) {
            ++rejected_;
            return;
        }
        peer = peers_.insert(peers_.end(), Peer{.at = from});
    }
    peer->heard = middleware::now();
    if (std::exchange(peer->session, head.number) != head.number) announce(from, peer->session);
    std::uint8_t role = 0;
    for (std::string name; cut(content, role) && cut(content, name);) {
        if (role == 'w') {
            if (const auto found = readers_.find(name); found != readers_.end())
                found->second->heard = middleware::now();
        } else if (const auto found = writers_.find(name); found != writers_.end()) {
            found->second->heard = middleware::now();
        }
    }
}

void StreamsConnection::take(const Head& head, std::span<const std::byte> content) {
    std::string name;
    std::uint64_t writer = 0;
    double time = 0;
    if (!cut(content, name) || !cut(content, writer) || !cut(content, time) ||
        content.size() % sizeof(double) != 0) {
        ++rejected_;
        return;
    }
    const auto found = readers_.find(name);
    if (found == readers_.end()) return;
    Reader& reader = *found->second;
    if (reader.writers.empty() || reader.writers.back() != writer) {
        const bool was_before =
            std::find(reader.writers.begin(), reader.writers.end(), writer) != reader.writers.end();
        if (was_before || reader.writers.size() >= most_writers) return reader.arrivals.reject();
        reader.writers.push_back(writer);
        reader.arrivals.begin(head.sequence);
        reader.last = 0;
    }
    if (!reader.arrivals.come(head.sequence)) return;
    reader.heard = middleware::now();
    if (head.sequence < reader.last) return;
    reader.last = head.sequence;
    const std::size_t count = content.size() / sizeof(double);
    if (static_cast<int>(count) + 2 != reader.newest.size()) {
        reader.wrong_size = static_cast<int>(count);
        ++reader.wrong_messages;
    } else {
        std::vector<double> message(count + 2);
        message[0] = static_cast<double>(head.sequence);
        message[1] = time;
        if (count > 0) std::memcpy(message.data() + 2, content.data(), content.size());
        reader.newest.write(message.data(), time);
    }
    reader.bell.ring();
}

void StreamsConnection::send() {
    const std::lock_guard lock(mutex_);
    for (auto& [name, writer] : writers_) {
        if (writer->newest.newest() == writer->taken.number ||
            !writer->newest.read(writer->values.data(), writer->taken))
            continue;
        content_.clear();
        append(content_, name);
        append(content_, writer->id);
        append(content_, writer->taken.time);
        const auto values = bytes_of(writer->values);
        content_.insert(content_.end(), values.begin(), values.end());
        ++writer->sent;
        for (const auto& peer : peers_) {
            if (peer.session == 0) continue;
            key_->seal({Kind::message, peer.session, writer->sent, 0}, content_, datagram_);
            socket_.send(datagram_, peer.at);
        }
    }
    const double time = middleware::now();
    if (time - announced_ < between_announcements) return;
    announced_ = time;
    std::erase_if(peers_, [&](const Peer& p) { return !p.is_named && time - p.heard > forgotten_after; });
    for (const auto& peer : peers_) announce(peer.at, peer.session);
}

void StreamsConnection::announce(const Address& to, std::uint64_t session) {
    content_.clear();
    const auto add = [&](const auto& streams, char role) {
        for (const auto& [name, stream] : streams) {
            append(content_, static_cast<std::uint8_t>(role));
            append(content_, name);
        }
    };
    add(readers_, 'r');
    add(writers_, 'w');
    key_->seal({Kind::here, session, 0, nonce_}, content_, datagram_);
    socket_.send(datagram_, to);
}

} // namespace bf::udp
