// Pages edit the model of a run that another program makes.
#include "asking.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/library/editing.hpp"

#include <atomic>
#include <fstream>
#include <optional>
#include <thread>

namespace bf::service {
namespace {

constexpr const char* text = "model: served\n"
                             "step: 0.001\n"
                             "variables: {k: 0.3}\n"
                             "blocks:\n"
                             "  one: {block: Constant}\n"
                             "  control: {block: Gain, K: k}\n"
                             "  plant: {block: DiscreteIntegrator}\n"
                             "connections: {one: control, control: plant}\n";

/// Runs the model against the clock and serves it, until it is destroyed.
class EditedProgram {
  public:
    explicit EditedProgram(const std::filesystem::path& file, bool is_controlled = true,
                           bool is_editable = true)
        : model_(load(file)), run_(model_.diagram), editing_(model_, run_), runner_(run_, options()),
          server_(std::in_place, run_, run_.signals(), runner_.access(),
                  realtime::ServerOptions{.where = "0",
                                          .is_controlled = is_controlled,
                                          .editing = is_editable ? &editing_ : nullptr}) {
        runner_.add_observer(*server_);
        thread_ = std::thread([this] { runner_.run(1e9, [this](const auto&) { return !ends_; }); });
    }
    ~EditedProgram() { end(); }
    void end() {
        ends_ = true;
        if (thread_.joinable()) thread_.join();
        server_.reset();
    }
    std::string address() const { return server_->address() + server_->token(); }
    /// After the end.
    double value(const std::string& parameter) {
        const auto all = runner_.stepped().parameters();
        return find(all, parameter)[0];
    }
    std::vector<Quantity> signals() { return runner_.stepped().signals(); }
    std::string log() const {
        std::string all;
        for (const auto& entry : server_->log()) all += entry.who + ": " + entry.what + "\n";
        return all;
    }
    std::uint64_t edits() const { return server_->counts().edits; }

  private:
    static realtime::RunnerOptions options() {
        realtime::RunnerOptions options;
        options.thread.locks_memory = false;
        return options;
    }
    const LoadedModel model_;
    Simulation run_;
    SimulationEditing editing_;
    realtime::Runner runner_;
    std::optional<realtime::Server> server_;
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

class LiveEdit : public AskingTest {
  protected:
    LiveEdit() { std::ofstream(folder / "served.yaml") << text; }

