// What pages see of charts, masks, images, parameters and earlier versions.
#include "asking.hpp"
#include "bf/base/files.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sstream>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class LookTest : public bf::service::AskingTest {
  protected:
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder / name) << text;
    }
    std::string read(const std::string& name) {
        settle();
        return bf::read_text_file(folder / name);
    }
    Json element(const Json& drawing, const std::string& path) {
        for (const auto& e : drawing["elements"])
            if (e["path"] == path) return e;
        ADD_FAILURE() << "nothing is drawn of " << path;
        return {};
    }
    Json edit(const Json& operation) { return result("edit", {{"operation", operation}}); }
    Json field(const Json& inspection, const std::string& name) {
        for (const auto& f : inspection["fields"])
            if (f["name"] == name) return f;
        return {};
    }
    bool git(const std::string& what) const {
        return std::system(("cd '" + folder.string() +
                            "' && git -c user.name=a -c user.email=a@b -c commit.gpgsign=false " + what +
                            " > /dev/null 2>&1")
                               .c_str()) == 0;
    }
    void open_checked() {
        open("m.yaml");
        ASSERT_FALSE(checked().is_null()) << "the model is not checked";
    }
};

TEST_F(LookTest, VariablesAndFieldsOfStructsTellWhatIsWrongAndAreSetInMasks) {
    write("part.yaml", "model: part\nvariables:\n  Gain: {Kp: {value: 1, maximum: 5, unit: V}, Kd: 2}\n"
                       "outputs: [y]\nblocks: {c: {block: Constant, value: Gain.Kp*Gain.Kd}}\n"
                       "connections: {c: y}\n");
    write("m.yaml", "model: m\nstep: 0.1\nvariables: {k: {value: 7, maximum: 5}, ok: 1}\n"
                    "blocks:\n  part: {file: part.yaml}\n  sink: {block: Terminator}\n"
                    "connections: {part: sink}\n");
    open_checked();
    const Json variables = result("variables", {{"system", ""}})["variables"];
    EXPECT_EQ(variables[0]["mistake"], "variable 'k' must be at most 5, but is 7");
    EXPECT_EQ(variables[1]["mistake"], "");
    Json gain = field(result("inspect", {{"path", "part"}}), "Gain.Kp");
    EXPECT_EQ(gain["initial"], "1");
    EXPECT_EQ(gain["unit"], "V");
    EXPECT_TRUE(gain["text"].is_null());
    edit({{"do", "set"}, {"path", "part"}, {"name", "Gain.Kp"}, {"value", "3"}});
    EXPECT_NE(read("m.yaml").find("part: {file: part.yaml, with: {Gain: {Kp: 3}}}"), std::string::npos);
    EXPECT_EQ(field(result("inspect", {{"path", "part"}}), "Gain.Kp")["text"], "3");
    edit({{"do", "set_variable"}, {"system", ""}, {"name", "k"}, {"variable", {{"value", "4"}}}});
    ASSERT_TRUE(checked()["diagnostics"].empty());
    EXPECT_EQ(field(result("inspect", {{"path", "part"}}), "Gain.Kp")["value"], "3");
    EXPECT_EQ(field(result("inspect", {{"path", "part"}}), "Gain.Kd")["value"], "2") << "of the file";
}

TEST_F(LookTest, AVariableTellsWhatUsesIt) {
    write("m.yaml",
          "model: m\nstep: 0.1\nvariables: {k: 7, twice: 2*k, Gain: {Kp: 3}, T: 0.2, idle: 1}\nblocks:\n"
          "  one: {block: Constant, value: k + k}\n"
          "  inner:\n    period: T\n    blocks: {two: {block: Constant, value: \"[k Gain.Kp]\"}}\n");
    open_checked();
    std::map<std::string, Json> users;
    const Json variables = result("variables", {{"system", ""}})["variables"];
    for (const auto& variable : variables) users[variable["name"]] = variable["used_by"];
    EXPECT_EQ(users.at("k"), (Json{"twice", "one", "inner.two"}));
    EXPECT_EQ(users.at("Gain.Kp"), Json::array({"inner.two"}));
    EXPECT_EQ(users.at("T"), Json::array({"inner"}));
    EXPECT_EQ(users.at("idle"), Json::array());
    EXPECT_EQ(users.at("twice"), Json::array());
}

