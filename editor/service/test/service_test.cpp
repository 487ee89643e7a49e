#include "asking.hpp"
#include "bf/base/files.hpp"
#include "bf/recording/writer.hpp"
#include "scenery.hpp"

#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

namespace fs = std::filesystem;
using bf::service::Service;
using Json = nlohmann::json;

class ServiceTest : public bf::service::AskingTest {
  protected:
    void SetUp() override {
        fs::copy_file(fs::path(BF_SOURCE_DIRECTORY) / "docs" / "start" / "motor.yaml", file());
        open("motor.yaml", [this](const bf::Diagram& diagram) {
            if (++scenes == broken_scene) throw std::runtime_error("no mesh 'arm.stl'");
            return bf::service::one_body(diagram, "load.y");
        });
    }

    fs::path file() const { return folder / "motor.yaml"; }
    std::string text() {
        settle();
        return bf::read_text_file(file());
    }

    void write_recording(const char* name) const {
        bf::recording::Writer writer(folder / name);
        const auto channel = writer.add_channel("motor.omega", {.unit = "rad/s"});
        writer.begin();
        for (const double value : {1.5, 2.5})
            writer.append(channel, static_cast<std::int64_t>(value * 1e9), &value);
        writer.close();
    }
    Json told_of(int number) {
        return wait_for([&](const Json& n) {
            return n["method"] == "recorded" && n["params"]["number"] == number;
        })["params"];
    }
    Json read(const char* name) { return told_of(result("read", {{"file", name}})["number"].get<int>()); }

    int scenes = 0, broken_scene = 0;
};

TEST_F(ServiceTest, WelcomesAPageOfItsProtocolAndNoOther) {
    const Json welcome = result("hello", {{"protocol", bf::service::protocol_version}});
    EXPECT_EQ(welcome["version"], "1.2.3");
    EXPECT_EQ(welcome["files"], Json::array({"motor.yaml"}));
    EXPECT_EQ(welcome["document"]["file"], "motor.yaml");
    EXPECT_EQ(refusal("hello", {{"protocol", 99}}),
              "this page speaks version 99 of the protocol, and bf 1.2.3 version " +
                  std::to_string(bf::service::protocol_version) + "; reload the page");
}

TEST_F(ServiceTest, ChecksEachChangeAndSaysWhatBfCheckSays) {
    EXPECT_TRUE(checked()["diagnostics"].empty());
    result("edit",
           {{"operation",
             {{"do", "set"}, {"path", "controller.proportional"}, {"name", "K"}, {"value", "Gain.Kq"}}}});
    const Json wrong = checked();
    ASSERT_EQ(wrong["diagnostics"].size(), 1u) << wrong.dump();
    EXPECT_EQ(wrong["diagnostics"][0]["path"], "controller.proportional.K");
    EXPECT_EQ(wrong["diagnostics"][0]["line"], 22);
    EXPECT_EQ(wrong["diagnostics"][0]["file"], "motor.yaml");
    EXPECT_NE(wrong["diagnostics"][0]["message"].get<std::string>().find("Kq"), std::string::npos);
    result("undo");
    EXPECT_TRUE(checked()["diagnostics"].empty());
}

TEST_F(ServiceTest, RefusesAnImpossibleEditWithItsReasonAndChangesNothing) {
    const std::string before = text();
    EXPECT_NE(refusal("edit", {{"operation", {{"do", "rename"}, {"path", "lod"}, {"name", "x"}}}})
                  .find("did you mean 'load'"),
              std::string::npos);
    EXPECT_EQ(text(), before);
    EXPECT_EQ(refusal("undo"), "there is nothing to undo");
}

TEST_F(ServiceTest, InspectsWhatABlockDeclaresAndWhatItIsGiven) {
    checked();
    const Json seen = result("inspect", {{"path", "controller.integral"}});
    EXPECT_EQ(seen["type"], "DiscreteIntegrator");
    std::map<std::string, Json> fields;
    for (const auto& field : seen["fields"]) fields[field["name"]] = field;
    EXPECT_EQ(fields.at("gain")["text"], "Gain.Ki");
    EXPECT_EQ(fields.at("gain")["value"], "1.3");
    EXPECT_EQ(fields.at("gain")["role"], "parameter");
    EXPECT_EQ(fields.at("upper")["value"], "24");
    EXPECT_TRUE(fields.at("doc")["text"].is_null());
    EXPECT_EQ(fields.at("doc")["role"], "property");
    const Json controller = result("inspect", {{"path", "controller"}});
    for (const auto& field : controller["fields"])
        EXPECT_TRUE(field["name"] != "period" || field["text"] == "0.01");
    EXPECT_NE(refusal("inspect", {{"path", "controller.nothing"}}), "");
}

