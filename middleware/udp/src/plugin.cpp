// The plugin Udp.
#include "bf/core/registry.hpp"
#include "bf/udp/robot.hpp"
#include "streams.hpp"

namespace bf::udp {

namespace {

class Robot final : public middleware::RemoteRobot {
  public:
    explicit Robot(const Arguments& arguments) : RemoteRobot(arguments) {
        if (auto wrong = wrong_address(address); !wrong.empty()) problem("argument 'address': " + wrong);
    }
    Argument<std::string> address{
        this,
        "address",
        {.initial = "9000", .doc = "where it is served: PORT of this computer, or HOST:PORT"}};
    Argument<std::string> key{
        this,
        "key",
        {.initial = "robot.key", .doc = "file with the key that its server has, too", .is_secret = true}};

  private:
    std::unique_ptr<middleware::RobotLink> make_link() const override {
        return udp::make_link(address, path_of(*key));
    }
};

class StreamsBlock final : public Block {
  public:
    explicit StreamsBlock(const Arguments& arguments) : Block(arguments) {
        for (const auto& wanted : *peers)
            if (auto wrong = wrong_address(wanted); !wrong.empty()) problem("argument 'peers': " + wrong);
        if (auto wrong = wrong_address(address, true); !wrong.empty())
            problem("argument 'address': " + wrong);
    }
    Argument<std::string> address{
        this,
        "address",
        {.initial = "9001",
         .doc = "of this program: PORT, for programs of this computer alone, or HOST:PORT"}};
    Argument<std::vector<std::string>> peers{
        this, "peers", {.doc = "addresses of other programs; those that name this one need not be named"}};
    Argument<std::string> key{this,
                              "key",
                              {.initial = "streams.key",
                               .doc = "file with the key that all of them have; made where it is not there",
                               .is_secret = true}};
    Provides<toolbox::StreamNetwork> network{this, [this]() -> std::shared_ptr<const toolbox::StreamNetwork> {
                                                 return std::make_shared<Streams>(address, peers,
                                                                                  path_of(*key));
                                             }};
    Output<double> received{this, "received", {.doc = "messages so far that came, late ones among them"}};
    Output<double> lost{this, "lost", {.doc = "messages so far that did not come"}};
    Output<double> late{
        this, "late", {.doc = "messages so far that came after newer ones, which are left out"}};
    Output<double> duplicates{
        this, "duplicates", {.doc = "messages so far that came again, which are left out"}};
    Output<double> rejected{
        this, "rejected", {.doc = "datagrams so far without the key, or of another time"}};

    void start(Now at) const override { connection(at).start(); }
    void stop(Now at) const noexcept override { connection(at).close(); }
    Status output(Now at, Out out) const noexcept override {
        const auto counts = connection(at).counts();
        out[received] = static_cast<double>(counts.received);
        out[lost] = static_cast<double>(counts.lost);
        out[late] = static_cast<double>(counts.late);
        out[duplicates] = static_cast<double>(counts.duplicates);
        out[rejected] = static_cast<double>(counts.rejected);
        return ok;
    }

  private:
    StreamsConnection& connection(Now at) const { return static_cast<StreamsConnection&>(at[network]); }
};

} // namespace

} // namespace bf::udp

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("robot").add<bf::udp::Robot>(
        "Robot",
        "A robot that a program on this or another computer serves over UDP, such as `bf serve MODEL --udp "
        "PORT --key FILE`. It is what SharedMemory/Robot is, apart from the way: what is lost of states and "
        "commands is sent again after 5 ms, while the newest counts, and messages that are lost, late or of "
        "others are counted. Every datagram carries a code of its content (HMAC-SHA-256) that takes the key "
        "and a number of this connection; it is not encrypted. Ages are counted from when a state came. "
        "Errors: those of SharedMemory/Robot; another key; a server that is silent for a second.");
    library.group("streams").add<bf::udp::StreamsBlock>(
        "Streams",
        "Streams among programs on one or several computers, over UDP, for StreamRead and StreamWrite in its "
        "subsystem and below. Every message goes to every peer, once: what is lost is counted, what comes "
        "after a newer one is left out. A stream has one writer, until it has ended or was not heard for a "
        "second. Whoever has the key may send; datagrams carry codes as those of Robot do, and what was "
        "recorded and is sent again moves nothing. Its time is that of the system, s since 1970. A stream "
        "has up to 7375 elements, and one reader in a program. Errors: an address that others use, a key "
        "file that others may read.");
}
