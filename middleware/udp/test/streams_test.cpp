// Streams over UDP, on good ways and bad ones.
#include "bad_way.hpp"
#include "cycles.hpp"
#include "running.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::udp::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string streams(int port, const std::string& peers, const std::string& key = key_file()) {
    return "  network: {block: Udp/Streams, address: \"'" + std::to_string(port) + "'\", peers: \"{" + peers +
           "}\", key: \"'" + key + "'\"}\n";
}
std::string peer(int port) { return "'" + std::to_string(port) + "'"; }
std::string sending(int port, const std::string& peers, int size, const std::string& settings = "") {
    return "model: m\nplugins: [Udp]\nstep: 0.01\ninputs: {u: {shape: " + std::to_string(size) +
           "}}\nblocks:\n" + streams(port, peers) + "  x: {block: WholeBodyToolbox/StreamWrite" + settings +
           "}\nconnections: {u: x}\n";
}
std::string reading(int port, const std::string& peers, const std::string& settings,
                    const std::string& key = key_file()) {
    return "model: m\nplugins: [Udp]\nstep: 0.01\nblocks:\n" + streams(port, peers, key) +
           "  x: {block: WholeBodyToolbox/StreamRead, autoconnect: false" + settings + "}\n";
}
bool comes(Running& reader, double wanted) {
    for (int k = 0; k < 2000; ++k) {
        if (!reader.step()) return false;
        if (reader.get("x.y")(0) == wanted) return true;
        usleep(1000);
    }
    return false;
}
bool send(Running& writer, double k) {
    writer.set("u", Matrix::Constant(1, 1, k));
    return writer.step();
}
/// Whoever has just begun is told what he hears until he does.
void meet(Running& writer, Running& reader) {
    for (int k = 0; k < 5000 && reader.step() && reader.get("x.y")(0) != -1; ++k, usleep(1000))
        ASSERT_TRUE(send(writer, -1));
    ASSERT_EQ(reader.get("x.y")(0), -1);
}

} // namespace

TEST(UdpStreams, CoupleTwoDiagrams) {
    const int a = free_port(), b = free_port();
    Running reader(reading(a, "", ", size: 2"));
    Running writer(sending(b, peer(a), 2, ", autoconnect: true"));
    for (int k = 1; k <= 3; ++k) {
        writer.set("u", Eigen::Vector2d(k, -k));
        ASSERT_TRUE(writer.step());
        ASSERT_TRUE(comes(reader, k));
        EXPECT_EQ(reader.get("x.y"), Matrix(Eigen::Vector2d(k, -k)));
        EXPECT_EQ(reader.get("x.timestamp")(0), k);
    }
    EXPECT_EQ(reader.scalar("network.received"), 3);
    EXPECT_EQ(reader.scalar("network.lost"), 0);
    // Another program of the same stream begins anew.
    writer.simulation.stop();
    Running next(sending(b, peer(a), 2, ", autoconnect: true"));
    next.set("u", Eigen::Vector2d(9, 9));
    ASSERT_TRUE(next.step());
    ASSERT_TRUE(comes(reader, 9));
}

TEST(UdpStreams, CountWhatIsLostAndLate) {
    const int a = free_port(), b = free_port();
    Running reader(reading(a, "", ""));
    BadWay way(a, {0.1, 0, 0.01, 0.1});
    Running writer(sending(b, peer(way.port()), 1));
    double newest = 0;
    for (int k = 1; k <= 300; ++k) {
        writer.set("u", Matrix::Constant(1, 1, k));
        ASSERT_TRUE(writer.step());
        ASSERT_TRUE(reader.step());
        EXPECT_GE(reader.get("x.y")(0), newest) << "never back";
        newest = reader.get("x.y")(0);
        usleep(1000);
    }
    EXPECT_GT(newest, 100);
    EXPECT_GT(reader.scalar("network.lost"), 5);
    EXPECT_GT(reader.scalar("network.late"), 20);
    EXPECT_GT(reader.scalar("network.duplicates"), 5);
    EXPECT_NEAR(reader.scalar("network.received") + reader.scalar("network.lost"),
                reader.get("x.timestamp")(0), 10)
        << "all that were sent since the first that came";
    // A program that follows it is heard, and what was recorded of the first one is not.
    const auto recorded = way.to_server();
    writer.simulation.stop();
    Running next(sending(free_port(), peer(a), 1));
    for (int k = 0; k < 3000 && reader.get("x.y")(0) != 1000; ++k, usleep(1000)) {
        next.set("u", Matrix::Constant(1, 1, 1000));
        ASSERT_TRUE(next.step());
        ASSERT_TRUE(reader.step());
    }
    ASSERT_EQ(reader.get("x.y")(0), 1000);
    const double before = reader.scalar("network.rejected");
    const int stranger = local_socket();
    for (const auto& datagram : recorded) send_to(stranger, a, datagram);
    close(stranger);
    for (int k = 0; k < 3000 && reader.scalar("network.rejected") < before + 100; ++k, usleep(1000)) {
        ASSERT_TRUE(reader.step());
        ASSERT_EQ(reader.get("x.y")(0), 1000);
    }
    EXPECT_GE(reader.scalar("network.rejected"), before + 100);
}

