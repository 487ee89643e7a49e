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
    explicit Program(const fs::path& file, std::int64_t steps, bool is_controlled = true, bool waits = false)
        : model_(bf::load(file)), run_(model_.diagram), runner_(run_, options(waits)),
          server_(std::in_place, run_, run_.signals(), runner_.access(),
                  bf::realtime::ServerOptions{.where = "0", .is_controlled = is_controlled}),
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
