// Pages of a run that another program makes.
#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"
#include "bf/realtime/server.hpp"
#include "bf/service/server.hpp"
#include "bf/service/service.hpp"
#include "folder.hpp"

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

namespace {

namespace fs = std::filesystem;
namespace asio = boost::asio;
using Json = nlohmann::json;
using Socket = boost::beast::websocket::stream<asio::ip::tcp::socket>;

constexpr const char* text =
    "model: served\n"
    "step: 0.001\n"
    "variables:\n"
    "  k: {value: 0.3, maximum: 5}\n"
    "blocks:\n"
    "  sine: {block: Sine, frequency: 7}\n"
    "  error: {block: Sum, signs: +-}\n"
    "  control: {block: Gain, K: k}\n"
    "  plant: {block: DiscreteIntegrator}\n"
    "  count: {block: Constant, value: \"int16([1 -2; 3 4])\"}\n"
    "  wide: {block: Gain, K: \"ones(500, 1)\"}\n"
    "connections: {sine: [error.u1, wide], plant: error.u2, error: control, control: plant}\n";

/// Runs the model against the clock and serves it, until it is destroyed or has made its steps.
class Program {
  public:
    explicit Program(const fs::path& file, std::int64_t steps, bool is_controlled = true, bool waits = false,
                     const std::string& where = "0", const std::string& token = {})
        : model_(bf::load(file)), run_(model_.diagram), runner_(run_, options(waits)),
          server_(
              std::in_place, run_, run_.signals(), runner_.access(),
              bf::realtime::ServerOptions{.where = where, .token = token, .is_controlled = is_controlled}),
          control_(bf::find(run_.signals(), "control")) {
        outputs.reserve(static_cast<std::size_t>(steps));
        runner_.add_observer(*server_);
        runner_.add_observer(seen_);
        thread_ = std::thread([this, steps] {
            runner_.run(static_cast<double>(steps) * 0.001, [this](const auto&) { return !ends_; });
        });
    }
    ~Program() { end(); }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    void wait() {
        if (thread_.joinable()) thread_.join();
    }
    /// As programs end that are not killed.
    void say_goodbye(const std::string& failure, bool is_interrupted) {
        wait();
        server_->end(failure, is_interrupted);
    }
    void end() {
        ends_ = true;
        wait();
        server_.reset();
    }
    std::string address() const { return server_->address() + server_->token(); }
    const bf::realtime::Statistics& statistics() const { return runner_.statistics(); }

    std::vector<double> outputs; ///< of the controller, in each step

  private:
    static bf::realtime::RunnerOptions options(bool waits) {
        bf::realtime::RunnerOptions options;
        options.waits = waits;
        options.thread.locks_memory = false;
        return options;
    }
    struct Seen final : bf::Run::Observer {
        explicit Seen(Program& p) : program(p) {}
        void observe(const bf::Run&) noexcept override { program.outputs.push_back(program.control_[0]); }
        Program& program;
    };

    const bf::LoadedModel model_;
    bf::Simulation run_;
    bf::realtime::Runner runner_;
    std::optional<bf::realtime::Server> server_;
    const bf::Quantity control_;
    Seen seen_{*this};
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

fs::path written() {
    const fs::path file = bf::service::test_folder() / "served.yaml";
    std::ofstream(file) << text;
    return file;
}

/// A service without a network, attached to a program.
class Attached {
  public:
    Attached(const fs::path& file, const std::string& address)
        : service({.file = file,
                   .version = "1",
                   .post =
                       [this](std::function<void()> task) {
                           const std::lock_guard lock(mutex_);
                           tasks_.push_back(std::move(task));
                           wake_.notify_one();
                       },
                   .tell = [this](const std::string& message) { told = Json::parse(message); },
                   .send = [this](const std::string& frame) { take(frame); },
                   .attach = address}) {}

