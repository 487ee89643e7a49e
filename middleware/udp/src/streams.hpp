// Streams of vectors between programs on one or several computers.
#pragma once

#include "bf/middleware/robot_frames.hpp"
#include "bf/toolbox/streams.hpp"
#include "packet.hpp"
#include "socket.hpp"

#include <atomic>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace bf::udp {

/// Every program tells its peers what it reads and writes, and sends each message to all of them. A message
/// that is lost is not sent again; one that comes after a newer one is left out. Of a stream that several
/// programs write, the first one is heard until it has ended, or is silent for a second.
///
/// Two programs agree on two numbers, by which each knows the datagrams of the other one: each tells its own
/// until it is answered with it, once, and then it is never told again. So a datagram that was recorded moves
/// nothing: either its number is that of another agreement, or its place in the sequence was taken.
class Streams final : public toolbox::StreamNetwork {
  public:
    /// Addresses as address_of() takes them. Programs that know the key and send something are peers, too.
    Streams(std::string at, std::vector<std::string> peers, std::string key)
        : at_(std::move(at)), peers_(std::move(peers)), key_(std::move(key)) {}
    std::shared_ptr<toolbox::StreamConnection> open() const override;

  private:
    const std::string at_;
    const std::vector<std::string> peers_;
    const std::string key_;
};

class StreamsConnection final : public toolbox::StreamConnection {
  public:
    StreamsConnection(std::string at, std::vector<std::string> peers, std::string key)
        : at_(std::move(at)), peer_names_(std::move(peers)), key_file_(std::move(key)) {}
    ~StreamsConnection() override { close(); }

    /// Begins, unless it has. Throws std::runtime_error.
    void start();
    void close() noexcept;
    middleware::Counts counts() const noexcept;

    std::shared_ptr<toolbox::StreamReader> open_reader(const std::string& name, int size) override;
    std::shared_ptr<toolbox::StreamWriter> open_writer(const std::string& name, int size) override;
    std::shared_ptr<toolbox::SimulatorConnection> open_simulator(const std::string& server,
                                                                 const std::string& client,
                                                                 double timeout) override;
    std::shared_ptr<toolbox::SimulatorServer> serve_simulator(const std::string& name,
                                                              double step_size) override;
    double now() const noexcept override;

  private:
    class Reader;
    class Writer;
    struct Peer {
        Address at;
        bool is_named = false; ///< as an argument: it is told of us before it is heard of
        /// Numbers of the datagrams to it and from it; 0: nothing is agreed.
        std::uint64_t theirs = 0, ours = 0;
        std::uint64_t sent = 0; ///< sequence of the last datagram to it
        Arrivals arrivals;      ///< of those from it
        double heard = 0;       ///< s
        bool is_owed = false;   ///< an answer
    };
    struct Stranger {
        Address at;
        std::uint64_t number; ///< by which he wants to be answered
    };

    void receive(std::span<const std::byte> datagram, const Address& from);
    void hear(const Head& head, std::span<const std::byte> content, const Address& from);
    void take(const Head& head, std::span<const std::byte> content, const Address& from);
    void send();
    void announce(Peer& to);
    Peer* peer_at(const Address& at);
    /// The number by which who is at that address is to answer, until somebody has.
    std::uint64_t challenge(const Address& at) const;
    bool has_live_writer(const Reader& reader) const;

    const std::string at_;
    const std::vector<std::string> peer_names_;
    const std::string key_file_;
    std::optional<Key> key_;
    std::uint64_t secret_ = 0; ///< of challenges
    mutable std::mutex mutex_; ///< of what blocks open and the thread uses; no step locks it
    std::list<Peer> peers_;
    std::vector<Stranger> strangers_; ///< who have asked since we have sent
    std::atomic<bool> is_closing_{false}, is_awaited_{false};
    std::map<std::string, std::shared_ptr<Reader>> readers_;
    std::map<std::string, std::shared_ptr<Writer>> writers_;
    std::atomic<std::uint64_t> rejected_{0};
    double announced_ = 0;
    std::vector<std::byte> datagram_, content_;
    Socket socket_; ///< its thread ends first
};

} // namespace bf::udp