TEST_F(ServiceTest, EvaluatesASettingWhileItIsTypedAndChangesNothing) {
    checked();
    const std::string before = text();
    const auto typed = [&](const std::string& expression) {
        return result("evaluate", {{"path", "controller.proportional"}, {"name", "K"}, {"text", expression}});
    };
    EXPECT_EQ(typed("2*Gain.Kp + [0 1]")["value"], "[0.2 1.2]");
    EXPECT_EQ(typed("2*Gain.Kd")["error"], "the struct has no field 'Kd'; did you mean 'Kp'?");
    EXPECT_NE(typed("2*")["error"], "");
    EXPECT_EQ(typed("2*")["value"], "");
    EXPECT_EQ(text(), before);
}

TEST_F(ServiceTest, FindsNamesTypesAndWhatIsWritten) {
    const auto found = [&](const std::string& wanted) {
        std::vector<std::string> all;
        const Json answer = result("find", {{"text", wanted}});
        for (const auto& hit : answer["hits"])
            all.push_back(hit["what"].get<std::string>() + " " + hit["path"].get<std::string>());
        return all;
    };
    using All = std::vector<std::string>;
    EXPECT_EQ(found("PROPORTIONAL"), All{"name controller.proportional"});
    EXPECT_EQ(found("transferfunction"), (All{}));
    EXPECT_EQ(found("Gain.Kp"), (All{"variable ", "setting controller.proportional"}));
    EXPECT_EQ(found(""), All{});
}

TEST_F(ServiceTest, OffersTheSolversThatThereAre) {
    const Json seen = result("inspect", {{"path", ""}});
    for (const auto& field : seen["fields"])
        if (field["name"] == "solver") {
            EXPECT_NE(std::ranges::find(field["choices"], "rk4"), field["choices"].end());
            EXPECT_NE(std::ranges::find(field["choices"], "euler"), field["choices"].end());
            return;
        }
    FAIL() << "a model has a solver";
}

TEST_F(ServiceTest, ListsVariablesWithTheirValues) {
    checked();
    const Json variables = result("variables", {{"system", ""}})["variables"];
    ASSERT_EQ(variables.size(), 8u);
    EXPECT_EQ(variables[0]["name"], "Motor.R");
    EXPECT_EQ(variables[0]["value"], "1");
    EXPECT_TRUE(variables[0]["minimum"].is_null());
    EXPECT_EQ(refusal("variables", {{"system", "nowhere"}}), "there is no subsystem 'nowhere'");

    const auto set = [&](const char* system, const char* name) {
        result(
            "edit",
            {{"operation",
              {{"do", "set_variable"}, {"system", system}, {"name", name}, {"variable", {{"value", "5"}}}}}});
    };
    set("controller", "Gain.Kp"); // hides all of the outer struct
    set("controller", "own");
    const Json inner = result("variables", {{"system", "controller"}})["variables"];
    std::vector<std::string> seen;
    for (const auto& variable : inner)
        seen.push_back(variable["system"].get<std::string>() + "/" + variable["name"].get<std::string>());
    EXPECT_EQ(std::vector(seen.begin(), seen.begin() + 3),
              (std::vector<std::string>{"controller/Gain.Kp", "controller/own", "/Motor.R"}));
    EXPECT_EQ(std::ranges::count(seen, "/Gain.Kp") + std::ranges::count(seen, "/Gain.Ki"), 0);
    EXPECT_TRUE(inner[2]["value"] == "1");
}