TEST_F(LookTest, PagesSeeTheCodeThatIsGeneratedAndWhichBlockBecameWhichLines) {
    write("m.yaml", "model: m\nstep: 0.1\nblocks:\n  law:\n    outputs: [y]\n    blocks:\n"
                    "      noise: {block: Constant, value: 3}\n      twice: {block: Gain, K: 2}\n"
                    "    connections: {noise: twice, twice: y}\n  sink: {block: Terminator}\n"
                    "connections: {law: sink}\n");
    open_checked();
    for (const char* language : {"cpp", "c"}) {
        const Json code = result("generate", {{"language", language}});
        const std::string name = code["files"][0]["name"], text = code["files"][0]["text"];
        EXPECT_EQ(name, std::string("m.") + language) << "with most of the blocks";
        for (const auto& file : code["files"])
            EXPECT_FALSE(file["name"].get<std::string>().starts_with("include/"));
        std::istringstream lines(text);
        std::vector<std::string> all;
        for (std::string line; std::getline(lines, line);) all.push_back(line);
        bool is_there = false;
        for (const auto& place : code["places"])
            if (place["path"] == "law.twice" && place["file"] == name) {
                is_there = true;
                EXPECT_NE(all.at(place["first"].get<std::size_t>() - 1).find("law_twice_y = "),
                          std::string::npos);
            }
        EXPECT_TRUE(is_there) << code["places"];
    }
    edit({{"do", "add"}, {"system", ""}, {"block", {{"name", "sort"}, {"type", "Sort"}}}});
    checked();
    EXPECT_EQ(refusal("generate").substr(0, 23), "the model has mistakes:");
    edit({{"do", "add"},
          {"system", ""},
          {"block",
           {{"name", "many"},
            {"type", "Constant"},
            {"settings", {{{"name", "value"}, {"value", {{"text", "1:40"}}}}}}}}});
    edit({{"do", "connect"}, {"system", ""}, {"from", "many"}, {"to", "sort"}});
    ASSERT_TRUE(checked()["diagnostics"].empty());
    EXPECT_EQ(refusal("generate", {{"language", "c"}}).substr(0, 35), "no C code can be generated for 'm',");
    EXPECT_EQ(refusal("generate"), "");
    EXPECT_EQ(ask("generate", {{"language", "rust"}})["error"]["code"], -32602);
}

TEST_F(LookTest, AMovedStateKeepsTheOthersWhereTheyAreSeen) {
    write("m.yaml",
          "model: m\nstep: 0.1\nblocks:\n  machine:\n    block: StateMachine\n    states: [idle, move]\n"
          "    transitions: [1 2 0 1; 2 1 0 1]\n");
    open_checked();
    const Json before = result("draw", {{"system", "machine"}});
    edit({{"do", "move"}, {"path", "machine.move"}, {"to", {{"x", 500}, {"y", 300}}}});
    const Json after = result("draw", {{"system", "machine"}});
    EXPECT_EQ(element(after, "machine.move")["bounds"]["x"], 500);
    EXPECT_EQ(element(after, "machine.idle")["bounds"], element(before, "machine.idle")["bounds"]);
    EXPECT_NE(read("m.yaml").find("machine.move: {x: 500, y: 300}"), std::string::npos);
    edit({{"do", "bend"}, {"path", "machine.idle.2"}, {"points", {{{"x", 400}, {"y", 400}}}}});
    EXPECT_EQ(field(result("inspect", {{"path", "machine.move.1"}}), "minimum_time")["text"], "1");
}