    Json ask(const std::string& method, const Json& params) {
        return Json::parse(service.answer(1, Json{{"id", 1}, {"method", method}, {"params", params}}.dump()));
    }
    /// Lets the service live until something is so.
    template <class Is> bool until(const Is& is) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
        while (!is()) {
            std::unique_lock lock(mutex_);
            if (!wake_.wait_until(lock, end, [&] { return !tasks_.empty(); })) return false;
            const auto task = std::move(tasks_.front());
            tasks_.pop_front();
            lock.unlock();
            task();
        }
        return true;
    }
    Json report() { return ask("hello", {{"protocol", bf::service::protocol_version}})["result"]["live"]; }
    /// Is there an entry of the log that says so, by somebody whose name begins so?
    bool has_entry(const std::string& who, const std::string& what) {
        const Json log = report()["log"];
        return std::ranges::any_of(log, [&](const Json& entry) {
            return entry["who"].get<std::string>().starts_with(who) && entry["what"] == what;
        });
    }
    Json live() { return ask("hello", {{"protocol", bf::service::protocol_version}})["result"]["run"]; }

    std::map<int, std::map<double, std::vector<double>>> samples; ///< by signal and time
    Json told;

  private:
    void take(const std::string& frame) {
        for (std::size_t at = 0; at < frame.size();) {
            std::uint32_t index = 0, n = 0;
            double time = 0;
            std::memcpy(&index, &frame[at], 4);
            std::memcpy(&n, &frame[at + 8], 4);
            std::memcpy(&time, &frame[at + 12], 8);
            std::vector<double> values(n);
            std::memcpy(values.data(), &frame[at + 20], 8 * n);
            samples[static_cast<int>(index)][time] = std::move(values);
            at += 20 + 8 * n;
        }
    }
    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<std::function<void()>> tasks_;

  public:
    bf::service::Service service;
};

TEST(Live, ShowsTheSignalsOfAnotherProgramAndTunesIt) {
    const fs::path file = written();
    Program program(file, 1'000'000);
    Attached attached(file, program.address());
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
    EXPECT_EQ(attached.live()["live"]["name"], "served");
    EXPECT_EQ(attached.live()["live"]["refusal"], "");
    std::map<std::string, int> index;
    ASSERT_TRUE(attached.until([&] {
        const Json signals = attached.ask("signals", Json::object())["result"]["signals"];
        for (const auto& signal : signals) index[signal["path"]] = signal["index"];
        return index.size() >= 6;
    }));
    attached.ask("watch", {{"paths", {"control.y", "error.y", "count.y"}}});
    ASSERT_TRUE(attached.until([&] {
        return attached.samples[index.at("control.y")].size() > 50 &&
               !attached.samples[index.at("count.y")].empty();
    }));
    for (const auto& [time, values] : attached.samples[index.at("control.y")])
        if (const auto error = attached.samples[index.at("error.y")].find(time);
            error != attached.samples[index.at("error.y")].end()) {
            EXPECT_EQ(values[0], 0.3 * error->second[0]);
        }
    EXPECT_EQ(attached.samples[index.at("count.y")].begin()->second, (std::vector<double>{1, 3, -2, 4}));

    const auto has_k = [](const Json& run, double value) {
        return std::ranges::any_of(run["tuned"], [&](const Json& one) {
            return one["name"] == "k" && one["values"] == Json::array({value});
        });
    };
    const Json refused = attached.ask("tune", {{"name", "k"}, {"values", {7}}});
    EXPECT_EQ(refused["error"]["message"], "variable 'k' must be at most 5, but is 7; nothing was changed");
    EXPECT_EQ(attached.ask("run", {{"action", "pause"}})["error"]["message"],
              "the run is another program's: it cannot be moved in time");
    EXPECT_EQ(attached.live()["tuned"], Json::array())
        << "a refused value is not shown, nor what the model has";
    attached.ask("tune", {{"name", "k"}, {"values", {2}}});
    EXPECT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "k = 2, was 0.3"); }));
    Attached other(file, program.address());
    ASSERT_TRUE(other.until([&] { return other.live()["state"] == "running"; }));
    other.ask("tune", {{"name", "k"}, {"values", {1}}});
    EXPECT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "k = 1, was 2"); }));
    EXPECT_TRUE(attached.until([&] { return has_k(attached.live(), 1); })) << "what another one changed";
    EXPECT_TRUE(other.until([&] { return other.has_entry("page 1 of ", "k = 2, was 0.3"); }))
        << "what was done before it looked";
    ASSERT_TRUE(attached.until([&] { return !attached.report()["timing"].is_null(); }));
    const Json timing = attached.report()["timing"];
    EXPECT_EQ(timing["state"], "running");
    EXPECT_EQ(timing["period_us"], 1000);
    EXPECT_GT(timing["steps"], 10);
    EXPECT_GE(timing["response_us"]["worst"], timing["step_us"]["p50"]);
    program.end();
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "failed"; }));
    EXPECT_NE(attached.live()["live"]["message"].get<std::string>().find("the program"), std::string::npos);
}