TEST_F(ServiceTest, CopiesBlocksWithTheirWiresAndPastesThemUnderFreeNames) {
    const Json copied =
        result("copy", {{"system", "controller"}, {"names", {"proportional", "integral", "sum"}}});
    result("paste", {{"system", "controller"}, {"text", copied["text"]}, {"at", {{"x", 100}, {"y", 200}}}});
    EXPECT_NE(text().find("proportional2: {block: Gain, K: Gain.Kp}"), std::string::npos) << text();
    EXPECT_NE(text().find("proportional2: sum2.u1"), std::string::npos) << text();
    EXPECT_NE(text().find("integral2: sum2.u2"), std::string::npos) << text();
    result("undo");
    EXPECT_EQ(
        refusal("paste", {{"system", ""}, {"text", "]"}, {"at", {{"x", 0}, {"y", 0}}}}).find("clipboard:1"),
        0u);
}

TEST_F(ServiceTest, PastesCornersAndLabelsOfWiresWithThem) {
    const auto edit = [&](const Json& operation) { result("edit", {{"operation", operation}}); };
    const auto corners = [](double x) { return Json::array({{{"x", x}, {"y", 10}}, {{"x", x}, {"y", 90}}}); };
    edit({{"do", "move"}, {"path", "controller.proportional"}, {"to", {{"x", 0}, {"y", 0}}}});
    edit({{"do", "move"}, {"path", "controller.sum"}, {"to", {{"x", 200}, {"y", 50}}}});
    edit({{"do", "bend"}, {"path", "controller.sum.u1"}, {"points", corners(120)}});
    edit({{"do", "label"}, {"path", "controller.sum.u2"}, {"is_there", true}});
    edit({{"do", "move"}, {"path", "controller"}, {"to", {{"x", 0}, {"y", 0}}}});
    const auto paste = [&](const std::string& system, const std::vector<std::string>& names) {
        const Json copied = result("copy", {{"system", system}, {"names", names}});
        result("paste", {{"system", system}, {"text", copied["text"]}, {"at", {{"x", 1000}, {"y", 300}}}});
    };
    paste("controller", {"proportional", "integral", "sum"});
    EXPECT_NE(text().find("controller.sum2.u1: [[1120, 310], [1120, 390]]"), std::string::npos) << text();
    EXPECT_NE(text().find("controller.sum2.u2: labels"), std::string::npos) << text();
    paste("", {"controller"}); // what is inside stays where it was
    EXPECT_NE(text().find("controller2.sum2.u1: [[1120, 310], [1120, 390]]"), std::string::npos) << text();
    EXPECT_NE(text().find("controller2.sum.u2: labels"), std::string::npos) << text();
    result("undo");
    result("undo");
    paste("controller", {"sum"}); // without what the wires come from
    EXPECT_EQ(text().find("controller.sum2.u"), std::string::npos) << text();
}

TEST_F(ServiceTest, PastesBlocksThatStandForFilesOfTheModelsFolder) {
    result("edit", {{"operation", {{"do", "extract"}, {"path", "controller"}, {"file", "law.yaml"}}}});
    const Json copied = result("copy", {{"system", ""}, {"names", {"controller"}}});
    const Json pasted = {{"system", ""}, {"text", copied["text"]}, {"at", {{"x", 0}, {"y", 300}}}};
    result("paste", pasted);
    EXPECT_NE(text().find("controller2: {file: law.yaml"), std::string::npos) << text();
    settle();
    fs::remove(folder / "law.yaml");
    EXPECT_EQ(refusal("paste", pasted).find("clipboard:"), 0U) << refusal("paste", pasted);
}

TEST_F(ServiceTest, NothingJumpsWhenTheFirstBlockGetsAPlace) {
    checked();
    const auto places = [&] {
        std::map<std::string, Json> all;
        const Json drawing = result("draw", {{"system", ""}});
        for (const auto& element : drawing["elements"])
            if (element["kind"] != "wire") all[element["path"]] = element["bounds"];
        return all;
    };
    auto before = places();
    EXPECT_GT(before.size(), 5u);
    result("edit", {{"operation", {{"do", "move"}, {"path", "load"}, {"to", {{"x", 500}, {"y", 600}}}}}});
    auto after = places();
    EXPECT_EQ(after["load"]["x"], 500);
    before.erase("load");
    after.erase("load");
    EXPECT_EQ(after, before);
    const std::string placed = text();
    result("edit", {{"operation", {{"do", "move"}, {"path", "load"}, {"to", {{"x", 510}, {"y", 600}}}}}});
    int lines = 0; // that differ
    std::istringstream a(placed), b(text());
    for (std::string one, other; std::getline(a, one) && std::getline(b, other);) lines += one != other;
    EXPECT_EQ(lines, 1);
    result("undo");
    result("undo");
    EXPECT_EQ(places()["motor"], before["motor"]);
}

