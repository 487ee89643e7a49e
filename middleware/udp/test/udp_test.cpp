// Robots over UDP, on good ways and bad ones.
#include "bad_way.hpp"
#include "bf/udp/robot.hpp"
#include "cycles.hpp"
#include "heap.hpp"
#include "packet.hpp"
#include "served.hpp"

#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

namespace bf::udp::test {
namespace {

using middleware::HostOptions;
using middleware::test::controller;
using middleware::test::icub;
using middleware::test::icub_world;
using middleware::test::seen;
using middleware::test::wires;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string diagram(const std::string& blocks, const std::string& connections = "") {
    return middleware::test::diagram(blocks, connections, "Udp");
}
std::string icub_at(int port, const std::string& settings = "", const std::string& key = key_file()) {
    return "  world: {block: Udp/Robot, period: 0.001, address: \"'" + std::to_string(port) +
           "'\", key: \"'" + key + "'\"" + settings + "}\n";
}

class Served : public middleware::test::Served {
  public:
    Served(int port, HostOptions options = {})
        : middleware::test::Served(make_end(std::to_string(port), key_file()), diagram(icub + icub_world),
                                   std::move(options)) {}
};

} // namespace

/// HMAC-SHA-256, from Python's hmac module: the first half is the code.
TEST(Packet, CarriesACodeThatTakesTheKey) {
    const Key key(key_file(), false), other(key_file("other"), false);
    std::vector<std::byte> datagram;
    const std::string text = "content";
    key.seal({Kind::state, 5, 6, 7}, bytes_of(text), datagram);
    std::string shown;
    for (std::size_t i = datagram.size() - Key::code_bytes; i < datagram.size(); ++i) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned>(datagram[i]));
        shown += digits;
    }
    const std::string head = R"(struct.pack("<IIQQQ", 0x31554642, 4, 5, 6, 7))";
    const std::string script = "import hmac, struct; print(hmac.new(b\"good-0123456789abcdef\", " + head +
                               " + b\"content\", \"sha256\").hexdigest()[:32])";
    FILE* python = popen(("python3 -c '" + script + "'").c_str(), "r");
    char line[64] = "";
    ASSERT_TRUE(fgets(line, sizeof line, python));
    pclose(python);
    EXPECT_EQ(shown + "\n", line);

    Head found;
    const auto content = key.open(datagram, found);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(content.data()), content.size()), text);
    EXPECT_EQ(found.session, 5U);
    EXPECT_EQ(found.sequence, 6U);
    EXPECT_EQ(found.number, 7U);
    other.open(datagram, found);
    EXPECT_EQ(found.kind, Kind{}) << "another key";
    for (std::size_t i = 0; i < datagram.size(); ++i) {
        auto changed = datagram;
        changed[i] ^= std::byte{4};
        key.open(changed, found);
        ASSERT_EQ(found.kind, Kind{}) << "byte " << i << " was changed";
        key.open(std::span(datagram).first(i), found);
        ASSERT_EQ(found.kind, Kind{}) << "cut after " << i;
    }
}

/// A service of systemd runs as a user who owns no file, and finds its key where LoadCredential= has put it.
TEST(Key, IsTheOneThatTheServiceManagerGives) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("bf_credentials_" + std::to_string(getpid()));
    std::filesystem::create_directory(folder);
    const std::string there = folder / "given", named = folder / "package/given";
    std::filesystem::copy_file(key_file(), there);
    chmod(there.c_str(), 0440); // what systemd's access control list shows as the group's
    const auto is_good = [&](bool may_make) {
        std::vector<std::byte> datagram;
        Key(named, may_make).seal({Kind::here, 5, 6, 7}, {}, datagram);
        Head head;
        Key(key_file(), false).open(datagram, head);
        return head.kind == Kind::here;
    };
    setenv("CREDENTIALS_DIRECTORY", folder.c_str(), 1);
    EXPECT_TRUE(is_good(false));
    EXPECT_TRUE(is_good(true)) << "and none is made";
    std::ofstream(there, std::ios::app) << "!";
    try {
        is_good(false);
        ADD_FAILURE() << "a key of two lines";
    } catch (const std::runtime_error& error) {
        expect_contains(error.what(), "the key file " + there + " needs one line of 16 to 255 letters");
    }
    unsetenv("CREDENTIALS_DIRECTORY");
    try {
        is_good(false);
        ADD_FAILURE() << "no key";
    } catch (const std::runtime_error& error) {
        expect_contains(error.what(), "there is no key file " + named);
    }
    std::filesystem::remove_all(folder);
}