TEST(Live, KnowsWhoOfTheLogIsAPageOfIts) {
    const fs::path file = written();
    Program program(file, 1'000'000);
    Attached attached(file, program.address());
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
    EXPECT_EQ(attached.ask("hello", {{"protocol", bf::service::protocol_version}})["result"]["page"], 1);
    attached.ask("tune", {{"name", "k"}, {"values", {2}}});
    ASSERT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "k = 2, was 0.3"); }));
    EXPECT_EQ(attached.report()["log"][0]["page"], 1);
    const std::string who = attached.report()["log"][0]["who"];
    EXPECT_NE(who.find(" (" + std::to_string(::getpid()) + ") at 127.0.0.1:"), std::string::npos) << who;
    // A page of the same number, of another process.
    asio::io_context io;
    asio::ip::tcp::socket socket(io);
    const auto address = program.address();
    const auto colon = address.rfind(':'), slash = address.rfind('/');
    const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1, slash - colon - 1)));
    socket.connect({asio::ip::address_v4::loopback(), port});
    Socket other(std::move(socket));
    other.set_option(boost::beast::websocket::stream_base::decorator([](auto& request) {
        request.set(boost::beast::http::field::sec_websocket_protocol, "foxglove.websocket.v1");
    }));
    other.handshake("127.0.0.1", address.substr(slash));
    const std::string name = who.substr(0, who.find('('));
    other.write(asio::buffer(Json{{"op", "setParameters"},
                                  {"who", name + "(1)"},
                                  {"parameters", Json::array({{{"name", "k"}, {"value", 4}}})}}
                                 .dump()));
    ASSERT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "k = 4, was 2"); }));
    EXPECT_EQ(attached.report()["log"][1]["page"], nullptr);
}

TEST(Live, TellsHowAProgramEndedUntilThereIsAnotherOne) {
    const fs::path file = written();
    std::optional<Program> program(std::in_place, file, 1'000'000, true, false, "0", "secret");
    const std::string address = program->address();
    Attached attached(file, address);
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
    const auto message = [&] { return attached.live()["live"]["message"].get<std::string>(); };
    attached.ask("run", {{"action", "stop"}});
    program->say_goodbye("", false);
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "ended"; }));
    EXPECT_EQ(message().substr(0, 49), "the program ended in order, stopped by page 1 of ");
    EXPECT_EQ(attached.report()["timing"]["state"], "ended");
    EXPECT_EQ(attached.report()["timing"]["steps"], std::int64_t{program->statistics().steps});
    EXPECT_EQ(attached.ask("tune", {{"name", "k"}, {"values", {2}}})["error"]["message"], message());
    program.reset(); // nothing is there, which is looked for again
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    EXPECT_EQ(attached.live()["state"], "ended");
    EXPECT_EQ(message().substr(0, 38), "the program ended in order, stopped by");

    const auto colon = address.rfind(':');
    const std::string port = address.substr(colon + 1, address.rfind('/') - colon - 1);
    const auto next = [&](const std::string& failure, bool is_interrupted) {
        program.emplace(file, 20, true, true, port, "secret");
        EXPECT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
        EXPECT_TRUE(attached.until([&] { return !attached.report()["timing"].is_null(); }));
        attached.ask("run", {{"action", "start"}});
        program->say_goodbye(failure, is_interrupted);
        EXPECT_TRUE(attached.until([&] { return attached.live()["state"] != "running"; }));
        program.reset();
        return attached.live()["state"].get<std::string>() + ": " + message();
    };
    EXPECT_EQ(next("", false), "ended: the program ended in order");
    EXPECT_EQ(next("", true), "ended: the program ended in order, interrupted");
    EXPECT_EQ(next("gain: the output is not finite", false),
              "failed: the program failed: gain: the output is not finite");

    program.emplace(file, 1'000'000, true, false, port, "secret");
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
    attached.ask("run", {{"action", "emergency_stop"}});
    program->say_goodbye("", false);
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "ended"; }));
    EXPECT_EQ(message().substr(0, 52), "the program was stopped by emergency stop of page 1 ");
}