TEST_F(ServiceTest, PlacesTheBlocksAroundAWireThatIsBentAndNoOthers) {
    checked();
    const Json points = {{{"x", 300}, {"y", 400}}};
    result("edit", {{"operation", {{"do", "bend"}, {"path", "controller.speed"}, {"points", points}}}});
    EXPECT_NE(text().find("\n    motor: {x: "), std::string::npos) << text();
    EXPECT_EQ(text().find("controller.proportional: {x"), std::string::npos);
    result("undo");
    result("edit", {{"operation", {{"do", "bend"}, {"path", "controller.voltage"}, {"points", points}}}});
    EXPECT_NE(text().find("controller.proportional: {x"), std::string::npos) << "an output inside of it";
    EXPECT_EQ(text().find("\n    motor: {x: "), std::string::npos);
}

TEST_F(ServiceTest, RunsWatchesAndTunes) {
    EXPECT_EQ(refusal("run", {{"action", "start"}, {"factor", nullptr}}),
              "the model is being checked; try again in a moment");
    checked();
    result("watch", {{"paths", {"motor.omega"}}});
    result("run", {{"action", "start"}});
    const Json ended =
        wait_for([](const Json& n) { return n["method"] == "run" && n["params"]["state"] == "ended"; });
    EXPECT_NEAR(ended["params"]["time"].get<double>(), 1.2, 1e-9);
    EXPECT_GT(sent_bytes, 24u * 50);
    EXPECT_EQ(result("watch", {{"paths", {"motor.omega", "nothing"}}})["signals"].size(), 1u);
    EXPECT_GT(result("signals")["signals"].size(), 10u);
    EXPECT_EQ(result("signals")["plots"][0],
              (Json{{"title", "Speed [rad/s]"}, {"signals", {"reference", "motor.omega"}}}));
    EXPECT_EQ(result("tune", {{"name", "Gain.Kp"}, {"values", {0.2}}})["reached"], ended["params"]["time"]);
    EXPECT_NE(refusal("tune", {{"name", "Gain.Kp"}, {"values", {1, 2}}}), "");
    EXPECT_NE(refusal("run", {{"action", "to"}, {"time", -1}}), "");
    EXPECT_EQ(refusal("run", {{"action", "emergency_stop"}}),
              "only the run of another program has an emergency stop");
}

TEST_F(ServiceTest, AnEditIsToldAtOnceAndGoesOnInTheRunWhenItIsChecked) {
    checked();
    result("run", {{"action", "step"}});
    EXPECT_EQ(result("run", {{"action", "pause"}})["is_current"], true);
    EXPECT_EQ(result("hello", {{"protocol", bf::service::protocol_version}})["run"]["state"], "paused")
        << "a page that comes later sees it";
    told.clear();
    result("edit", {{"operation", {{"do", "set"}, {"path", "load"}, {"name", "after"}, {"value", "0.06"}}}});
    ASSERT_EQ(told.back()["method"], "run");
    EXPECT_EQ(told.back()["params"]["is_current"], false);
    const Json run = wait_for(
        [](const Json& n) { return n["method"] == "run" && n["params"]["is_current"] == true; })["params"];
    EXPECT_EQ(run["edit"], Json());
    ASSERT_EQ(run["branches"].size(), 2u) << run.dump();
    EXPECT_EQ(run["branches"][1]["cause"], "load.after = 0.06");
    EXPECT_EQ(run["branches"][1]["from"], 0.001);
    EXPECT_EQ(run["branch"], 1);
}