/// The oracle keeps all numbers that have come.
TEST(Arrivals, CountWhatIsLostLateAndDoubled) {
    std::mt19937 random(3);
    std::vector<std::uint64_t> way;
    for (std::uint64_t k = 5; k < 5000; ++k)
        for (unsigned copy = random() % 10 == 0 ? 0 : 1 + (random() % 8 == 0); copy > 0; --copy)
            way.push_back(k);
    for (std::size_t i = 0; i + 40 < way.size(); ++i) std::swap(way[i], way[i + random() % 40]);
    way.push_back(1); // older than the window
    Arrivals arrivals;
    std::set<std::uint64_t> known;
    std::uint64_t late = 1, duplicates = 0, newest = 0;
    for (const auto k : way) {
        const bool is_new = k != 1 && known.insert(k).second;
        ASSERT_EQ(arrivals.come(k), is_new) << k;
        duplicates += k != 1 && !is_new;
        late += is_new && k < newest;
        newest = std::max(newest, k);
    }
    const auto counts = arrivals.counts();
    EXPECT_EQ(counts.received, known.size());
    EXPECT_EQ(counts.lost, newest - known.size());
    EXPECT_EQ(counts.late, late);
    EXPECT_EQ(counts.duplicates, duplicates);
    EXPECT_GT(late, 100U);
    EXPECT_GT(duplicates, 100U);
    // What follows a long gap, and a session that is joined later.
    EXPECT_TRUE(arrivals.come(newest + 5000));
    EXPECT_EQ(arrivals.counts().lost, counts.lost + 4999);
    arrivals.begin(1000);
    EXPECT_TRUE(arrivals.come(1000));
    EXPECT_FALSE(arrivals.come(999)) << "it was sent before";
    EXPECT_FALSE(arrivals.come(1000));
    EXPECT_EQ(arrivals.counts().lost, counts.lost + 4999);
}

TEST(UdpRobot, IsTheServedOneBitForBit) {
    for (const Faults& faults : {Faults{}, Faults{0.1, 0, 0.01, 0.1}}) {
        const int port = free_port();
        Served served(port);
        served.run();
        BadWay way(port, faults);
        Running direct(diagram(icub + icub_world + controller("Torque"), wires));
        Running remote(diagram(icub + icub_at(way.port()) + controller("Torque"), wires));
        for (int k = 0; k < 40; ++k) {
            ASSERT_TRUE(direct.step()) << direct.simulation.failure();
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            for (const auto& signal : seen)
                ASSERT_EQ(remote.get(signal), direct.get(signal)) << signal << " in step " << k;
        }
        if (faults.loss > 0) {
            EXPECT_GT(way.lost, 0) << "the way was bad";
        }
        remote.simulation.stop();
        for (int i = 0; i < 3000 && served.host->gone() == 0; ++i) usleep(1000);
        EXPECT_EQ(served.host->gone(), 1) << "the last word is heard, or silence tells";
    }
}

TEST(UdpRobot, DoesTheLastStepOfAControllerThatLeaves) {
    const int port = free_port();
    Served served(port);
    middleware::test::expect_the_last_step_to_be_done(served, icub_at(port), "Udp");
}

TEST(UdpRobot, IsSeenAtTheTimesOfASlowerController) {
    for (const int ratio : {2, 5}) {
        const int port = free_port();
        Served served(port);
        served.run();
        BadWay way(port, {0.05, 0, 0.005, 0.05});
        middleware::test::expect_each_step_at_its_time(icub_at(way.port()), "Udp", ratio);
    }
}

/// The oracle is the same diagram with a world of its own.
TEST(UdpRobot, TakesGainsInTheStepThatGivesThem) {
    const std::string blocks =
        "  pid: {block: WholeBodyToolbox/SetLowLevelPID, P: [100 200 300], I: [0 0 0], D: [1 2 3]}\n"
        "  sine: {block: Sine, amplitude: [0.3 -0.2 0.1], frequency: 6, phase: 0.4}\n"
        "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n";
    for (int trial = 0; trial < 3; ++trial) {
        const int port = free_port();
        Served served(port);
        served.run();
        BadWay way(port, {0.3, 0, 0});
        Running direct(diagram(icub + icub_world + blocks, wires));
        Running remote(diagram(icub + icub_at(way.port()) + blocks, wires));
        for (int k = 0; k < 20; ++k) {
            ASSERT_TRUE(direct.step()) << direct.simulation.failure();
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            ASSERT_EQ(remote.get("world.s"), direct.get("world.s")) << "in step " << k;
        }
        served.end_run();
        toolbox::Gains given(3);
        ASSERT_TRUE(served.robot->read_gains(toolbox::Loop::position, given));
        EXPECT_EQ(given.P, Eigen::Vector3d(100, 200, 300));
        EXPECT_EQ(given.D, Eigen::Vector3d(1, 2, 3));
    }
}

