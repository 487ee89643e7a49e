#include "streams.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

namespace bf::udp {

using middleware::Bell;
using middleware::ExchangeBuffer;
using toolbox::Taken;

namespace {

constexpr double pause = 0.005;                               ///< s
constexpr double between_announcements = 0.1, gone_after = 1; ///< s
constexpr double doubted_after = 3;                           ///< s of silence, what was agreed
constexpr double forgotten_after = 10;                        ///< s of silence
constexpr double patience = 0.3; ///< s, for who may be there already when a stream is opened
constexpr std::size_t longest_name = 200, most_peers = 64;

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
    void say_source(Source& text) const noexcept override {
        const std::uint64_t at = from;
        const auto ip = static_cast<unsigned>(at >> 16);
        if (at == 0)
            std::strcpy(text, "UDP");
        else
            std::snprintf(text, sizeof text, "UDP from %u.%u.%u.%u:%u", ip >> 24, ip >> 16 & 255,
                          ip >> 8 & 255, ip & 255, static_cast<unsigned>(at & 0xffff));
    }

    ExchangeBuffer newest; ///< number, time, values
    Bell bell{};
    std::atomic<double> heard{-1e9}; ///< when somebody said that he writes it, s
    std::atomic<std::uint64_t> wrong_messages{0};
    std::atomic<int> wrong_size{0};
    std::atomic<std::uint64_t> from{0}; ///< address of who writes it: four bytes of its host, two of its port
    Arrivals arrivals;                  ///< of the messages
    std::uint64_t writer = 0;           ///< number of the datagrams of who writes it; 0: nobody does
    double writer_heard = 0;            ///< when he was heard, s
    std::uint64_t last = 0;             ///< his newest message

  private:
    std::vector<double> values_;
    middleware::Stamp taken_;
    std::uint64_t seen_wrong_ = 0;
};

class StreamsConnection::Writer final : public toolbox::StreamWriter {
  public:
    Writer(int size, Socket& socket)
        : newest(size), values(static_cast<std::size_t>(size)), socket_(socket) {}

    bool write(const Eigen::Ref<const Eigen::VectorXd>& given) noexcept override {
        newest.write(given.data(), system_time());
        socket_.wake();
        return true;
    }
    bool has_reader() const noexcept override { return middleware::now() - heard < gone_after; }

