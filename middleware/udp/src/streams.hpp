// Streams of vectors between programs on one or several computers.
#pragma once

#include "bf/middleware/robot_frames.hpp"
#include "bf/toolbox/streams.hpp"
#include "packet.hpp"
#include "socket.hpp"

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace bf::udp {

/// Every program tells its peers what it reads and writes, and sends each message to all of them. A message
/// that is lost is not sent again; one that comes after a newer one is left out. Of a stream that one program
/// after another writes, the last one is heard.
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
    void sleep_until(double time) const noexcept override;

  private:
    class Reader;
    class Writer;
    struct Peer {
        Address at;
        bool is_named = false;     ///< as an argument: it is told of us before it is heard of
        std::uint64_t session = 0; ///< of the datagrams to it; 0: it has not been heard of
        double heard = 0;          ///< s
    };

    void receive(std::span<const std::byte> datagram, const Address& from);
    void hear(const Head& head, std::span<const std::byte> content, const Address& from);
    void take(const Head& head, std::span<const std::byte> content);
    void send();
    void announce(const Address& to, std::uint64_t session);

    const std::string at_;
    const std::vector<std::string> peer_names_;
    const std::string key_file_;
    std::optional<Key> key_;
    std::uint64_t nonce_ = 0;  ///< of the datagrams to us
    mutable std::mutex mutex_; ///< of what blocks open and the thread uses; no step locks it
    std::vector<Peer> peers_;
    std::map<std::string, std::shared_ptr<Reader>> readers_;
    std::map<std::string, std::shared_ptr<Writer>> writers_;
    std::atomic<std::uint64_t> rejected_{0};
    double announced_ = 0;
    std::vector<std::byte> datagram_, content_;
    Socket socket_; ///< its thread ends first
};

} // namespace bf::udp