/// The oracle is what the way has counted.
TEST(UdpRobot, CountsWhatBecomesOfDatagramsByTheClock) {
    const int port = free_port();
    HostOptions options;
    options.waits = false;
    options.watchdog = 0;
    Served served(port, options);
    ASSERT_TRUE(served.step());
    BadWay way(port, {0.1, 0, 0.01, 0.1});
    Running remote(diagram(icub + icub_at(way.port(), ", clock: own") + controller("Torque"), wires));
    for (int k = 0; k < 300; ++k) {
        ASSERT_TRUE(served.step());
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        usleep(1000);
    }
    const double lost = remote.scalar("world.lost"), duplicates = remote.scalar("world.duplicates"),
                 received = static_cast<double>(way.sent_back) - way.lost_back;
    // What is still underway, and what welcomed the controller, the way alone has counted.
    EXPECT_NEAR(lost, way.lost_back, 30);
    EXPECT_NEAR(duplicates, way.doubled_back, 30);
    EXPECT_GT(lost, 20);
    EXPECT_GT(duplicates, 10);
    EXPECT_GT(received, 200);
    EXPECT_GT(remote.scalar("world.late"), 50) << "many were overtaken";
    EXPECT_GT(remote.scalar("world.age"), 0);
    EXPECT_GT(remote.scalar("world.time"), 0.1) << "and most came";
}

TEST(UdpRobot, IsTakenBackFromASilentControllerOnABadWay) {
    const int port = free_port();
    HostOptions options;
    options.waits = false;
    options.watchdog = 0.1;
    Served served(port, options);
    ASSERT_TRUE(served.step());
    BadWay way(port, {0.1, 0, 0.01, 0.1});
    Running remote(diagram(icub + icub_at(way.port(), ", clock: own") + controller("Torque"), wires));
    const auto both = [&] { return served.step() && remote.step() && usleep(1000) == 0; };
    for (int k = 0; k < 3000 && served.robot->joint_in_other_mode(toolbox::ControlMode::torque) != -1; ++k) {
        ASSERT_TRUE(both()) << remote.simulation.failure();
    }
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::torque), -1) << "it is driven";
    // It hangs: its socket goes on to repeat what it said last.
    std::string events = served.events();
    for (int k = 0; k < 3000 && events != "came silent"; ++k, usleep(1000)) {
        ASSERT_TRUE(served.step());
        const auto more = served.events();
        events += more.empty() ? "" : " " + more;
    }
    EXPECT_EQ(events, "came silent");
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::position), -1);
    bool goes_on = true;
    for (int k = 0; k < 3000 && goes_on; ++k) goes_on = both();
    expect_contains(remote.simulation.failure(),
                    "its server has taken the joints back, since no command came for 0.1 s");
}