    ExchangeBuffer newest;
    std::vector<double> values;
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
    secret_ = random_number();
    is_closing_ = false;
    peers_.clear();
    strangers_.clear();
    for (const auto& peer : peer_names_) {
        auto& made = peers_.emplace_back();
        made.at = address_of(peer);
        made.is_named = true;
    }
    socket_.open(address_of(at_, true));
    socket_.run([this](auto datagram, const Address& from) { receive(datagram, from); }, [this] { send(); },
                pause);
}

void StreamsConnection::close() noexcept {
    is_closing_ = true;
    socket_.close();
    readers_.clear();
    writers_.clear();
}

namespace {

/// Waits a little for somebody at the other end.
template <class F> void wait_for_other_end(std::atomic<bool>& is_awaited, F&& is_there) {
    is_awaited = true;
    for (const double end = middleware::now() + patience;
         middleware::now() < end && !is_there() && !is_interrupted();) {
        const timespec time{0, 2'000'000};
        nanosleep(&time, nullptr);
    }
    is_awaited = false;
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
    wait_for_other_end(is_awaited_, [&] { return reader->has_writer(); });
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
    wait_for_other_end(is_awaited_, [&] { return writer->has_reader(); });
    return writer;
}

std::shared_ptr<toolbox::SimulatorConnection> StreamsConnection::open_simulator(const std::string& server,
                                                                                const std::string&, double) {
    throw std::runtime_error(
        "the simulator '" + server +
        "' cannot be stepped over UDP; use LocalStreams for that, or let bf serve wait for a controller");
}
std::shared_ptr<toolbox::SimulatorServer> StreamsConnection::serve_simulator(const std::string& name,
                                                                             double) {
    throw std::runtime_error(
        "the simulator '" + name +
        "' cannot be served over UDP; use LocalStreams for that, or let bf serve wait for a controller");
}

double StreamsConnection::now() const noexcept { return system_time(); }

// ---- in the socket's thread

StreamsConnection::Peer* StreamsConnection::peer_at(const Address& at) {
    const auto found = std::find_if(peers_.begin(), peers_.end(), [&](const Peer& p) { return p.at == at; });
    return found == peers_.end() ? nullptr : &*found;
}

std::uint64_t StreamsConnection::challenge(const Address& at) const {
    std::array<std::byte, 14> bytes;
    std::memcpy(bytes.data(), &secret_, 8);
    std::memcpy(bytes.data() + 8, &at.ip.sin_addr.s_addr, 4);
    std::memcpy(bytes.data() + 12, &at.ip.sin_port, 2);
    return key_->number_of(bytes);
}

void StreamsConnection::receive(std::span<const std::byte> datagram, const Address& from) {
    Head head;
    const auto content = key_->open(datagram, head);
    const std::lock_guard lock(mutex_);
    if (head.kind == Kind::peer)
        hear(head, content, from);
    else if (head.kind == Kind::news)
        take(head, content, from);
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
    Peer* peer = peer_at(from);
    if (!peer || peer->ours != head.session || peer->theirs != head.number) {
        if (head.session != challenge(from)) {
            // It may have been recorded: who sends is asked to answer. Who is known and was heard of
            // late is only reminded of what was agreed, unless somebody there has it already and is another
            // program.
            if (peer && peer->ours != 0 && peer->ours != head.session &&
                middleware::now() - peer->heard < doubted_after)
                peer->is_owed = true;
            else if (strangers_.size() < most_peers &&
                     std::none_of(strangers_.begin(), strangers_.end(),
                                  [&](const Stranger& s) { return s.at == from; }))
                strangers_.push_back({from, head.number});
            if (head.session != 0) ++rejected_;
            return;
        }
        // He has heard what we said of late, so he lives: what was agreed before is void.
        if (!peer) {
            if (peers_.size() >= most_peers) {
                ++rejected_;
                return;
            }
            peer = &peers_.emplace_back();
            peer->at = from;
        }
        peer->ours = head.session;
        peer->theirs = head.number;
        peer->sent = 1; // which both had before they had agreed
        peer->arrivals.begin(head.sequence);
        peer->is_owed = true;
        std::erase_if(strangers_, [&](const Stranger& s) { return s.at == from; });
        secret_ = random_number();
    }
    if (!peer->arrivals.come(head.sequence)) return;
    const double time = peer->heard = middleware::now();
    if (content.empty()) return;
    for (auto& [name, reader] : readers_)
        if (reader->writer == peer->ours) reader->writer_heard = -1e9; // unless it is named
    std::uint8_t role = 0;
    for (std::string name; cut(content, role) && cut(content, name);) {
        if (role == 'w') {
            const auto found = readers_.find(name);
            if (found == readers_.end()) continue;
            found->second->heard = time;
            if (found->second->writer == peer->ours) found->second->writer_heard = time;
        } else if (const auto found = writers_.find(name); found != writers_.end()) {
            found->second->heard = time;
        }
    }
}

bool StreamsConnection::has_live_writer(const Reader& reader) const {
    return middleware::now() - reader.writer_heard < gone_after &&
           std::any_of(peers_.begin(), peers_.end(),
                       [&](const Peer& p) { return p.ours != 0 && p.ours == reader.writer; });
}

void StreamsConnection::take(const Head& head, std::span<const std::byte> content, const Address& from) {
    Peer* peer = peer_at(from);
    std::string name;
    double time = 0;
    if (!peer || peer->ours == 0 || peer->ours != head.session || !cut(content, name) ||
        !cut(content, time) || content.size() % sizeof(double) != 0) {
        ++rejected_;
        return;
    }
    const bool is_first = peer->arrivals.come(head.sequence);
    if (is_first) peer->heard = middleware::now();
    const auto found = readers_.find(name);
    if (found == readers_.end()) return;
    Reader& reader = *found->second;
    if (reader.writer != peer->ours) {
        if (!is_first || has_live_writer(reader)) return reader.arrivals.reject();
        reader.writer = peer->ours;
        reader.from = std::uint64_t{ntohl(from.ip.sin_addr.s_addr)} << 16 | ntohs(from.ip.sin_port);
        reader.arrivals.begin(head.number);
        reader.last = 0;
    }
    if (!reader.arrivals.come(head.number)) return;
    reader.heard = reader.writer_heard = middleware::now();
    if (head.number < reader.last) return;
    reader.last = head.number;
    const std::size_t count = content.size() / sizeof(double);
    if (static_cast<int>(count) + 2 != reader.newest.size()) {
        reader.wrong_size = static_cast<int>(count);
        ++reader.wrong_messages;
    } else {
        std::vector<double> message(count + 2);
        message[0] = static_cast<double>(head.number);
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
        append(content_, writer->taken.time);
        const auto values = bytes_of(writer->values);
        content_.insert(content_.end(), values.begin(), values.end());
        ++writer->sent;
        for (auto& peer : peers_) {
            if (peer.theirs == 0) continue;
            key_->seal({Kind::news, peer.theirs, ++peer.sent, writer->sent}, content_, datagram_);
            socket_.send(datagram_, peer.at);
        }
    }
    // A stranger's datagrams, which anybody may have recorded, are answered here by one that is no longer, so
    // that nobody makes a flood of them.
    for (const auto& stranger : strangers_) {
        key_->seal({Kind::peer, stranger.number, 1, challenge(stranger.at)}, {}, datagram_);
        socket_.send(datagram_, stranger.at);
    }
    strangers_.clear();
    const double time = middleware::now();
    const bool is_time = time - announced_ >= between_announcements || is_closing_;
    if (is_time) announced_ = time;
    const auto is_forgotten = [&](const Peer& p) { return time - p.heard > forgotten_after; };
    std::erase_if(peers_, [&](const Peer& p) { return !p.is_named && is_forgotten(p); });
    for (auto& peer : peers_) {
        if (is_forgotten(peer)) peer.theirs = peer.ours = 0;
        const bool is_agreed = peer.theirs != 0;
        if (is_agreed ? is_time || peer.is_owed : (is_time || is_awaited_) && !is_closing_) announce(peer);
    }
}

void StreamsConnection::announce(Peer& to) {
    content_.clear();
    const auto add = [&](const auto& streams, char role) {
        for (const auto& [name, stream] : streams) {
            append(content_, static_cast<std::uint8_t>(role));
            append(content_, name);
        }
    };
    add(readers_, 'r');
    if (!is_closing_) add(writers_, 'w');
    if (content_.empty()) append(content_, std::uint8_t{0}); // nothing is written any more
    to.is_owed = false;
    if (to.theirs != 0)
        key_->seal({Kind::peer, to.theirs, ++to.sent, to.ours}, content_, datagram_);
    else
        key_->seal({Kind::peer, 0, 1, challenge(to.at)}, content_, datagram_);
    socket_.send(datagram_, to.at);
}

} // namespace bf::udp
