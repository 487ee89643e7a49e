#include "command.hpp"

namespace bf::tools {

namespace {

class TwoModels : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("a.yaml",
              "model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: 2}\n  s:\n    inputs: [u]\n"
              "    blocks:\n      g: {block: Gain, K: 3}\n    connections: {u: g}\nconnections: {c: s}\n");
        write(
            "b.yaml",
            "step: 1\nmodel: m # the same\nblocks:\n  d: {block: Constant, value: 2}\n  s:\n    inputs: [u]\n"
            "    blocks:\n      g: {block: Gain, K: 4}\n    connections: {u: g}\nconnections: {d: s}\n");
    }
};

TEST_F(TwoModels, DifferencesAreToldLineByLineAndMakeTheCommandFail) {
    const Outcome told = bf("diff a.yaml b.yaml");
    EXPECT_EQ(told.out, "~ d: renamed from c\n~ s.g: setting K: 3 -> 4\n");
    EXPECT_EQ(told.err, "bf: a.yaml and b.yaml differ\n");
    EXPECT_EQ(told.code, 1);
    EXPECT_EQ(bf("diff a.yaml a.yaml").code, 0);
    EXPECT_CONTAINS(bf("diff a.yaml b.yaml --json").out, R"("path": "s.g")");
}

TEST_F(TwoModels, APictureHasBothSideBySideWithTheDifferencesOutlined) {
    bf("diff a.yaml b.yaml -o x.svg");
    const std::string top = read("x.svg");
    EXPECT_CONTAINS(top, "<title>c, Constant, value = 2</title>");
    EXPECT_CONTAINS(top, "<title>d, Constant, value = 2</title>");
    EXPECT_CONTAINS(top, ">a.yaml</text>");
    EXPECT_CONTAINS(top, "class=\"changed\"");
    bf("diff a.yaml b.yaml -o s.svg --system s");
    EXPECT_CONTAINS(read("s.svg"), "<title>g, Gain, K = 4</title>");
    EXPECT_EQ(read("s.svg").find("<title>c, Constant"), std::string::npos);
}

TEST_F(TwoModels, ASystemOfOneOfThemStandsAlone) {
    write("c.yaml", "model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: 2}\n");
    bf("diff c.yaml a.yaml -o s.svg --system s");
    EXPECT_CONTAINS(read("s.svg"), "<title>g, Gain, K = 3</title>");
    EXPECT_CONTAINS(bf("diff a.yaml b.yaml -o x.svg --system t").err,
                    "t: there is no subsystem of that path; look at the models' blocks");
}

TEST_F(TwoModels, RefusesWhatItCannotCompare) {
    EXPECT_CONTAINS(bf("diff a.yaml nowhere.yaml").err, "nowhere.yaml");
    EXPECT_CONTAINS(bf("diff a.yaml b.yaml -o b.yaml").err, "b.yaml");
    EXPECT_EQ(bf("diff a.yaml b.yaml --system s").code, 2);
    EXPECT_EQ(bf("diff a.yaml").code, 2);
}

} // namespace

} // namespace bf::tools