/// A server that is none of ours: it has the key, and answers as it likes.
class Pretender {
  public:
    Pretender() : socket_(local_socket()) {
        description_.period = 0.001;
        description_.joints = {"a"};
        for (auto* limits : {&description_.position_min, &description_.position_max,
                             &description_.velocity_min, &description_.velocity_max})
            limits->setZero(1);
        description_.process = 42;
        description_.measurements = (1U << middleware::measurement_count) - 1;
    }
    ~Pretender() {
        goes_on_ = false;
        if (thread_.joinable()) thread_.join();
        close(socket_);
    }
    int port() const { return port_of(socket_); }
    /// Answers each greeting by `answer`, and each millisecond by `states` datagrams.
    void run(std::function<void(Pretender&)> answer, std::function<void(Pretender&)> often = nullptr) {
        thread_ = std::thread([this, answer = std::move(answer), often = std::move(often)] {
            while (goes_on_) {
                std::vector<std::byte> bytes(65536);
                sockaddr_in from{};
                socklen_t size = sizeof from;
                const auto count = recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                            reinterpret_cast<sockaddr*>(&from), &size);
                Head head;
                if (count >= 0) key_.open(std::span(bytes).first(static_cast<std::size_t>(count)), head);
                if (count >= 0 && head.kind == Kind::hello) {
                    session_ = head.number;
                    to_ = ntohs(from.sin_port);
                    answer(*this);
                }
                if (to_ != 0 && often) often(*this);
                usleep(1000);
            }
        });
    }
    void send(Kind kind, std::span<const std::byte> content, std::uint64_t number, bool is_old = false) {
        std::vector<std::byte> bytes;
        key_.seal({kind, session_, kind == Kind::welcome ? 0 : ++sequence_, number}, content, bytes);
        if (is_old) bytes[3] = std::byte{'0'};
        send_to(socket_, to_, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    }
    void has_gains() { description_.has_position_gains = true; }
    void gains(double value) {
        const middleware::RobotLayout at(description_);
        std::vector<double> values(static_cast<std::size_t>(at.settings_size()), value);
        values[middleware::RobotLayout::of] = values[middleware::RobotLayout::count] = 0;
        send(Kind::gains, bytes_of(values), ++number_);
    }
    void welcome() { send(Kind::welcome, bytes_of(description_.text()), 7); }
    void state(std::size_t size) {
        const std::vector<double> values(size);
        send(Kind::state, bytes_of(values), ++number_);
    }
    std::size_t state_size() const {
        return static_cast<std::size_t>(middleware::RobotLayout(description_).state_size());
    }

  private:
    const Key key_{key_file(), false};
    const int socket_;
    middleware::RobotDescription description_;
    std::uint64_t session_ = 0, sequence_ = 0, number_ = 0;
    int to_ = 0;
    std::atomic<bool> goes_on_{true};
    std::thread thread_;
};

std::string driven(int port, const std::string& settings = "") {
    return diagram(icub_at(port, ", joints: \"{'a'}\"" + settings));
}

/// Gains come in datagrams of their own, the first of which may be lost.
TEST(UdpRobot, KnowsTheGainsOfTheRobotInItsFirstStep) {
    const std::string read = "  read: {block: WholeBodyToolbox/GetLowLevelPIDs}\n";
    const auto at = [&](int port, const std::string& settings) {
        return diagram(icub_at(port, ", joints: \"{'a'}\", clock: own" + settings) + read);
    };
    Pretender late, silent;
    for (auto* robot : {&late, &silent}) robot->has_gains();
    int states = 0;
    late.run([](Pretender& p) { p.welcome(); },
             [&](Pretender& p) {
                 p.state(p.state_size());
                 if (++states > 50) p.gains(7);
             });
    Running remote(at(late.port(), ""));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    EXPECT_EQ(remote.scalar("read.P"), 7);
    silent.run([](Pretender& p) { p.welcome(); }, [](Pretender& p) { p.state(p.state_size()); });
    expect_contains(refusal(at(silent.port(), ", start_timeout: 0.3")), "it is there, but sends no gains");
}

TEST(UdpRobot, SaysWhenItsServerSpeaksAnotherVersionOrDoesNotFit) {
    const std::string quick = ", start_timeout: 0.3";
    {
        Pretender old;
        old.run([](Pretender& p) { p.send(Kind::busy, {}, 0, true); });
        expect_contains(
            refusal(driven(old.port(), quick)),
            "it speaks another version, BFU0, and this program BFU1; use the same BlockFactory on "
            "both sides");
    }
    {
        Pretender wrong;
        wrong.run([](Pretender& p) { p.send(Kind::welcome, bytes_of(std::string("[[[")), 7); });
        expect_contains(refusal(driven(wrong.port(), quick)), "what it says of itself cannot be read");
    }
    {
        Pretender wrong;
        wrong.run([](Pretender& p) { p.welcome(); }, [](Pretender& p) { p.state(p.state_size() - 1); });
        const auto text = refusal(driven(wrong.port(), quick));
        expect_contains(text, "sends states of ");
    }
    {
        Pretender wrong;
        std::atomic<bool> is_wrong{false};
        wrong.run([](Pretender& p) { p.welcome(); },
                  [&](Pretender& p) { p.state(p.state_size() + (is_wrong ? 3 : 0)); });
        Running remote(driven(wrong.port(), ", clock: own"));
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        is_wrong = true;
        for (int k = 0; k < 3000 && remote.step(); ++k) usleep(1000);
        expect_contains(remote.simulation.failure(),
                        "its server (process 42) sends states of " + std::to_string(wrong.state_size() + 3) +
                            " numbers, and has described states of " + std::to_string(wrong.state_size()));
    }
    // And a server answers whoever greets it in another version.
    const int port = free_port(), stranger = local_socket();
    Served served(port);
    std::string greeting(100, 'x');
    greeting.replace(0, 4, "BFU7");
    send_to(stranger, port, greeting);
    char answer[200] = "";
    pollfd waits{stranger, POLLIN, 0};
    ASSERT_EQ(poll(&waits, 1, 5000), 1);
    EXPECT_GT(recv(stranger, answer, sizeof answer, 0), 4);
    EXPECT_EQ(std::string(answer, 4), "BFU1");
    close(stranger);
}