TEST_F(LookTest, ASubsystemShowsItsVariablesAsParametersWithUnitsAndLimits) {
    write("part.yaml",
          "model: part\ndoc: A spring.\nvariables:\n  k: {value: 2, minimum: 0, unit: N/m, doc: stiffness}\n"
          "  S: {a: 1}\nblocks:\n  gain: {block: Gain, K: k}\n");
    write("m.yaml",
          "model: m\nstep: 0.1\nvariables: {T: 3}\nblocks:\n  spring: {file: part.yaml, with: {k: T}}\n"
          "  own:\n    icon: K\n    variables: {a: 1, b: 2*a}\n    blocks:\n      one: {block: Constant, "
          "value: b}\n");
    open_checked();
    Json k = field(result("inspect", {{"path", "spring"}}), "k");
    EXPECT_EQ(k["role"], "parameter");
    EXPECT_EQ(k["text"], "T");
    EXPECT_EQ(k["initial"], "2");
    EXPECT_EQ(k["value"], "3");
    EXPECT_EQ(k["unit"], "N/m");
    EXPECT_EQ(k["least"], 0);
    EXPECT_NE(k["doc"].get<std::string>().find("stiffness"), std::string::npos);
    EXPECT_EQ(field(result("inspect", {{"path", "spring"}}), "S.a")["initial"], "1") << "of a struct";
    edit({{"do", "set"}, {"path", "spring"}, {"name", "k"}, {"value", "2*T"}});
    EXPECT_NE(read("m.yaml").find("with: {k: 2*T}"), std::string::npos);
    edit({{"do", "set"}, {"path", "spring"}, {"name", "k"}});
    EXPECT_EQ(read("m.yaml").find("with"), std::string::npos) << read("m.yaml");
    edit({{"do", "set"}, {"path", "own"}, {"name", "b"}, {"value", "3*a"}});
    EXPECT_NE(read("m.yaml").find("variables: {a: 1, b: 3*a}"), std::string::npos);
    EXPECT_EQ(result("evaluate", {{"path", "own"}, {"name", "b"}, {"text", "5*a"}})["value"], "5");
    const std::string wrong =
        refusal("edit", {{"operation", {{"do", "set"}, {"path", "spring"}, {"name", "kk"}, {"value", "1"}}}});
    EXPECT_NE(wrong.find("m.yaml:5:3: spring: there is no 'kk' to set here; did you mean 'k'?"), wrong.npos)
        << wrong;
}

TEST_F(LookTest, ListsAllParametersByBlock) {
    write("m.yaml",
          "model: m\nstep: 0.1\nvariables: {K: 3}\nblocks:\n  inner:\n    variables: {a: 1}\n    blocks:\n"
          "      gain: {block: Gain, K: 2*K}\n      end: {block: Terminator}\n");
    open_checked();
    const Json blocks = result("parameters")["blocks"];
    ASSERT_EQ(blocks.size(), 3u) << blocks.dump();
    EXPECT_EQ(blocks[0]["path"], "");
    EXPECT_EQ(blocks[1]["path"], "inner");
    EXPECT_EQ(blocks[2]["path"], "inner.gain");
    EXPECT_EQ(blocks[2]["fields"][0]["text"], "2*K");
    EXPECT_EQ(blocks[2]["fields"][0]["value"], "6");
    edit({{"do", "set"}, {"path", ""}, {"name", "K"}, {"value", "4"}});
    EXPECT_NE(read("m.yaml").find("variables: {K: 4}"), std::string::npos);
}

constexpr const char* png_begin = "\x89PNG\r\n\x1a\n";

