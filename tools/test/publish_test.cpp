// bf publish: what a page is made of. What it does in a browser, editor/page/test/browser looks at.
#include "command.hpp"

namespace bf::tools {

namespace {

class Publish : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("sine.yaml", sine_model);
    }
    /// Does this build have what pages are made of?
    static bool has_parts() {
        return std::filesystem::exists(std::filesystem::path(BF_PROGRAM).parent_path().parent_path() /
                                       "share/blockfactory/published/engine.js");
    }
    /// The files of the page's model, decoded by another program.
    nlohmann::json published(const std::string& page) const {
        const auto decoded = shell("python3 -c 'import base64, gzip, json, sys; model = "
                                   "json.loads(sys.stdin.read()[len(\"blockfactory.model = \"):-2]); "
                                   "print(json.dumps({**model, \"files\": {k: "
                                   "gzip.decompress(base64.b64decode(v)).hex() for k, v in "
                                   "model[\"files\"].items()}}))' < " +
                                   page + "/model.js");
        return nlohmann::json::parse(decoded.out);
    }
    std::string hex(const std::string& file) const {
        std::string text;
        for (const unsigned char c : read(file))
            for (const int half : {c >> 4, c & 15}) text += "0123456789abcdef"[half];
        return text;
    }
};

TEST_F(Publish, RefusesBlocksOfPluginsByTheirPaths) {
    write("robot.yaml",
          "model: robot\nstep: 0.01\nplugins: [WholeBodyToolbox]\nblocks:\n  law:\n    blocks:\n"
          "      c: {block: Constant}\n      filter: {block: WholeBodyToolbox/DiscreteFilter}\n"
          "    connections: {c: filter}\n");
    ASSERT_EQ(bf("check robot.yaml").code, 0);
    const auto refused = bf("publish robot.yaml -o page");
    EXPECT_EQ(refused.code, 1);
    EXPECT_CONTAINS(refused.err,
                    "a published page runs the standard blocks alone, and these come from plugins:\n"
                    "  law.filter (WholeBodyToolbox/DiscreteFilter)\n"
                    "put standard blocks in their place, or give what was recorded of the model");
    EXPECT_EQ(files(), "robot.yaml sine.yaml");
}

TEST_F(Publish, TakesSubsystemsThatRunUnderConditionsAndModelsWithPorts) {
    for (const std::string kind : {"enabled", "triggered"}) {
        write("m.yaml",
              "model: m\nstep: 0.1\nstop: 1\ninputs: [u]\noutputs: [y]\nblocks:\n  c: {block: Pulse}\n"
              "  s:\n    execution: " +
                  kind +
                  "\n    inputs: [u]\n    outputs: [y]\n    blocks: {g: {block: Gain}}\n"
                  "    connections: {u: g, g: y}\nconnections: {c: s." +
                  (kind == "enabled" ? "enable" : "trigger") + ", u: s.u, s: y}\n");
        const auto done = bf("publish m.yaml -o " + kind);
        EXPECT_EQ(done.err.find("there is no block"), std::string::npos) << done.err;
        if (has_parts())
            EXPECT_EQ(done.code, 0) << done.err;
        else
            EXPECT_CONTAINS(done.err, "'make wasm' installs emscripten and builds them");
    }
}

TEST_F(Publish, RefusesAFileThatIsNamedByItsPlaceOnThisComputer) {
    write("table.csv", "time,y\n0,1\n1,2\n");
    write("m.yaml", "model: m\nstep: 0.1\nblocks:\n  c: {block: SignalFromFile, file: \"'" +
                        (folder / "table.csv").string() + "'\"}\n");
    const auto refused = bf("publish m.yaml -o page");
    EXPECT_EQ(refused.code, 1);
    EXPECT_CONTAINS(refused.err, "c: cannot publish " + (folder / "table.csv").string() +
                                     ", which is named by its place on this computer; put it beside the "
                                     "model and name it relative to that");
}

TEST_F(Publish, SaysWhatBuildsItsParts) {
    if (has_parts()) GTEST_SKIP() << "they are there";
    EXPECT_CONTAINS(bf("publish sine.yaml -o page").err, "'make wasm' installs emscripten and builds them");
    EXPECT_FALSE(exists("page"));
}