TEST(UdpStreams, AreNotStarvedByTheirFirstDatagramSentAgainAndAgain) {
    const int a = free_port(), b = free_port();
    Running reader(reading(a, "", ""));
    BadWay way(a, {.repeats_first = true});
    Running writer(sending(b, peer(way.port()), 1));
    meet(writer, reader);
    for (int k = 1; k <= 100; ++k) ASSERT_TRUE(send(writer, k) && comes(reader, k)) << k;
    EXPECT_EQ(reader.scalar("network.lost"), 0);
    const int before = way.sent_back;
    usleep(300'000);
    EXPECT_LT(way.sent_back, before + 300) << "each answer has it sent again, and is answered seldom";
}

TEST(UdpStreams, GoToWhoListensNowWhateverWasRecordedOfWhoDidBefore) {
    const int a = free_port();
    Running writer(sending(a, "", 1));
    BadWay way(a, {});
    const auto listening = [&] { return reading(free_port(), peer(way.port()), ""); };
    {
        Running before(listening());
        meet(writer, before);
        for (int k = 1; k <= 20; ++k) ASSERT_TRUE(send(writer, k) && comes(before, k)) << k;
    }
    const auto recorded = way.to_server();
    ASSERT_GE(recorded.size(), 2u);
    Running reader(listening());
    meet(writer, reader);
    for (int k = 21; k <= 60; ++k) {
        ASSERT_TRUE(send(writer, k) && comes(reader, k)) << k;
        for (const auto& datagram : recorded) way.send_again(datagram);
    }
    EXPECT_EQ(reader.scalar("network.lost"), 0);
}

/// A datagram that was kept back and comes when another program writes the stream.
TEST(UdpStreams, AreNotTakenOverByAMessageThatWasKeptBack) {
    const int a = free_port();
    Running reader(reading(a, "", ""));
    BadWay way(a, {});
    std::vector<std::string> kept;
    {
        Running before(sending(free_port(), peer(way.port()), 1, ", autoconnect: true"));
        way.is_cut = true;
        const auto begin = way.to_server().size();
        for (int k = 1; k <= 5; ++k) {
            ASSERT_TRUE(send(before, -k));
            usleep(20'000);
        }
        const auto all = way.to_server();
        kept.assign(all.begin() + static_cast<std::ptrdiff_t>(begin), all.end());
        ASSERT_GE(kept.size(), 5u);
    }
    Running writer(sending(free_port(), peer(a), 1, ", autoconnect: true"));
    for (int k = 1; k <= 50; ++k) {
        ASSERT_TRUE(send(writer, k) && comes(reader, k)) << k << ": " << reader.get("x.y")(0);
        for (const auto& datagram : kept) way.send_again(datagram);
        usleep(2000);
        ASSERT_TRUE(reader.step());
        ASSERT_EQ(reader.get("x.y")(0), k);
    }
    EXPECT_GT(reader.scalar("network.rejected"), 0);
}

TEST(UdpStreams, HaveOneWriterAndTheNextOneAtOnceWhenThatHasEnded) {
    const int a = free_port();
    Running reader(reading(a, "", ""));
    bool is_heard = false;
    for (int tries = 0; tries < 5 && !is_heard; ++tries) { // a machine may stand still for a second
        Running first(sending(free_port(), peer(a), 1));
        meet(first, reader);
        BadWay way(a, {});
        Running second(sending(free_port(), peer(way.port()), 1, ", autoconnect: true"));
        for (int k = 1; k <= 20; ++k) {
            ASSERT_TRUE(send(second, 100 + k) && send(first, k) && comes(reader, k)) << reader.get("x.y")(0);
            usleep(5000);
            ASSERT_TRUE(reader.step());
            ASSERT_EQ(reader.get("x.y")(0), k);
        }
        first.simulation.stop();
        usleep(50'000);
        for (const auto& datagram : way.to_server()) way.send_again(datagram);
        usleep(50'000);
        ASSERT_TRUE(reader.step());
        ASSERT_EQ(reader.get("x.y")(0), 20) << "what was left out is no message when it is sent again";
        is_heard = send(second, 7) && comes(reader, 7);
    }
    EXPECT_TRUE(is_heard);
}

/// Who was killed says no word, and somebody else sends again what he said when he lived.
TEST(UdpStreams, GoOverToTheNextWriterThoughTheDeadOneIsHeardAgainAndAgain) {
    const int a = free_port();
    Running reader(reading(a, "", ""));
    BadWay way(a, {});
    std::vector<std::string> recorded;
    {
        Running killed(sending(free_port(), peer(way.port()), 1));
        meet(killed, reader);
        way.is_cut = true; // and nothing of its end is heard
        recorded = way.to_server();
    }
    Running next(sending(free_port(), peer(a), 1));
    for (int k = 0; k < 500 && reader.get("x.y")(0) != 7; ++k, usleep(10'000)) {
        for (const auto& datagram : recorded) way.send_again(datagram);
        ASSERT_TRUE(send(next, 7) && reader.step());
    }
    EXPECT_EQ(reader.get("x.y")(0), 7);
}

TEST(UdpStreams, SayWhoSentWhatIsNotFinite) {
    const int a = free_port(), b = free_port();
    Running reader(reading(a, "", ", wait_for_data: true, timeout: 0.05"));
    EXPECT_FALSE(reader.step());
    EXPECT_EQ(reader.simulation.failure(), "x: stream '/stream' (UDP): no message came within the timeout of "
                                           "0.05 s; look whether its sender runs, or raise timeout");
    Running wrong(reading(free_port(), peer(b), ", wait_for_data: true, timeout: 20"));
    Running writer(sending(b, "", 1, ", autoconnect: true"));
    writer.set("u", Matrix::Constant(1, 1, std::nan("")));
    ASSERT_TRUE(writer.step());
    EXPECT_FALSE(wrong.step());
    EXPECT_EQ(wrong.simulation.failure(),
              "x: stream '/stream' (UDP from 127.0.0.1:" + std::to_string(b) +
                  "): message 1 brings nan as element 1 of 1; look at what its sender computes");
}

TEST(UdpStreams, RefuseWhatDoesNotFit) {
    const int a = free_port(), b = free_port();
    Running reader(reading(a, "", ", size: 2"));
    Running writer(sending(b, peer(a), 3, ", autoconnect: true"));
    ASSERT_TRUE(writer.step());
    bool goes_on = true;
    for (int k = 0; k < 2000 && goes_on; ++k, usleep(1000)) goes_on = reader.step();
    EXPECT_EQ(reader.simulation.failure(), "x: a message has 3 elements, but argument 'size' is 2");
    const auto alone = sending(free_port(), peer(free_port()), 1, ", autoconnect: true");
    expect_contains(refusal(alone), "x: nobody receives '/stream'; start the other program first");
    Running stranger(reading(free_port(), peer(b), ", size: 3", key_file("other")));
    for (int k = 0; k < 200; ++k, usleep(1000)) {
        ASSERT_TRUE(writer.step());
        ASSERT_TRUE(stranger.step());
    }
    EXPECT_EQ(stranger.scalar("network.received"), 0);
    EXPECT_GT(writer.scalar("network.rejected"), 0);
    expect_contains(refusal("model: m\nplugins: [Udp]\nstep: 0.01\nblocks:\n" + streams(free_port(), "") +
                            "  x: {block: WholeBodyToolbox/SimulatorSynchronizer}\n"),
                    "x: the simulator '/clock/rpc' cannot be stepped over UDP; use LocalStreams for that");
}

TEST(UdpStreams, LeaveNothingBehindHoweverOftenTheyStart) {
    const int a = free_port(), b = free_port();
    middleware::test::expect_no_leak([&] {
        Running reader(reading(a, "", ""));
        Running writer(sending(b, peer(a), 1, ", autoconnect: true"));
        writer.set("u", Matrix::Constant(1, 1, 5));
        ASSERT_TRUE(writer.step());
        ASSERT_TRUE(comes(reader, 5));
    });
}

} // namespace bf::udp::test