TEST(UdpRobot, TakesTheNewestStateFromAServerThatFloods) {
    Pretender flood;
    flood.run([](Pretender& p) { p.welcome(); },
              [](Pretender& p) {
                  for (int k = 0; k < 200; ++k) p.state(p.state_size());
              });
    Running remote(driven(flood.port(), ", clock: own, timeout: 5"));
    for (int k = 0; k < 100; ++k, usleep(1000)) {
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    }
    EXPECT_EQ(remote.scalar("world.rejected"), 0);
    EXPECT_LT(remote.scalar("world.age"), 1) << "newer ones have come";
}

TEST(UdpRobot, EndsTheRunWhereItsTimeGoesBack) {
    const int port = free_port();
    middleware::test::expect_end_where_time_goes_back(make_end(std::to_string(port), key_file()),
                                                      icub_at(port, ", joints: \"{'a'}\""), "Udp");
}

TEST(UdpRobot, EndsTheRunWhenItsServerStandsStillOrIsAnotherOne) {
    const int port = free_port();
    auto served = std::make_unique<Served>(port);
    served->run();
    {
        Running remote(diagram(icub + icub_at(port, ", timeout: 0.1") + controller("Torque"), wires));
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        served->end_run(); // its socket goes on
        while (remote.step()) continue;
        expect_contains(remote.simulation.failure(), "(UDP): no state for 0.");
    }
    served = nullptr;
    served = std::make_unique<Served>(port);
    served->run();
    Running remote(diagram(icub + icub_at(port, ", timeout: 20") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    served = nullptr;
    served = std::make_unique<Served>(port);
    served->run();
    while (remote.step()) continue;
    expect_contains(remote.simulation.failure(), "has ended, or nothing of it has come for 1 s");
    EXPECT_EQ(served->events(), "") << "the new one is not driven by who drove the old one";
    Running next(diagram(icub + icub_at(port) + controller("Torque"), wires));
    EXPECT_TRUE(next.step()) << next.simulation.failure();
}

TEST(UdpRobot, LeavesNothingOpen) {
    const auto descriptors = [] {
        int count = 0;
        for (int i = 0; i < 1024; ++i) count += fcntl(i, F_GETFD) >= 0;
        return count;
    };
    const int before = descriptors(), port = free_port();
    middleware::RobotDescription d;
    d.period = 1;
    for (int k = 0; k < 1000; ++k) {
        auto end = make_end(std::to_string(port), key_file());
        end->start(d);
        auto link = make_link(std::to_string(port), key_file());
        link->start(5);
        link->stop();
    }
    EXPECT_EQ(descriptors(), before);
}

TEST(UdpRobot, TakesNothingFromTheHeapInAStep) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP();
    const int port = free_port();
    Served served(port);
    served.run();
    Running remote(diagram(icub + icub_at(port) + controller("Torque"), wires));
    for (int k = 0; k < 10; ++k) {
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(remote.step());
        if (k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
}

TEST(UdpRobot, EndsTheRunWhenTheWayIsCut) {
    const int port = free_port();
    Served served(port);
    served.run();
    BadWay way(port, {});
    Running remote(diagram(icub + icub_at(way.port(), ", timeout: 20") + controller("Torque"), wires));
    for (int k = 0; k < 2; ++k) { // the second one tells that the first one was heard
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    }
    way.is_cut = true;
    while (remote.step()) continue;
    expect_contains(remote.simulation.failure(),
                    "robot at " + std::to_string(way.port()) + " (UDP): its server (process " +
                        std::to_string(getpid()) + ") has ended, or nothing of it has come for 1 s");
    for (int i = 0; i < 5000 && served.host->gone() == 0; ++i) usleep(1000);
    EXPECT_EQ(served.events(), "came died") << "and the robot takes its joints back";
    served.end_run();
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::position), -1);
}

TEST(UdpRobot, KnowsItsOwnByTheKey) {
    const int port = free_port();
    const std::string here = "world: robot at " + std::to_string(port) + " (UDP): ";
    const std::string quick = ", start_timeout: 0.2";
    expect_contains(
        refusal(diagram(icub + icub_at(port, quick))),
        here + "nobody answers within 0.2 s; look whether it is served there, e.g. by bf serve MODEL --udp " +
            std::to_string(port) + " --key FILE, and whether the key is the same on both sides");
    Served served(port);
    served.run();
    expect_contains(refusal(diagram(icub + icub_at(port, quick, key_file("other")))),
                    here + "nobody answers within");
    EXPECT_GT(served.end->counts().rejected, 0U);
    expect_contains(refusal(diagram(icub + icub_at(port, quick, "/nowhere/key"))),
                    here + "there is no key file /nowhere/key; copy that of the other side");
    const std::string file = key_file("short");
    std::ofstream(file) << "short\n";
    const std::string wrong =
        "the key file " + file + " needs one line of 16 to 255 letters, digits and -._~; ";
    expect_contains(refusal(diagram(icub + icub_at(port, quick, file))),
                    here + wrong + "copy that of the other side");
    try {
        make_end(std::to_string(free_port()), file)->start({});
        ADD_FAILURE() << "a short key";
    } catch (const std::exception& error) {
        expect_contains(error.what(), wrong + "remove the file, and one is made");
    }
    const auto refused = [&](const std::string& address) {
        return refusal(
            diagram(icub + "  w: {block: Udp/Robot, period: 0.001, address: \"'" + address + "'\"}\n"));
    };
    expect_contains(refused("here:x"),
                    "argument 'address': 'here:x' is no address; write PORT, or HOST:PORT such as");
    expect_contains(refused("0"), "argument 'address': '0' has no port; write one from 1 to 65535");
    expect_contains(refusal(diagram(icub_at(port, ", joints: \"{'a', 'b', 'a'}\""))),
                    "argument 'joints' lists 'a' twice; list every joint once");
    Running first(diagram(icub + icub_at(port)));
    for (int k = 0; k < 3; ++k) {
        ASSERT_TRUE(first.step()) << first.simulation.failure();
    }
    expect_contains(refusal(diagram(icub + icub_at(port, quick))), here + "another program (at 127.0.0.1:");
    try {
        make_end(std::to_string(port), key_file())->start({});
        ADD_FAILURE() << "two at one port";
    } catch (const std::exception& error) {
        expect_contains(error.what(), "cannot listen at 127.0.0.1:" + std::to_string(port) +
                                          ": Address already in use; choose another port");
    }
}

/// Neither noise nor what was recorded on the way moves a joint.
TEST(UdpRobot, IsNotMovedByNoiseOrByWhatWasRecorded) {
    const int port = free_port();
    HostOptions options;
    options.waits = false;
    options.watchdog = 0;
    Served served(port, options);
    ASSERT_TRUE(served.step());
    BadWay way(port, {});
    {
        Running remote(diagram(icub + icub_at(way.port(), ", clock: own") + controller("Torque"), wires));
        for (int k = 0; k < 20; ++k) {
            ASSERT_TRUE(remote.step());
            ASSERT_TRUE(served.step());
            usleep(500);
        }
    }
    for (int i = 0; i < 3000 && served.host->gone() == 0; ++i) {
        ASSERT_TRUE(served.step());
        usleep(1000);
    }
    EXPECT_EQ(served.events(), "came left");
    const int stranger = local_socket();
    const auto before = served.end->counts().rejected;
    std::mt19937 random(1);
    for (int k = 0; k < 2000; ++k) {
        std::string noise(random() % 1500, '\0');
        for (auto& byte : noise) byte = static_cast<char>(random());
        send_to(stranger, port, noise);
    }
    for (const auto& recorded : way.to_server()) send_to(stranger, port, recorded);
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(served.step());
        usleep(1000);
    }
    EXPECT_GT(served.end->counts().rejected, before);
    EXPECT_EQ(served.events(), "") << "nobody drives it";
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::position), -1);
    close(stranger);
    Running next(diagram(icub + icub_at(port, ", clock: own")));
    EXPECT_TRUE(next.step()) << "and whoever has the key comes in: " << next.simulation.failure();
}

TEST(UdpRobot, LeavesNothingBehindHoweverOftenBothSidesStart) {
    middleware::test::expect_no_leak([] {
        Served served(27450);
        served.run();
        Running remote(diagram(icub + icub_at(27450) + controller("Torque"), wires));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        }
    });
}

} // namespace bf::udp::test