TEST_F(Publish, CarriesAllFilesOfTheModelByNamesThatSayNothingOfThisComputer) {
    if (!has_parts()) GTEST_SKIP() << "this build has no parts of published pages";
    shell("mkdir parts models");
    write("parts/table.csv", "time,y\n0,1\n1,2\n");
    write("parts/inner.yaml", "model: inner\nstep: 0.1\noutputs: [y]\nblocks:\n"
                              "  c: {block: SignalFromFile, file: table.csv}\nconnections: {c: y}\n");
    write("models/m.yaml", "model: m\nstep: 0.1\nstop: 1\nblocks:\n  a: {file: ../parts/inner.yaml}\n"
                           "  g: {block: Gain}\nconnections: {a: g}\n");
    ASSERT_EQ(bf("run models/m.yaml --quiet --record r.mcap").code, 0);
    const auto done = bf("publish models/m.yaml -o page --recording r.mcap");
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_CONTAINS(done.out, "open page/index.html in a browser");
    const auto model = published("page");
    EXPECT_EQ(model["file"], "models/m.yaml");
    EXPECT_EQ(model["files"].size(), 4u);
    for (const char* name : {"models/m.yaml", "parts/inner.yaml", "parts/table.csv"})
        EXPECT_EQ(model["files"][name], hex(name)) << name;
    EXPECT_EQ(model["files"]["models/r.mcap"], hex("r.mcap"));
    EXPECT_EQ(read("page/model.js").find(folder.string()), std::string::npos);
    for (const char* name : {"index.html", "page.js", "page.css", "engine.js"})
        EXPECT_TRUE(exists(std::string("page/") + name)) << name;
}

TEST_F(Publish, SeveralModelsHaveAPageEachAndShareTheirParts) {
    if (!has_parts()) GTEST_SKIP() << "this build has no parts of published pages";
    shell("mkdir a 'b b'");
    write("a/m.yaml", "model: first\ndoc: a < b\nstep: 0.1\nstop: 1\nblocks:\n  c: {block: Constant}\n");
    write("b b/m.yaml", "model: second\nstep: 0.1\nstop: 1\nblocks:\n  c: {block: Constant, value: 7}\n");
    ASSERT_EQ(bf("run 'b b/m.yaml' --quiet --record r.mcap").code, 0);
    const auto done = bf("publish a/m.yaml 'b b/m.yaml' -o page --recording r.mcap");
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_EQ(shell("cd page && find . -name '*.js' -o -name '*.html' -o -name '*.svg' | sort").out,
              "./a/m/index.html\n./a/m/model.js\n./a/m/model.svg\n./b b/m/index.html\n./b b/m/model.js\n./b "
              "b/m/model.svg\n"
              "./engine.js\n./icon.svg\n./index.html\n./page.js\n");
    EXPECT_EQ(published("page/a/m")["files"].size(), 1u);
    EXPECT_EQ(published("'page/b b/m'")["files"].size(), 2u);
    const std::string list = read("page/index.html"), page = read("page/b b/m/index.html");
    EXPECT_CONTAINS(
        list, "<a href=\"b%20b/m/index.html\"><img src=\"b%20b/m/model.svg\" alt=\"\" /><b>second</b></a>");
    EXPECT_CONTAINS(list, "<b>first</b></a> a &lt; b</li>");
    EXPECT_EQ(list.find("{models}"), std::string::npos);
    EXPECT_CONTAINS(page, "src=\"../../engine.js\"");
    EXPECT_CONTAINS(page, "src=\"model.js\"");
    EXPECT_EQ(page.find("{above}"), std::string::npos);
}

TEST_F(Publish, SeveralModelsAreEachGivenOnceAndARecordingIsOfOneOfThem) {
    write("other.yaml", "model: other\nstep: 0.1\nstop: 1\nblocks:\n  c: {block: Constant}\n");
    write("third.yaml", "model: third\nstep: 0.1\nstop: 1\nblocks:\n  c: {block: Constant}\n");
    EXPECT_CONTAINS(bf("publish sine.yaml other.yaml ./sine.yaml -o page").err,
                    "two models would have the page 'sine'; give each once, or rename one");
    ASSERT_EQ(bf("run third.yaml --quiet --record r.mcap").code, 0);
    EXPECT_CONTAINS(bf("publish sine.yaml other.yaml -o page --recording r.mcap").err,
                    "r.mcap is a recording of " + (folder / "third.yaml").string() +
                        ", which is not published");
    EXPECT_FALSE(exists("page"));
}