    void attach(const EditedProgram& program) {
        told.clear(); // what a service before it told
        open("served.yaml", {}, {}, program.address());
        wait_for([](const Json& n) { return n["method"] == "run" && n["params"]["state"] == "running"; });
        while (!result("hello", {{"protocol", protocol_version}})["document"]["is_checked"].get<bool>())
            wait_for([first = told.size(), this](const Json&) { return told.size() > first; });
    }
    /// The run once it is one of the document, or an edit waits.
    Json edit(const Json& operation) {
        told.clear();
        result("edit", {{"operation", operation}});
        return settled();
    }
    Json settled() {
        wait_for([&](const Json& n) {
            return n["method"] == "run" &&
                   (n["params"]["is_current"] == true || !n["params"]["edit"].is_null());
        });
        return told.back()["params"];
    }
    static Json gain(const char* value) {
        return {{"do", "set"}, {"path", "control"}, {"name", "K"}, {"value", value}};
    }
    std::set<std::string> paths() {
        std::set<std::string> all;
        const Json found = result("signals");
        for (const auto& signal : found["signals"]) all.insert(signal["path"].get<std::string>());
        return all;
    }
};

TEST_F(LiveEdit, AGainAndABlockGoOnInTheRunOfTheProgram) {
    EditedProgram program(folder / "served.yaml");
    attach(program);
    EXPECT_EQ(result("hello", {{"protocol", protocol_version}})["run"]["live"]["edit_refusal"], "");
    Json run = edit(gain("2"));
    EXPECT_EQ(run["is_current"], true) << run;
    const Json block = {{"name", "twice"}, {"type", "Gain"}, {"settings", Json::array()}};
    run = edit({{"do", "batch"},
                {"operations",
                 {{{"do", "add"}, {"system", ""}, {"block", block}},
                  {{"do", "connect"}, {"system", ""}, {"from", "plant"}, {"to", "twice"}}}}});
    EXPECT_EQ(run["is_current"], true) << run;
    EXPECT_TRUE(paths().contains("twice.y"));
    result("watch", {{"paths", {"twice.y"}}});
    told.clear();
    wait_for([&](const Json& n) { return n["method"] == "run" && sent_bytes > 0; });
    EXPECT_GT(sent_bytes, 0u);
    EXPECT_NE(program.log().find("page 1 of "), std::string::npos) << program.log();
    EXPECT_NE(program.log().find("edit: "), std::string::npos) << program.log();
    EXPECT_GE(program.edits(), 2u);
    program.end();
    EXPECT_EQ(program.value("control.K"), 2);
    EXPECT_GT(find(program.signals(), "plant")[0], 0) << "it went on";
}

TEST_F(LiveEdit, TheLogNamesAllThatMattersToTheRun) {
    EditedProgram program(folder / "served.yaml");
    attach(program);
    const Json trim = {{"name", "trim"}, {"type", "Gain"}, {"settings", Json::array()}};
    const auto connect = [](const char* kind, const char* from, const char* to) {
        return Json{{"do", kind}, {"system", ""}, {"from", from}, {"to", to}};
    };
    result("edit", {{"operation", {{"do", "add"}, {"system", ""}, {"block", trim}}}}); // with an open input
    const Json run = edit({{"do", "batch"},
                           {"operations",
                            {{{"do", "move"}, {"path", "trim"}, {"to", {{"x", 1}, {"y", 2}}}},
                             connect("disconnect", "control", "plant"),
                             connect("connect", "control", "trim"),
                             connect("connect", "trim", "plant")}}});
    EXPECT_EQ(run["is_current"], true) << run;
    EXPECT_NE(program.log().find("edit: add trim and 3 more"), std::string::npos) << program.log();
}

TEST_F(LiveEdit, AStateThatIsRenamedStaysActive) {
    std::ofstream(folder / "served.yaml")
        << "model: served\nstep: 0.001\nblocks:\n"
           "  c: {block: StateMachine, states: [idle, fill, run], transitions: \"[1 2 0 0; 2 3 0 0]\"}\n";
    EditedProgram program(folder / "served.yaml");
    attach(program);
    Json run = edit({{"do", "rename"}, {"path", "c.run"}, {"name", "go"}});
    EXPECT_EQ(run["is_current"], true) << run;
    run = edit({{"do", "remove"}, {"path", "c.idle"}});
    EXPECT_EQ(run["edit"]["lost"],
              (Json{"'c.x' may be 'idle', which is no longer there: 'c' then begins anew"}));
    told.clear();
    result("run", {{"action", "adopt"}});
    wait_for([](const Json& n) { return n["method"] == "run" && n["params"]["is_current"] == true; });
    program.end();
    EXPECT_EQ(find(program.signals(), "c.state")[0], 2) << "it has not begun anew";
    EXPECT_GT(find(program.signals(), "c.time_in_state")[0], 0.01);
}

TEST_F(LiveEdit, WhatWouldBeLostIsSaidBeforeAndAPersonTakesItOver) {
    EditedProgram program(folder / "served.yaml");
    attach(program);
    Json run = edit({{"do", "remove"}, {"path", "plant"}});
    EXPECT_EQ(run["is_current"], false);
    EXPECT_EQ(run["edit"]["lost"],
              (Json{"'plant.x' is no longer there", "'plant.before' is no longer there"}));
    EXPECT_EQ(program.edits(), 0u);
    told.clear();
    result("run", {{"action", "adopt"}});
    wait_for([](const Json& n) { return n["method"] == "run" && n["params"]["is_current"] == true; });
    EXPECT_EQ(told.back()["params"]["edit"], nullptr);
    EXPECT_EQ(program.edits(), 1u);
    EXPECT_FALSE(paths().contains("plant.y"));
    EXPECT_EQ(refusal("run", {{"action", "adopt"}}), "no edit waits to go on in the program");
    told.clear();
    result("undo");
    run = settled();
    EXPECT_EQ(run["is_current"], true) << run;
    EXPECT_TRUE(paths().contains("plant.y"));
}

TEST_F(LiveEdit, WhatWasTunedStays) {
    EditedProgram program(folder / "served.yaml");
    attach(program);
    result("tune", {{"name", "k"}, {"values", {7}}});
    EXPECT_EQ(edit({{"do", "set"}, {"path", "plant"}, {"name", "gain"}, {"value", "3"}})["is_current"], true);
    result("tune", {{"name", "k"}, {"values", {8}}});
    program.end();
    EXPECT_EQ(program.value("control.K"), 8);
    EXPECT_EQ(program.value("plant.gain"), 3);
}

TEST_F(LiveEdit, AProgramThatIsNotEditableSaysWhy) {
    for (const bool is_controlled : {true, false}) {
        std::ofstream(folder / "served.yaml") << text;
        EditedProgram program(folder / "served.yaml", is_controlled, !is_controlled);
        attach(program);
        const Json run = edit(gain("2"));
        EXPECT_EQ(run["is_current"], false);
        EXPECT_NE(run["edit"]["refusal"].get<std::string>().find(is_controlled ? "--editable" : "--control"),
                  std::string::npos)
            << run;
        EXPECT_EQ(program.edits(), 0u);
        service.reset();
        program.end();
        EXPECT_EQ(program.value("control.K"), 0.3);
    }
}

} // namespace
} // namespace bf::service
