// bf_fuzz_packets: datagrams of chance for both sides of a robot and for streams, under sanitizers.
#include "bad_way.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/udp/robot.hpp"
#include "packet.hpp"
#include "streams.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>

namespace bf::udp::test {
namespace {

using Bytes = std::vector<std::byte>;

std::string as_text(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Somebody with the key who says anything.
class Stranger {
  public:
    Stranger(const std::string& key, std::uint64_t seed) : key_(key, false), random_(seed) {}
    ~Stranger() { close(socket_); }

    int port() const { return port_of(socket_); }
    std::uint64_t chance(std::uint64_t below) { return random_() % below; }

    /// Waits for a datagram of that kind; false: none comes.
    bool hear(Kind kind, Head& head, int milliseconds = 2000) {
        for (const double end = middleware::now() + milliseconds * 1e-3; middleware::now() < end;) {
            pollfd waits{socket_, POLLIN, 0};
            if (poll(&waits, 1, 10) <= 0) continue;
            Bytes bytes(65536);
            sockaddr_in from{};
            socklen_t size = sizeof from;
            const auto count = recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                        reinterpret_cast<sockaddr*>(&from), &size);
            if (count < 0) continue;
            key_.open(std::span(bytes).first(static_cast<std::size_t>(count)), head);
            if (head.kind != kind) continue;
            from_ = ntohs(from.sin_port);
            return true;
        }
        return false;
    }
    int heard_from() const { return from_; }

    void say(int port, const Head& head, std::span<const std::byte> content) {
        key_.seal(head, content, datagram_);
        send_to(socket_, port, as_text(datagram_));
    }

    /// A datagram of chance for a receiver whose session is known. `right` is a content that it understands.
    void say_anything(int port, std::uint64_t session, Bytes right) {
        const auto way = chance(4);
        if (way == 0) { // noise
            std::string noise(chance(1500), '\0');
            for (auto& byte : noise) byte = static_cast<char>(random_());
            if (chance(2) && noise.size() > 4) std::memcpy(noise.data(), &Head::magic, 4);
            send_to(socket_, port, noise);
            return;
        }
        for (auto changes = chance(4); changes > 0 && !right.empty(); --changes)
            right[chance(right.size())] = static_cast<std::byte>(random_());
        if (chance(3) == 0) right.resize(chance(right.size() + 100));
        if (chance(50) == 0) right.resize(Key::most_bytes);
        const Head head{static_cast<Kind>(1 + chance(12)), chance(8) ? session : random_(),
                        chance(4) ? ++sequence_ : random_(), chance(4) ? ++number_ : random_()};
        key_.seal(head, right, datagram_);
        if (way == 1) datagram_[chance(datagram_.size())] ^= static_cast<std::byte>(1 + chance(255));
        send_to(socket_, port, as_text(datagram_));
    }

  private:
    const Key key_;
    std::mt19937_64 random_;
    const int socket_ = local_socket();
    Bytes datagram_;
    std::uint64_t sequence_ = 0, number_ = 0;
    int from_ = 0;
};

middleware::RobotDescription description_of(std::uint64_t joints) {
    middleware::RobotDescription d;
    d.name = "chance";
    d.period = 0.001;
    for (std::uint64_t j = 0; j < joints; ++j) d.joints.push_back("joint" + std::to_string(j));
    d.wrenches = {"foot"};
    for (auto* limits : {&d.position_min, &d.position_max, &d.velocity_min, &d.velocity_max})
        limits->setZero(static_cast<Eigen::Index>(joints));
    return d;
}

Bytes doubles(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    Bytes bytes(count * sizeof(double));
    for (auto& byte : bytes) byte = static_cast<std::byte>(random());
    return bytes;
}

void check(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "%s\n", what);
    std::exit(1);
}

/// The server: whoever has the key says anything, and afterwards a controller is heard as ever.
void try_server(const std::string& key, std::uint64_t seed) {
    const auto description = description_of(seed % 5);
    const middleware::RobotLayout at(description);
    const int port = free_port();
    auto end = make_end(std::to_string(port), key);
    end->start(description);
    const std::vector<double> state(static_cast<std::size_t>(at.state_size()));
    std::vector<double> command(static_cast<std::size_t>(at.command_size())),
        settings(static_cast<std::size_t>(at.settings_size()));
    middleware::Stamp stamp;
    {
        Stranger stranger(key, seed);
        Head head;
        stranger.say(port, {Kind::hello, 0, 0, 77}, {});
        check(stranger.hear(Kind::welcome, head), "the server does not welcome");
        for (int k = 0; k < 3000; ++k, usleep(10)) {
            stranger.say_anything(port, head.number, doubles(command.size(), seed + 1));
            end->show_state(state.data(), 0);
            end->take_command(command.data(), stamp);
            end->take_settings(settings.data());
        }
    }
    auto link = make_link(std::to_string(port), key);
    check(link->start(10).joints == description.joints, "the server describes another robot");
    end->show_state(state.data(), 0);
    std::vector<double> seen(state.size());
    for (int k = 0; k < 5000 && !link->take_state(seen.data(), stamp); ++k) usleep(1000);
    check(seen == state, "no state comes after what was said");
    link->stop();
}

/// The controller: its server says anything.
void try_controller(const std::string& key, std::uint64_t seed) {
    const auto description = description_of(seed % 5);
    const std::string text = description.text();
    Stranger stranger(key, seed);
    std::atomic<bool> goes_on{true};
    std::thread server([&] {
        Head head;
        while (goes_on)
            if (stranger.hear(Kind::hello, head, 20)) {
                const auto session = head.number;
                std::string told = text;
                for (auto changes = stranger.chance(3); changes > 0; --changes)
                    told[stranger.chance(told.size())] = static_cast<char>(stranger.chance(256));
                stranger.say(stranger.heard_from(), {Kind::welcome, session, 0, 5}, bytes_of(told));
                for (int k = 0; k < 3000 && goes_on; ++k, usleep(10))
                    stranger.say_anything(
                        stranger.heard_from(), session,
                        doubles(static_cast<std::size_t>(middleware::RobotLayout(description).state_size()),
                                seed));
            }
    });
    auto link = make_link(std::to_string(stranger.port()), key);
    try {
        const middleware::RobotLayout at(link->start(0.05));
        std::vector<double> state(static_cast<std::size_t>(at.state_size())),
            gains(static_cast<std::size_t>(at.settings_size())),
            command(static_cast<std::size_t>(at.command_size()));
        middleware::Stamp stamp;
        for (int k = 0; k < 200; ++k, usleep(500)) {
            link->take_state(state.data(), stamp);
            link->take_gains(gains.data());
            link->send_command(command.data());
            link->send_settings(gains.data());
        }
    } catch (const std::runtime_error&) { // it says why
    }
    link->stop();
    goes_on = false;
    server.join();
}

void try_streams(const std::string& key, std::uint64_t seed) {
    const int port = free_port();
    StreamsConnection streams(std::to_string(port), {}, key);
    const auto reader = streams.open_reader("/stream", 3);
    const auto writer = streams.open_writer("/other", 2);
    Stranger stranger(key, seed);
    Head head;
    const auto agree = [&](std::uint64_t number) {
        const std::uint64_t agreed = head.number;
        for (int tries = 0; tries < 100; ++tries) {
            stranger.say(port, {Kind::peer, agreed, 1, number}, {});
            if (!stranger.hear(Kind::peer, head, 50) || head.session != number) continue;
            stranger.say(port, {Kind::peer, head.number, 2, number}, {});
            return true;
        }
        return false;
    };
    check(agree(99), "streams do not answer");
    Bytes message;
    const auto put = [&](const auto& value) {
        const auto* from = reinterpret_cast<const std::byte*>(&value);
        message.insert(message.end(), from, from + sizeof value);
    };
    put(std::uint16_t{7});
    for (const char letter : {'/', 's', 't', 'r', 'e', 'a', 'm'}) put(letter);
    for (const double value : {0.5, 1.0, 2.0, 3.0}) put(value);
    Eigen::VectorXd values(3);
    toolbox::Stamp stamp;
    for (int k = 0; k < 3000; ++k, usleep(10)) {
        stranger.say_anything(port, head.number, message);
        reader->take(values, stamp);
        writer->write(Eigen::Vector2d(k, 1));
    }
    // And who begins anew and says something right is heard.
    check(agree(100), "streams do not answer after what was said");
    bool is_heard = false;
    for (std::uint64_t k = 1; k < 3000 && !is_heard; ++k, usleep(1000)) {
        stranger.say(port, {Kind::news, head.number, k + 2, k}, message);
        is_heard = reader->take(values, stamp) == toolbox::Taken::message &&
                   values == Eigen::Vector3d(1, 2, 3) && stamp.time == 0.5;
    }
    check(is_heard, "a right message is not heard after the others");
    streams.close();
}

} // namespace
} // namespace bf::udp::test

int main(int argc, char** argv) {
    using namespace bf::udp::test;
    const double seconds = argc > 1 ? std::atof(argv[1]) : 5;
    std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
    const auto key = std::filesystem::temp_directory_path() / ("bf_fuzz_" + std::to_string(getpid()));
    std::ofstream(key) << "0123456789abcdef\n";
    chmod(key.c_str(), 0600);
    const double end = bf::middleware::now() + seconds;
    std::uint64_t tried = 0;
    for (; tried < 3 || bf::middleware::now() < end; ++seed, ++tried) {
        std::fprintf(stderr, "\rpackets of seed %llu", static_cast<unsigned long long>(seed));
        try_server(key, seed);
        try_controller(key, seed);
        try_streams(key, seed);
    }
    std::filesystem::remove(key);
    std::fprintf(stderr, "\n");
    std::printf("%llu seeds, some 9000 datagrams each\n", static_cast<unsigned long long>(tried));
}