TEST_F(LookTest, ShowsImagesOfTheFolderAndNoOtherFile) {
    write("arm.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='10' height='10'/>");
    write("arm.png", png_begin);
    write("fake.png", "no image");
    write("secret.txt", "secret");
    std::ofstream(folder.parent_path() / "outside.svg") << "<svg/>";
    fs::create_symlink(folder.parent_path() / "outside.svg", folder / "link.svg");
    write("m.yaml", "model: m\nblocks: {a: {block: Constant}}\nlayout:\n  notes:\n"
                    "    right: {text: the arm, image: arm.svg, x: 1, y: 2, width: 30, height: 40}\n"
                    "    fake: {image: fake.png, x: 1, y: 2}\n    text: {image: secret.txt, x: 1, y: 2}\n"
                    "    out: {image: ../outside.svg, x: 1, y: 2}\n    link: {image: link.svg, x: 1, y: 2}\n"
                    "    gone: {image: gone.svg, x: 1, y: 2}\n");
    open("m.yaml");
    const Json drawing = result("draw", {{"system", ""}});
    const Json right = element(drawing, "right");
    EXPECT_EQ(right["shapes"][0]["kind"], "image");
    EXPECT_EQ(right["bounds"]["height"], 40);
    EXPECT_EQ(right["image"], "arm.svg");
    const std::string address = right["shapes"][0]["text"];
    EXPECT_EQ(address, "images/0.svg");
    EXPECT_EQ(service->data(address).value_or("").substr(0, 4), "<svg");
    const std::map<std::string, std::string> defects = {
        {"fake", "the image 'fake.png' holds no PNG"},
        {"text", "the image 'secret.txt' is neither a PNG nor an SVG file"},
        {"out", "the image 'outside.svg' lies outside of the folder of the model"},
        {"link", "the image 'link.svg' lies outside of the folder of the model"},
        {"gone", "the image 'gone.svg' is not there"}};
    for (const auto& [name, defect] : defects) {
        const Json wrong = element(drawing, name);
        EXPECT_EQ(wrong["marks"][0]["message"], defect);
        EXPECT_EQ(wrong["shapes"][0]["kind"], "polygon");
    }
    for (const char* what :
         {"images/1.svg", "images/0.png", "images/../secret.txt", "images/", "images/arm.svg"})
        EXPECT_FALSE(service->data(what)) << what;
    EXPECT_EQ(result("images", {{"system", ""}})["files"], Json::array({"arm.png", "arm.svg"}))
        << "only those that would be shown";
    fs::create_symlink(folder.parent_path() / "outside.yaml", folder / "link.yaml");
    std::ofstream(folder.parent_path() / "outside.yaml") << "model: outside\n";
    EXPECT_EQ(result("hello", {{"protocol", bf::service::protocol_version}})["files"],
              Json::array({"m.yaml"}));
    fs::resize_file(folder / "arm.svg", (4 << 20) + 1);
    EXPECT_EQ(element(result("draw", {{"system", ""}}), "right")["marks"][0]["message"],
              "the image 'arm.svg' is larger than 4 MiB");
    EXPECT_FALSE(service->data(address)) << "it has become too large since it was drawn";
}

TEST_F(LookTest, ComparesWithAnotherFileOfTheFolder) {
    write("old.yaml", "model: m\nblocks:\n  a: {block: Constant, value: 1}\n  gone: {block: Constant}\n");
    write("m.yaml", "model: m\nblocks:\n  a: {block: Constant, value: 2}\n  new: {block: Gain}\n");
    open("m.yaml");
    const Json found = result("compare", {{"file", "old.yaml"}, {"system", ""}});
    std::vector<std::string> texts;
    for (const auto& d : found["differences"]) texts.push_back(d["text"]);
    EXPECT_EQ(texts,
              (std::vector<std::string>{"- gone: Constant", "~ a: setting value: 1 -> 2", "+ new: Gain"}));
    const auto count = [&](const char* path) {
        return std::ranges::count_if(found["drawing"]["elements"],
                                     [&](const Json& e) { return e["path"] == path; });
    };
    EXPECT_EQ(count("a"), 2);
    EXPECT_EQ(count("gone"), 1);
    EXPECT_NE(refusal("compare", {{"file", "../m.yaml"}, {"system", ""}}), "");
    EXPECT_EQ(refusal("compare", {{"file", "old.yaml"}, {"system", "b"}}),
              "there is no subsystem 'b' in either model");
}