TEST_F(ServiceTest, NamesBranchesByWhatWasEditedAsPeopleSayIt) {
    checked();
    result("run", {{"action", "step"}});
    const auto branch_of = [&](const Json& operation) {
        told.clear();
        result("edit", {{"operation", operation}});
        const Json run = wait_for([](const Json& n) {
            return n["method"] == "run" && n["params"]["is_current"] == true;
        })["params"];
        return run.is_null() ? std::string() : run["branches"].back()["cause"].get<std::string>();
    };
    EXPECT_EQ(
        branch_of(
            {{"do", "set_variable"}, {"system", ""}, {"name", "Gain.Kp"}, {"variable", {{"value", "0.3"}}}}),
        "Gain.Kp = 0.3");
    EXPECT_EQ(branch_of({{"do", "set"}, {"path", ""}, {"name", "stop"}, {"value", "3"}}), "stop = 3");
    const Json add = {
        {"do", "add"}, {"system", "controller"}, {"block", {{"name", "one"}, {"type", "Constant"}}}};
    const Json set = {{"do", "set"}, {"path", "controller.one"}, {"name", "value"}, {"value", "2"}};
    EXPECT_EQ(branch_of({{"do", "batch"}, {"operations", {add, set}}}), "add controller.one and 1 more");
    const Json move = {{"do", "move"}, {"path", "controller.one"}, {"to", {{"x", 1}, {"y", 2}}}};
    const Json value = {{"do", "set"}, {"path", "controller.one"}, {"name", "value"}, {"value", "3"}};
    EXPECT_EQ(branch_of({{"do", "batch"}, {"operations", {move, value}}}), "controller.one.value = 3")
        << "where it stands is nothing to the run";
}

TEST_F(ServiceTest, AnEditThatLosesStatesOfTheRunWaits) {
    checked();
    result("run", {{"action", "step"}});
    const auto text_before = text();
    std::string by_hand = text_before; // where it is not known that it is the same block
    for (auto at = by_hand.find("integral"); at != by_hand.npos; at = by_hand.find("integral", at))
        by_hand.replace(at, 8, "i");
    result("rewrite", {{"file", "motor.yaml"}, {"text", by_hand}, {"before", text_before}});
    const Json run = wait_for(
        [](const Json& n) { return n["method"] == "run" && !n["params"]["edit"].is_null(); })["params"];
    EXPECT_EQ(run["is_current"], false);
    EXPECT_EQ(run["edit"]["lost"][0], "'controller.integral.x' is no longer there");
    EXPECT_EQ(run["edit"]["begun"][0], "controller.i.x");
    result("run", {{"action", "adopt"}});
    EXPECT_FALSE(wait_for([](const Json& n) {
                     return n["method"] == "run" && n["params"]["is_current"] == true;
                 }).is_null());
}

TEST_F(ServiceTest, ABlockThatIsRenamedIsTheSameOneInTheRun) {
    checked();
    result("run", {{"action", "step"}});
    result("edit", {{"operation", {{"do", "rename"}, {"path", "controller.integral"}, {"name", "i"}}}});
    const Json run = wait_for([](const Json& n) {
        return n["method"] == "run" && n["params"]["branches"].size() == 2 &&
               n["params"]["is_current"] == true;
    })["params"];
    EXPECT_TRUE(run["edit"].is_null());
    EXPECT_EQ(run["branches"][1]["cause"], "rename controller.integral");
}

TEST_F(ServiceTest, AModelWithMistakesDoesNotRun) {
    result("edit",
           {{"operation", {{"do", "set"}, {"path", "load"}, {"name", "after"}, {"value", "nobody"}}}});
    checked();
    EXPECT_EQ(refusal("run", {{"action", "start"}}).find("the model has mistakes: "), 0u);
}

TEST_F(ServiceTest, OpensModelsOfItsFolderAlone) {
    EXPECT_NE(
        refusal("open", {{"file", "../../../../docs/start/motor.yaml"}}).find("is not in the opened folder"),
        std::string::npos);
    EXPECT_NE(refusal("open", {{"file", "/etc/passwd"}}).find("is not in the opened folder"),
              std::string::npos);
    EXPECT_NE(refusal("open", {{"file", "nothing.yaml"}}), "");
    std::ofstream(file().parent_path() / "other.yaml") << "model: other\nstep: 1\n";
    EXPECT_EQ(result("open", {{"file", "other.yaml"}})["file"], "other.yaml");
}

TEST_F(ServiceTest, TellsPagesWhatAnotherProgramWrote) {
    checked();
    std::string changed = text();
    changed.replace(changed.find("stop: 1.2"), 9, "stop: 3");
    std::ofstream(file()) << changed;
    service->tick();
    EXPECT_EQ(checked()["revision"], 1);
    EXPECT_EQ(result("undo")["can_redo"], true);
    EXPECT_NE(text().find("stop: 1.2"), std::string::npos);
}