/// Takes connections, answers whatever is asked with this, and ends them.
class Answering {
  public:
    explicit Answering(std::string answer)
        : acceptor_(io_, {asio::ip::address_v4::loopback(), 0}), thread_([this, answer = std::move(answer)] {
              while (true) {
                  asio::ip::tcp::socket socket(io_);
                  boost::beast::error_code error;
                  acceptor_.accept(socket, error);
                  if (error || ends_) return;
                  char request[4096];
                  socket.read_some(asio::buffer(request), error);
                  asio::write(socket, asio::buffer(answer), error);
              }
          }) {}
    ~Answering() {
        ends_ = true;
        asio::ip::tcp::socket last(io_);
        last.connect(acceptor_.local_endpoint());
        thread_.join();
    }
    std::string place() const { return "127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()); }

  private:
    asio::io_context io_;
    asio::ip::tcp::acceptor acceptor_;
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

TEST(Live, ATunnelBehindWhichNothingIsIsNoWrongToken) {
    const fs::path file = written();
    const auto refusal = [&](const std::string& place, const std::string& token) {
        Attached attached(file, "ws://" + place + "/?token=" + token);
        EXPECT_TRUE(attached.until([&] { return attached.live()["state"] == "failed"; }));
        return attached.live()["live"]["message"].get<std::string>();
    };
    const Answering nothing(""), other("SSH-2.0-OpenSSH_9.2\r\n"),
        full("HTTP/1.1 503 Service Unavailable\r\nContent-Length: 30\r\n\r\ntoo many viewers are connected");
    EXPECT_EQ(refusal(nothing.place(), "x"),
              "nothing answers behind " + nothing.place() +
                  ": the program may have ended while a tunnel still listens there");
    EXPECT_EQ(refusal(other.place(), "x"),
              "what answers at " + other.place() + " is no program of BlockFactory: bad version");
    EXPECT_EQ(refusal(full.place(), "x"), "what answers at " + full.place() +
                                              " refuses the connection: 503 too many viewers are connected");
    Program program(file, 1'000'000);
    const std::string address = program.address();
    const std::string place = address.substr(5, address.rfind('/') - 5);
    EXPECT_EQ(refusal(place, "wrong"),
              "the program at " + place +
                  " does not let this page in; give the whole address that it printed, with the token");
}

TEST(Live, AnAddressThatIsNoneIsRefused) {
    const fs::path file = written();
    try {
        Attached attached(file, "http://here");
        FAIL() << "it is one";
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(),
                     "'http://here' is no address of a live program; give the one that it printed, "
                     "ws://HOST:PORT/?token=TOKEN or unix:PATH?token=TOKEN");
    }
}

TEST(Live, StartsAndStopsAProgramThatWaits) {
    const fs::path file = written();
    Program program(file, 1'000'000, true, true);
    Attached attached(file, program.address());
    const auto is = [&](const char* state) {
        return [&attached, state] {
            const Json timing = attached.report()["timing"];
            return !timing.is_null() && timing["state"] == state;
        };
    };
    ASSERT_TRUE(attached.until(is("waiting")));
    EXPECT_EQ(attached.ask("run", {{"action", "start"}})["result"]["state"], "running");
    ASSERT_TRUE(attached.until(is("running")));
    EXPECT_EQ(attached.ask("run", {{"action", "start"}})["error"]["message"],
              "the program does not wait to be started");
    attached.ask("run", {{"action", "stop"}});
    program.wait();
    EXPECT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "stop"); }));
    attached.ask("run", {{"action", "emergency_stop"}});
    EXPECT_TRUE(attached.until([&] { return attached.has_entry("page 1 of ", "emergency stop"); }));
    EXPECT_TRUE(attached.has_entry("page 1 of ", "start"));
}