TEST_F(Publish, CarriesOfARecordingItsSignalsAlone) {
    if (!has_parts()) GTEST_SKIP() << "this build has no parts of published pages";
    ASSERT_EQ(bf("run sine.yaml --quiet --record r.mcap --checkpoint-every 0.2").code, 0);
    ASSERT_EQ(bf("publish sine.yaml -o page --recording r.mcap").code, 0);
    ASSERT_NE(read("r.mcap").find(folder.string()), std::string::npos); // where the model is
    shell("python3 -c 'import base64, json; model = "
          "json.loads(open(\"page/model.js\").read()[len(\"blockfactory.model = "
          "\"):-2]); open(\"copy.mcap\", "
          "\"wb\").write(gzip.decompress(base64.b64decode(model[\"files\"][\"r.mcap\"])))'");
    EXPECT_EQ(read("copy.mcap").find(folder.string()), std::string::npos);
    EXPECT_EQ(read("copy.mcap").find("checkpoint"), std::string::npos);
    ASSERT_EQ(bf("export r.mcap -o r.csv").code, 0);
    ASSERT_EQ(bf("export copy.mcap -o copy.csv").code, 0);
    EXPECT_EQ(read("copy.csv"), read("r.csv"));
}

TEST_F(Publish, CarriesTheImagesOfItsDrawingsAsFarAsTheyMayBeShown) {
    if (!has_parts()) GTEST_SKIP() << "this build has no parts of published pages";
    shell("mkdir m m/part && ln -s ../outside.svg m/link.svg && head -c 5000000 /dev/zero > m/large.svg");
    const std::string picture = "<svg xmlns='http://www.w3.org/2000/svg'/>";
    for (const char* name : {"outside.svg", "m/arm.svg", "m/unused.svg", "m/part/leg.svg", "m/icon.svg"})
        write(name, picture);
    write("m/fake.png", "no picture");
    write("m/secret.txt", "secret");
    write("m/part/inner.yaml",
          "model: inner\nstep: 0.1\noutputs: [y]\nblocks:\n  c: {block: Constant}\nconnections: {c: y}\n"
          "layout: {notes: {n: {image: leg.svg, x: 0, y: 0}}}\n");
    write(
        "m/m.yaml",
        "model: m\nstep: 0.1\nblocks:\n  a: {file: part/inner.yaml}\n  b:\n    icon: icon.svg\n    blocks: "
        "{}\n"
        "layout:\n  notes:\n    arm: {image: arm.svg, x: 0, y: 0}\n    fake: {image: fake.png, x: 0, y: 0}\n"
        "    text: {image: secret.txt, x: 0, y: 0}\n    out: {image: ../outside.svg, x: 0, y: 0}\n"
        "    link: {image: link.svg, x: 0, y: 0}\n    large: {image: large.svg, x: 0, y: 0}\n");
    const auto done = bf("publish m/m.yaml -o page");
    ASSERT_EQ(done.code, 0) << done.err;
    std::string names;
    const auto model = published("page"); // items() of a temporary would not live
    for (const auto& [name, text] : model["files"].items()) names += name + " ";
    EXPECT_EQ(names, "arm.svg icon.svg m.yaml part/inner.yaml part/leg.svg ");
}

TEST_F(Publish, WritesIntoNoFolderThatHoldsSomething) {
    if (!has_parts()) GTEST_SKIP() << "this build has no parts of published pages";
    shell("mkdir page && echo mine > page/index.html");
    EXPECT_CONTAINS(bf("publish sine.yaml -o page").err,
                    "the folder is not empty; empty it or name another one");
    EXPECT_EQ(read("page/index.html"), "mine\n");
}

TEST_F(Publish, AWrongModelIsNotPublished) {
    write("wrong.yaml", "model: wrong\nstep: 1\nblocks:\n  g: {block: Gain, K: nothing}\n");
    const auto refused = bf("publish wrong.yaml -o page");
    EXPECT_EQ(refused.code, 1);
    EXPECT_CONTAINS(refused.err, "wrong.yaml:4:");
    EXPECT_FALSE(exists("page"));
}

} // namespace

} // namespace bf::tools