TEST_F(ServiceTest, AnswersGarbageWithAnErrorOfJsonRpc) {
    const auto code = [&](const std::string& request) {
        return Json::parse(service->answer(1, request))["error"]["code"].get<int>();
    };
    EXPECT_EQ(code("{"), -32700);
    EXPECT_EQ(code("\xff\xfe"), -32700);
    EXPECT_EQ(code("[]"), -32600);
    EXPECT_EQ(code("{}"), -32600);
    EXPECT_EQ(code(std::string(100000, '[')), -32600);
    EXPECT_EQ(code(R"({"method": "destroy"})"), -32601);
    EXPECT_EQ(code(R"({"method": "draw", "params": {"system": 3}})"), -32602);
    EXPECT_EQ(code(R"({"method": "draw", "params": {"systen": ""}})"), -32602);
    EXPECT_EQ(code(R"({"method": "run", "params": {"action": "explode"}})"), -32602);
    EXPECT_EQ(code(R"({"method": "tune", "params": {"name": "a", "values": ["b"]}})"), -32602);
    EXPECT_EQ(refusal("run", {{"action", "explode"}}),
              "run: 'action' takes one of start, pause, step, stop, to, pace, until, branch, adopt, "
              "emergency_stop, not \"explode\"");
}

TEST_F(ServiceTest, TellsWhereBlocksPortsAndWiresStandInTheText) {
    std::ofstream(file()) << "model: places\n"
                             "step: 0.1\n"
                             "blocks:\n"
                             "  law:\n"
                             "    inputs: [e, r]\n"
                             "    outputs: [u]\n"
                             "    blocks:\n"
                             "      gain: {block: Gain, K: 2}   # N/m\n"
                             "\n"
                             "      # of both\n"
                             "      sum: {block: Sum}\n"
                             "    connections:\n"
                             "      e: [gain, sum.u1]\n"
                             "      gain: sum.u2\n"
                             "      sum: u\n"
                             "# the end\n"
                             "  c: {block: Constant}\n"
                             "connections:\n"
                             "  c: [law.e, law.r]\n";
    service->tick();
    const Json found = result("text", {{"system", "law"}});
    EXPECT_EQ(found["file"], "motor.yaml");
    EXPECT_EQ(found["text"], text());
    std::vector<std::string> places;
    for (const auto& place : found["places"]) {
        std::string words = place["system"].get<std::string>() + "|" + place["path"].get<std::string>();
        if (place["from"] != "") words += " from " + place["from"].get<std::string>();
        for (const char* key : {"line", "column", "last"})
            words += " " + std::to_string(place[key].get<int>());
        places.push_back(words);
    }
    EXPECT_EQ(places,
              (std::vector<std::string>{"|law 4 1 15", "law|law.e 5 14 5", "law|law.r 5 17 5",
                                        "law|law.u 6 15 6", "law|law.gain 8 1 8", "law|law.sum 11 1 11",
                                        "law|law.gain from e 13 11 13", "law|law.sum.u1 from e 13 17 13",
                                        "law|law.sum.u2 from gain 14 13 14", "law|law.u from sum 15 12 15",
                                        "|c 17 1 17", "|law.e from c 19 7 19", "|law.r from c 19 14 19"}));
}

TEST_F(ServiceTest, ATypedTextIsAnEditOfTheDocument) {
    checked();
    std::string wanted = text();
    const auto at = wanted.find("0.05}");
    ASSERT_NE(at, std::string::npos);
    const std::string before = text();
    wanted.replace(at, 5, "0.07}   # as typed");
    EXPECT_EQ(
        result("rewrite", {{"file", "motor.yaml"}, {"before", "another"}, {"text", wanted}})["is_outdated"],
        true);
    EXPECT_EQ(text(), before);
    const Json broken =
        result("rewrite", {{"file", "motor.yaml"}, {"before", before}, {"text", before + "]"}});
    EXPECT_EQ(broken["diagnostics"][0]["file"], "motor.yaml");
    EXPECT_GT(broken["diagnostics"][0]["line"], 1);
    EXPECT_EQ(broken["document"]["can_undo"], false);
    const Json taken = result("rewrite", {{"file", "motor.yaml"}, {"before", before}, {"text", wanted}});
    EXPECT_EQ(taken["diagnostics"], Json::array());
    EXPECT_EQ(taken["document"]["can_undo"], true);
    EXPECT_EQ(text(), wanted);
    result("undo");
    EXPECT_EQ(text(), before);
    EXPECT_NE(refusal("rewrite", {{"file", "../motor.yaml"}, {"before", ""}, {"text", before}}), "");
}