TEST(Live, AProgramThatIsLookedAtAloneSaysHowItIsStartedOtherwise) {
    const fs::path file = written();
    Program program(file, 1'000'000, false);
    Attached attached(file, program.address());
    ASSERT_TRUE(attached.until([&] { return attached.live()["state"] == "running"; }));
    const std::string refusal =
        "this program was started to be looked at alone; start it with --control to let "
        "viewers change parameters, start and stop it";
    EXPECT_EQ(attached.live()["live"]["refusal"], refusal);
    for (const char* action : {"start", "stop", "emergency_stop"})
        EXPECT_EQ(attached.ask("run", {{"action", action}})["error"]["message"], refusal);
    EXPECT_EQ(attached.ask("tune", {{"name", "k"}, {"values", {2}}})["error"]["message"], refusal);
}

/// Ten pages of an attached run, of which two read, four stall and four are gone without a word.
void crowd(std::uint16_t port, const std::string& token, const std::atomic<bool>& ends) {
    asio::io_context io;
    const std::string host = "127.0.0.1:" + std::to_string(port);
    const auto open = [&] {
        asio::ip::tcp::socket socket(io);
        socket.connect({asio::ip::address_v4::loopback(), port});
        auto page = std::make_unique<Socket>(std::move(socket));
        page->handshake(host, "/socket?token=" + token);
        page->write(asio::buffer(std::string(R"({"id": 1, "method": "watch", "params": {"paths":
            ["sine.y", "error.y", "control.y", "plant.y", "wide.y"]}})")));
        return page;
    };
    std::vector<std::unique_ptr<Socket>> pages;
    for (int i = 0; i < 10; ++i) pages.push_back(open());
    for (int killed = 0; !ends;) {
        for (int i = 0; i < 2; ++i) {
            boost::beast::flat_buffer buffer;
            boost::beast::error_code error;
            pages[static_cast<std::size_t>(i)]->read(buffer, error);
            if (error) return;
        }
        if (killed < 4) pages[static_cast<std::size_t>(2 + killed++)]->next_layer().close();
    }
}

TEST(Live, PagesThatReadStallOrDieLeaveTheRunAlone) {
    const fs::path file = written();
    constexpr std::int64_t steps = 2000;
    const auto outputs = [&](bool is_crowded) {
        Program program(file, steps);
        std::optional<bf::service::Server> editor;
        std::atomic<bool> ends{false};
        std::thread serving, pages;
        if (is_crowded) {
            editor.emplace(bf::service::ServerOptions{.file = file,
                                                      .page = file.parent_path(),
                                                      .version = "1",
                                                      .attach = program.address(),
                                                      .page_bytes = 100'000});
            serving = std::thread([&] { editor->run([&] { return !ends; }); });
            pages = std::thread([&] { crowd(editor->port(), editor->token(), ends); });
        }
        program.wait();
        ends = true;
        if (serving.joinable()) serving.join();
        editor.reset(); // which sends the pages away
        if (pages.joinable()) pages.join();
        std::fputs(bf::realtime::report(program.statistics()).c_str(), stdout);
        return program.outputs;
    };
    const auto alone = outputs(false), crowded = outputs(true);
    ASSERT_EQ(alone.size(), static_cast<std::size_t>(steps));
    EXPECT_TRUE(alone == crowded);
}

} // namespace