TEST_F(LookTest, ComparesWithTheLastCommitWithTheFilesThatItHad) {
    if (!git("init")) GTEST_SKIP() << "git is missing";
    write("part.yaml", "model: part\nblocks:\n  gain: {block: Gain, K: 1}\n");
    write("m.yaml", "model: m\nblocks:\n  p: {file: part.yaml}\n");
    open("m.yaml");
    EXPECT_EQ(refusal("compare", {{"file", ""}, {"system", ""}}),
              "git has no last commit of 'm.yaml'; commit it, or compare with another file");
    ASSERT_TRUE(git("add -A") && git("commit -m one"));
    EXPECT_TRUE(result("compare", {{"file", ""}, {"system", ""}})["differences"].empty());
    edit({{"do", "set"}, {"path", "p.gain"}, {"name", "K"}, {"value", "2"}});
    const Json found = result("compare", {{"file", ""}, {"system", "p"}})["differences"];
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0]["text"], "~ p.gain: setting K: 1 -> 2");
    EXPECT_EQ(found[0]["system"], "p");
}

TEST_F(LookTest, SaysThatThereIsNoRepository) {
    if (!git("--version")) GTEST_SKIP() << "git is missing";
    const fs::path file = fs::temp_directory_path() / "bf_no_repository" / "m.yaml";
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "model: m\nblocks: {}\n";
    open(file.string());
    EXPECT_EQ(refusal("compare", {{"file", ""}, {"system", ""}}),
              "the folder '" + file.parent_path().string() +
                  "' of 'm.yaml' is in no git repository; compare with another file");
    fs::remove_all(file.parent_path());
}

TEST_F(LookTest, RefusesWhatIsNotThereOrTooFarAway) {
    write("part.yaml", "model: part\ninputs: [u]\noutputs: [y]\nblocks:\n  g: {block: Gain}\n"
                       "connections: {u: g, g: y}\n");
    write("m.yaml", "model: m\nblocks:\n  s: {block: Sum, signs: ++-}\n  p: {file: part.yaml}\n"
                    "connections: {s: p.u}\n");
    open_checked();
    const auto refused = [&](const Json& operation) { return refusal("edit", {{"operation", operation}}); };
    EXPECT_EQ(refused({{"do", "place_port"}, {"path", "s"}, {"port", "u4"}, {"side", "top"}}),
              (folder / "m.yaml").string() +
                  ":3:3: s: there is no port 'u4'; did you mean 'u1' or 'u2' or 'u3'?");
    edit({{"do", "place_port"}, {"path", "s"}, {"port", "u3"}, {"side", "top"}});
    EXPECT_NE(refused({{"do", "place_port"}, {"path", "p"}, {"port", "v"}, {"side", "top"}})
                  .find("p: there is no port 'v'"),
              std::string::npos);
    EXPECT_NE(refused({{"do", "extract"}, {"path", "p"}, {"file", ""}}).find("the block stands in the file"),
              std::string::npos);
    EXPECT_EQ(refusal("draw", {{"system", ""},
                               {"bent", {{{"path", "p.u"}, {"points", {{{"x", 1e308}, {"y", 0}}}}}}}}),
              "p.u: it cannot be drawn at [1e+308, 0]; coordinates lie between -1000000 and 1000000");
    EXPECT_EQ(
        refusal("draw", {{"system", ""}, {"moved", {{{"path", "s"}, {"to", {{"x", 0}, {"y", -2e6}}}}}}}),
        "s: it cannot be drawn at [0, -2e+06]; coordinates lie between -1000000 and 1000000");
}