TEST_F(ServiceTest, MistakesStandAtTheirLinesAfterEditsThatMovedThem) {
    checked();
    const auto edit = [&](const Json& operation) { result("edit", {{"operation", operation}}); };
    edit({{"do", "set"}, {"path", "load"}, {"name", "after"}, {"value", "nothing"}});
    const Json first = checked()["diagnostics"][0];
    edit({{"do", "set"}, {"path", ""}, {"name", "doc"}, {"value", "a\nb\nc"}});
    const Json second = checked()["diagnostics"][0];
    EXPECT_EQ(second["message"], first["message"]);
    std::istringstream lines(text());
    std::string line;
    for (int i = 0; i < second["line"].get<int>(); ++i) std::getline(lines, line);
    EXPECT_NE(line.find("nothing"), std::string::npos) << line;
}

TEST(Protocol, OfThePageIsTheOneOfTheService) {
    EXPECT_EQ(bf::read_text_file(fs::path(BF_SOURCE_DIRECTORY) / "editor/page/src/protocol.ts"),
              Service::typescript())
        << "run scripts/update-reference";
}

TEST_F(ServiceTest, MakesASceneWhenAPageLooksAndAnotherForAnotherModel) {
    EXPECT_EQ(result("scene")["number"], 0) << "nothing is known before the first check";
    EXPECT_FALSE(checked().is_null());
    EXPECT_EQ(scenes, 0);
    const Json scene = result("scene", {{"is_wanted", true}});
    EXPECT_EQ(scene["worlds"][0]["path"], "world");
    EXPECT_EQ(scene["worlds"][0]["bodies"], Json({"body"}));
    const std::string number = std::to_string(scene["number"].get<int>());
    EXPECT_EQ(service->data("meshes/" + number + "/0"), "meshes of load.y");
    for (const std::string& other :
         {number + "/1", std::string("9/0"), number, std::string("../../etc/passwd"), std::string()})
        EXPECT_FALSE(service->data("meshes/" + other)) << other;
    EXPECT_EQ(result("scene")["number"], scene["number"]);
    EXPECT_EQ(scenes, 1);
    result("run", {{"action", "step"}});
    EXPECT_EQ(result("scene")["number"], scene["number"]) << "the run is of the same model";
    result("scene", {{"is_wanted", false}});
    EXPECT_EQ(result("scene", {{"is_wanted", false}})["worlds"], Json::array());
}

TEST_F(ServiceTest, SaysWhyThereIsNoScene) {
    broken_scene = 1;
    EXPECT_FALSE(checked().is_null());
    EXPECT_EQ(result("scene")["failure"], "no mesh 'arm.stl'");
    EXPECT_EQ(result("scene")["worlds"], Json::array());
}

TEST_F(ServiceTest, TellsPanelsThatThePlotsAndTheLayoutHave) {
    const Json plots = checked()["panels"];
    ASSERT_FALSE(plots.empty());
    EXPECT_EQ(plots[0]["shows"], "lines");
    EXPECT_EQ(plots[0]["is_kept"], false);
    const std::string before = text(), name = plots[0]["name"];
    result("edit", {{"operation",
                     {{"do", "watch"},
                      {"name", name},
                      {"display", {{"shows", "bars"}, {"signals", Json::array({{{"path", "load.y"}}})}}}}}});
    const Json kept = checked()["panels"];
    EXPECT_NE(text().find("{shows: bars, signals: [load.y]}"), std::string::npos) << text();
    EXPECT_EQ(kept.size(), plots.size());
    EXPECT_EQ(kept[0], Json({{"name", name}, {"shows", "bars"}, {"signals", {"load.y"}}, {"is_kept", true}}));
    EXPECT_EQ(result("undo")["panels"], plots);
    EXPECT_EQ(text(), before);
}

