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
        const auto decoded =
            shell("python3 -c 'import base64, json, sys; model = "
                  "json.loads(sys.stdin.read()[len(\"blockfactory.model = \"):-2]); "
                  "print(json.dumps({**model, \"files\": {k: base64.b64decode(v).hex() for k, v in "
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
                    "put standard blocks in their place, or show the model as a picture");
    EXPECT_EQ(files(), "robot.yaml sine.yaml");
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
