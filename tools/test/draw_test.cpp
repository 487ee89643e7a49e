#include "command.hpp"

namespace bf::tools {

namespace {

class Pictures : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("m.yaml",
              "model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: 2}\n  s:\n    inputs: [u]\n"
              "    blocks:\n      g: {block: Gain, K: 3}\n    connections: {u: g}\nconnections: {c: s}\n");
    }
};

TEST_F(Pictures, DrawsSvgPdfAndPng) {
    EXPECT_EQ(bf("draw m.yaml").out, "m.svg\n");
    EXPECT_CONTAINS(read("m.svg"), "<title>c, Constant, value = 2</title>");
    EXPECT_EQ(bf("draw m.yaml -o a.pdf").out, "a.pdf\n");
    EXPECT_EQ(read("a.pdf").substr(0, 5), "%PDF-");
    EXPECT_EQ(bf("draw m.yaml -o a.png --dark").out, "a.png\n");
    EXPECT_EQ(read("a.png").substr(1, 3), "PNG");
    EXPECT_EQ(files(), "a.pdf a.png m.svg m.yaml");
}

TEST_F(Pictures, DrawsOneSubsystemOrAll) {
    EXPECT_EQ(bf("draw m.yaml --system s -o s.svg").code, 0);
    EXPECT_CONTAINS(read("s.svg"), "<title>g, Gain, K = 3</title>");
    EXPECT_EQ(bf("draw m.yaml --all").out, "m.svg\nm_s.svg\n");
}

TEST_F(Pictures, AWrongModelIsDrawnWithItsMistakes) {
    write("wrong.yaml", "model: wrong\nstep: 1\nblocks:\n  g: {block: Gain, K: nothing}\n");
    const Outcome drawn = bf("draw wrong.yaml");
    EXPECT_EQ(drawn.code, 1);
    EXPECT_CONTAINS(drawn.err, "wrong.yaml:4:");
    EXPECT_CONTAINS(read("wrong.svg"), "class=\"highlight\"");
}

TEST_F(Pictures, RefusesWhatItCannotDraw) {
    EXPECT_CONTAINS(bf("draw m.yaml --system c").err,
                    "c: there is no subsystem of that path; look at the model's blocks");
    EXPECT_CONTAINS(bf("draw m.yaml -o a.gif").err,
                    "cannot tell the format of a.gif: give a name that ends in .svg, .pdf or .png");
    EXPECT_CONTAINS(bf("draw m.yaml -o m.yaml").err, "m.yaml");
    EXPECT_EQ(bf("draw m.yaml --show colours").code, 2);
    EXPECT_CONTAINS(bf("draw m.yaml -o a.png", "PATH=/nowhere").err, "rsvg-convert is missing");
    EXPECT_EQ(files(), "m.yaml");
    const std::string model = read("m.yaml");
    write("m.yaml", model + "layout:\n  blocks:\n    c: {x: 20000, y: 0}\n    s: {x: 0, y: 0}\n");
    const std::string wide = bf("draw m.yaml -o a.png").err;
    EXPECT_CONTAINS(wide, "bf: the picture would be 40");
    EXPECT_CONTAINS(wide,
                    " high, and a PNG has at most 32767; move what stands far away closer, or give a name "
                    "that ends in .svg or .pdf");
    EXPECT_EQ(bf("draw m.yaml -o a.pdf").code, 0);
    write("m.yaml", model + "layout:\n  blocks:\n    c: {x: 1e308, y: 0}\n");
    EXPECT_CONTAINS(bf("draw m.yaml").err,
                    "m.yaml:13:5: c: it is drawn at [1e+308, 0]; coordinates lie between "
                    "-1000000 and 1000000");
}

TEST_F(Pictures, TheEditorNeedsAModel) {
    shell("mkdir empty");
    EXPECT_CONTAINS(bf("edit empty").err,
                    "there is no model in the folder 'empty'; bf edit --new empty/model.yaml makes one");
    EXPECT_CONTAINS(bf("edit --new m.yaml").err, "the file 'm.yaml' exists; leave out --new to edit it");
    EXPECT_CONTAINS(bf("edit --new m.txt").err, "--new takes the name of a file that ends in .yaml");
    EXPECT_CONTAINS(shell("timeout 1 '" BF_PROGRAM "' edit --new new.yaml --no-browser").out,
                    "http://127.0.0.1:");
    EXPECT_EQ(bf("check new.yaml").code, 0);
    EXPECT_CONTAINS(bf("edit nothing.yaml --no-browser").err, "nothing.yaml");
    write("broken.yaml", "model: [");
    EXPECT_CONTAINS(bf("edit broken.yaml --no-browser").err, "broken.yaml:1:");
    EXPECT_CONTAINS(bf("edit --protocol").out, "export interface Methods {");
}

} // namespace

} // namespace bf::tools