TEST_F(ServiceTest, OpensRecordingsOfItsFolderAlone) {
    write_recording("run.mcap");
    EXPECT_EQ(result("recordings")["files"], Json({"run.mcap"}));
    const Json recorded = read("run.mcap");
    EXPECT_EQ(recorded["failure"], "");
    EXPECT_EQ(recorded["end"], 2.5);
    EXPECT_EQ(recorded["signals"][0]["path"], "motor.omega");
    EXPECT_EQ(recorded["signals"][0]["unit"], "rad/s");
    const auto data = service->data("recordings/" + recorded["number"].dump() + "/0");
    ASSERT_TRUE(data);
    ASSERT_EQ(data->size(), 2U * 28);
    double second[2];
    std::memcpy(second, data->data() + 40, 16);
    EXPECT_EQ(second[0], 2.5) << "time";
    EXPECT_EQ(second[1], 2.5) << "value";
    EXPECT_FALSE(service->data("recordings/7/0"));
    EXPECT_FALSE(service->data("recordings/run.mcap"));
    EXPECT_FALSE(service->data(""));
    EXPECT_EQ(refusal("read", {{"file", "../run.mcap"}}),
              "the file '../run.mcap' is not in the opened folder; start bf edit with that folder");
    EXPECT_NE(read("motor.yaml")["failure"].get<std::string>().find("is no recording"), std::string::npos);
}

TEST_F(ServiceTest, GivesUpARecordingThatIsClosedOrWhosePageLeaves) {
    write_recording("run.mcap");
    std::vector<int> numbers;
    for (int i = 0; i < 4; ++i)
        numbers.push_back(result("read", {{"file", "run.mcap"}})["number"].get<int>());
    result("close", {{"number", numbers[1]}});
    page = 2;
    const int other = result("read", {{"file", "run.mcap"}})["number"].get<int>();
    service->leave(1);
    EXPECT_EQ(told_of(other)["failure"], "");
    for (const auto& note : told)
        EXPECT_TRUE(note["method"] != "recorded" || note["params"]["number"] == other) << note;
    for (const int number : numbers)
        EXPECT_FALSE(service->data("recordings/" + std::to_string(number) + "/0"));
    result("close", {{"number", other}});
    EXPECT_FALSE(service->data("recordings/" + std::to_string(other) + "/0"));
}

TEST_F(ServiceTest, KeepsTheLastEightRecordings) {
    write_recording("run.mcap");
    std::vector<std::string> places;
    for (int i = 0; i < 9; ++i) places.push_back("recordings/" + read("run.mcap")["number"].dump() + "/0");
    EXPECT_FALSE(service->data(places[0]));
    for (int i = 1; i < 9; ++i) EXPECT_TRUE(service->data(places[static_cast<std::size_t>(i)])) << i;
}

TEST_F(ServiceTest, TellsTheLimitsOfWhatMayBeTuned) {
    EXPECT_FALSE(checked().is_null());
    result("edit", {{"operation",
                     {{"do", "set_variable"},
                      {"system", ""},
                      {"name", "k"},
                      {"variable", {{"value", "2"}, {"above", "0"}, {"maximum", "2*5"}}}}}});
    EXPECT_FALSE(checked().is_null());
    const Json variables = result("variables", {{"system", ""}})["variables"];
    for (const auto& variable : variables)
        if (variable["name"] == "k") {
            EXPECT_EQ(variable["least"], 0);
            EXPECT_EQ(variable["greatest"], 10);
            return;
        }
    FAIL();
}

TEST_F(ServiceTest, TellsTheTimeOfBlocksWhileAPageWantsToKnow) {
    EXPECT_FALSE(checked().is_null());
    EXPECT_EQ(result("times")["blocks"], Json::array()) << "nothing runs";
    result("run", {{"action", "step"}});
    EXPECT_FALSE(result("times")["blocks"].empty());
    for (int i = 0; i < 3; ++i) result("run", {{"action", "step"}});
    const Json times = result("times")["blocks"];
    double sum = 0;
    for (const auto& block : times) {
        sum += block["seconds"].get<double>();
        if (block["path"] == "load") {
            EXPECT_GE(block["calls"], 3);
        }
    }
    EXPECT_GT(sum, 0);
    EXPECT_EQ(result("times", {{"is_wanted", false}})["blocks"], Json::array());
}

} // namespace