TEST_F(LookTest, OffersConditionsByWhatDrivesThemAndKeepsStatesInTheirPlaces) {
    write("m.yaml", "model: m\nstep: 0.1\nblocks:\n  near: {block: Clock}\n  far: {block: Clock}\n"
                    "  all: {block: Mux, inputs: 2}\n"
                    "  m: {block: StateMachine, states: [a, b, c], transitions: [[1, 2, 2, 0]]}\n"
                    "connections: {near: all.u1, far: all.u2, all: m}\n");
    open_checked();
    const Json condition = field(result("inspect", {{"path", "m.b.1"}}), "condition");
    EXPECT_EQ(condition["choices"], Json::array({"0", "1", "2"}));
    EXPECT_EQ(condition["names"], Json::array({"none", "near", "far"}));
    EXPECT_EQ(condition["text"], "2");
    const auto places = [&] {
        Json all;
        const Json drawing = result("draw", {{"system", "m"}});
        for (const auto& e : drawing["elements"])
            if (e["kind"] == "state") all[e["path"].get<std::string>()] = e["bounds"];
        return all;
    };
    const Json before = places();
    edit({{"do", "connect"}, {"system", "m"}, {"from", "b"}, {"to", "a"}});
    edit({{"do", "set"}, {"path", "m.a.2"}, {"name", "minimum_time"}, {"value", "1234567*T"}});
    edit({{"do", "disconnect"}, {"system", "m"}, {"to", "b.1"}});
    EXPECT_EQ(places(), before);
    edit({{"do", "remove"}, {"path", "m.c"}});
    EXPECT_EQ(places()["m.b"], before["m.b"]);
    EXPECT_EQ(read("m.yaml").find("m.c"), std::string::npos) << "a place of what is gone";
}

TEST_F(LookTest, BendsAWireInTheFileThatHasIt) {
    write("part.yaml", "model: part\ninputs: [u]\noutputs: [y]\nblocks:\n  g: {block: Gain}\n"
                       "connections: {u: g, g: y}\n");
    write("m.yaml", "model: m\nblocks:\n  s: {block: Constant}\n  p: {file: part.yaml}\n"
                    "connections: {s: p.u}\n");
    open_checked();
    edit({{"do", "bend"}, {"path", "p.u"}, {"points", {{{"x", 1}, {"y", 2}}}}});
    EXPECT_NE(read("m.yaml").find("p.u: [[1, 2]]"), std::string::npos) << read("m.yaml");
    edit({{"do", "bend"}, {"path", "p.y"}, {"points", {{{"x", 3}, {"y", 4}}}}});
    EXPECT_NE(read("part.yaml").find("    y: [[3, 4]]"), std::string::npos) << read("part.yaml");
    edit({{"do", "bend"}, {"path", "p.g"}, {"points", {{{"x", 5}, {"y", 6}}}}});
    EXPECT_NE(read("part.yaml").find("    g: [[5, 6]]"), std::string::npos) << read("part.yaml");
}

TEST_F(LookTest, RunsNoProgramOfTheRepositoryToCompare) {
    if (!git("init")) GTEST_SKIP() << "git is missing";
    write("m.yaml", "model: m\nblocks:\n  a: {block: Constant}\n");
    ASSERT_TRUE(git("add -A") && git("commit -m one"));
    // An object that is missing in a partial clone would be fetched by a command of the repository's own.
    ASSERT_TRUE(git("cat-file -e HEAD:m.yaml") && git("config core.repositoryformatversion 1") &&
                git("config extensions.partialClone origin") && git("config remote.origin.promisor true") &&
                git("config remote.origin.url ssh://x/y") &&
                git("config core.sshCommand 'touch \"$PWD/ran\";'"));
    fs::remove_all(folder / ".git/objects");
    fs::create_directories(folder / ".git/objects");
    git("cat-file blob HEAD:m.yaml");
    ASSERT_TRUE(fs::remove(folder / "ran")) << "the repository does not lead git to run it";
    open("m.yaml");
    EXPECT_NE(refusal("compare", {{"file", ""}, {"system", ""}}), "");
    EXPECT_FALSE(fs::exists(folder / "ran"));
}

TEST_F(LookTest, SaysWhichWatchedPathsAreNoSignals) {
    write("m.yaml", "model: m\nstep: 0.1\nstop: 1\nblocks:\n  a: {block: Constant}\n");
    open_checked();
    EXPECT_TRUE(result("watch", {{"paths", {"b.y"}}})["unknown"].empty()) << "nothing runs";
    result("run", {{"action", "step"}});
    EXPECT_EQ(result("watch", {{"paths", {"a.y", "b.y"}}})["unknown"], Json::array({"b.y"}));
}

} // namespace
