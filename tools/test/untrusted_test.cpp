// Models, recordings and folders of strangers: nothing runs, hangs or is lost that nobody agreed to.
#include "command.hpp"

#include <cstdint>
#include <sys/stat.h>

namespace bf::tools {

namespace {

class Untrusted : public Command {
  protected:
    /// A plugin that tells, when it is opened, that its code ran.
    void make_plugin(const std::string& name) const {
        write("evil.c", "#include <stdio.h>\n__attribute__((constructor)) static void run(void) {\n"
                        "    FILE* f = fopen(\"" +
                            (folder / "ran").string() + "\", \"w\");\n    if (f) fclose(f);\n}\n");
        ASSERT_EQ(shell("cc -shared -fPIC evil.c -o " + name + " && rm evil.c").code, 0);
    }
};

TEST_F(Untrusted, DocumentsNamePluginsAndNoPaths) {
    make_plugin("Evil.so");
    std::filesystem::copy_file(folder / "Evil.so", folder / "evil");
    const std::string path = (folder / "evil").string();
    for (const std::string& plugins : {"[" + path + "]", std::string("[./evil]"), std::string("[Evil]")}) {
        write("m.yaml",
              "model: m\nplugins: " + plugins + "\nstep: 1\nstop: 1\nblocks: {c: {block: Constant}}\n");
        for (const std::string verb : {"check", "run"}) EXPECT_EQ(bf(verb + " m.yaml").code, 1) << plugins;
    }
    write("m.yaml", "model: m\nplugins: [" + path + "]\nstep: 1\nblocks: {c: {block: Constant}}\n");
    EXPECT_CONTAINS(bf("check m.yaml").err,
                    "m.yaml:2:11: the plugin '" + path +
                        "' is a path; give its name only, and its folder as `bf --plugin-path FOLDER`");
    write("m.yaml",
          "model: m\nstep: 1\nblocks: {c: {block: " + path + "/Block}, d: {block: ../Evil/Block}}\n");
    EXPECT_EQ(bf("check m.yaml").code, 1);
    // Not even where its folder is known, before the document is right.
    write("m.yaml",
          "model: m\nplugins: [Evil]\nstep: 1\nblocks: {c: {block: Constant}}\nconnections: {x: c}\n");
    EXPECT_CONTAINS(bf("check m.yaml --plugin-path .").err, "there is no 'x' to connect");
    EXPECT_FALSE(exists("ran"));

    write("m.yaml", "model: m\nplugins: [Evil]\nstep: 1\nblocks: {c: {block: Constant}}\n");
    EXPECT_CONTAINS(bf("check m.yaml --plugin-path .").err, "has no symbol bf_plugin_v1");
    EXPECT_TRUE(exists("ran")) << "the user said where plugins are";
    EXPECT_EQ(bf("check m.yaml --plugin-path nowhere").code, 2);
}

TEST_F(Untrusted, RecordingsOpenNoPluginByItsPath) {
    make_plugin("evil");
    write("m.yaml", sine_model);
    bf("run m.yaml --record r.mcap");
    std::string recording = read("r.mcap");
    const std::string line = "model: sine\nstep: 0.01\n", instead = "plugins: [./evil]\nmodel: s";
    for (auto at = recording.find(line); at != std::string::npos; at = recording.find(line, at + 1))
        recording.replace(at, line.size(), (instead + std::string(line.size(), '\n')).substr(0, line.size()));
    std::ofstream(folder / "e.mcap", std::ios::binary) << recording;
    EXPECT_EQ(bf("replay e.mcap").code, 1);
    EXPECT_FALSE(exists("ran"));
}

TEST_F(Untrusted, ProgramsTakeLibrariesFromNoFolderThatAnybodyChooses) {
    const auto path_of = [&](const std::string& file) {
        return shell("readelf -d '" + file + "' | sed -n 's/.*R.*PATH.*\\[\\(.*\\)\\]/\\1/p'").out;
    };
    const auto build = std::filesystem::path(BF_PROGRAM).parent_path().parent_path();
    for (const auto& file :
         {std::filesystem::path(BF_PROGRAM), build / "lib/blockfactory/WholeBodyToolbox.so"}) {
        std::istringstream folders(path_of(file.string()).substr(0, path_of(file.string()).find('\n')));
        int count = 0;
        for (std::string one; std::getline(folders, one, ':'); ++count) {
            EXPECT_FALSE(one.empty()) << file << ": an empty entry is the folder it is started in";
            EXPECT_TRUE(one.starts_with("$ORIGIN") || one.find("/site-packages/") != std::string::npos)
                << file << ": " << one;
        }
        EXPECT_GT(count, 1);
        EXPECT_NE(path_of(file.string()).substr(path_of(file.string()).size() - 2), ":\n");
    }
    // The folder of the build is known to no text of the program.
    EXPECT_EQ(shell("grep -c '" + (build / "lib").string() + "' '" BF_PROGRAM "'").out, "0\n");
}

TEST_F(Untrusted, WhatStandsInTheWayIsNotDeletedOrWrittenThrough) {
    write("sine.yaml", sine_model);
    for (const char* name : {".pkg.part", "pkg.part", ".code.part"}) {
        std::filesystem::create_directory(folder / name);
        write(std::string(name) + "/thesis.txt", "years of work");
    }
    write("victim", "mine");
    for (const char* name : {".s.part.json", ".t.part.csv", ".t.csv.part", ".p.part.png"})
        std::filesystem::create_symlink("victim", folder / name);
    EXPECT_EQ(bf("deploy sine.yaml -o pkg").code, 0);
    EXPECT_EQ(bf("generate sine.yaml -o code").code, 0);
    EXPECT_EQ(bf("run sine.yaml --summary s.json --record r.mcap").code, 0);
    EXPECT_EQ(bf("export r.mcap -o t.csv").code, 0);
    for (const char* name : {".pkg.part", "pkg.part", ".code.part"})
        EXPECT_EQ(read(std::string(name) + "/thesis.txt"), "years of work");
    EXPECT_EQ(read("victim"), "mine");

    std::filesystem::create_directory(folder / "empty");
    std::filesystem::create_directory_symlink("empty", folder / "link");
    EXPECT_EQ(bf("generate sine.yaml -o link").code, 0);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_TRUE(exists("empty/CMakeLists.txt"));
}

TEST_F(Untrusted, FilesThatUseEachOtherAreBounded) {
    for (int i = 0; i < 12; ++i) {
        std::string text = "model: f\nstep: 0.1\nstop: 1\nblocks:\n";
        for (int k = 0; k < 9; ++k)
            text += "  b" + std::to_string(k) +
                    (i < 11 ? ": {file: f" + std::to_string(i + 1) + ".yaml}\n" : ": {block: Constant}\n");
        write("f" + std::to_string(i) + ".yaml", text);
    }
    const auto check = shell("ulimit -v 6000000; '" BF_PROGRAM "' check f0.yaml");
    EXPECT_EQ(check.code, 1);
    EXPECT_CONTAINS(check.err, "the model has more than 250000 blocks and subsystems");
}

TEST_F(Untrusted, ParametersHaveAnEnd) {
    write("m.yaml", sine_model);
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    for (const std::string file : {"/dev/zero", "pipe"}) {
        const auto run = bf("run m.yaml --params " + file);
        EXPECT_EQ(run.code, 1);
        EXPECT_CONTAINS(run.err, "cannot read " + file + ": it is no regular file");
    }
}

/// Seconds of the processor after which a process is ended: far more than a linear reader takes, and far less
/// than one that looks at all pairs.
const std::string hang_guard = "ulimit -t 100; ";

/// A number in the bytes of an MCAP file.
template <class T> T& number_at(std::string& bytes, std::size_t at) {
    return *reinterpret_cast<T*>(&bytes[at]);
}

/// The recording as somebody who edits it would leave it: without checksums. Gives the places of the time
/// stamps of all messages. (Records are an opcode, a length and a content: mcap.dev/spec.)
std::vector<std::size_t> edit(std::string& file) {
    std::vector<std::size_t> times;
    for (std::size_t at = 8; at + 9 <= file.size() - 8;) {
        const auto opcode = static_cast<unsigned char>(file[at]);
        const std::size_t content = at + 9, length = number_at<std::uint64_t>(file, at + 1);
        const std::size_t crc = opcode == 0x06   ? content + 24
                                : opcode == 0x0f ? content
                                : opcode == 0x02 ? content + 16
                                : opcode == 0x09 ? content + length - 4
                                                 : 0;
        if (crc) number_at<std::uint32_t>(file, crc) = 0;
        at = content + length;
        if (opcode != 0x06) continue;
        const std::size_t compression = number_at<std::uint32_t>(file, content + 28);
        for (std::size_t in = content + 32 + compression + 8; in < at;
             in += 9 + number_at<std::uint64_t>(file, in + 1))
            if (file[in] == 0x05) times.push_back(in + 9 + 6);
    }
    return times;
}

TEST_F(Untrusted, TextsDoNotWriteOverOthersOnATerminal) {
    write("m.yaml",
          "model: \"\\e[2Jm\"\nstep: 1\nvariables: {k: {value: 1, doc: \"\\e[8mhidden\"}}\nblocks: {g: "
          "{block: Constant, value: k}}\n");
    const auto check = bf("check m.yaml");
    EXPECT_EQ(check.code, 0) << check.err;
    EXPECT_CONTAINS(check.out, "<1b>[2Jm: 1 blocks");
    EXPECT_CONTAINS(check.out, "<1b>[8mhidden");
    const auto run = bf("run m.yaml");
    EXPECT_CONTAINS(run.err, "<1b>[2Jm does not say when it ends");
    EXPECT_EQ((check.out + run.err).find('\x1b'), std::string::npos);
}

TEST_F(Untrusted, EditedRecordingsAreTold) {
    write("m.yaml", sine_model);
    bf("run m.yaml --record r.mcap");
    const auto whole = bf("replay r.mcap");
    EXPECT_EQ(whole.code, 0);
    EXPECT_EQ(whole.err, "");
    std::string file = read("r.mcap");
    const auto times = edit(file);
    ASSERT_GT(times.size(), 10u);
    std::ofstream(folder / "e.mcap", std::ios::binary) << file;
    for (const std::string verb : {"replay e.mcap", "export e.mcap -o e.csv", "plot e.mcap"})
        EXPECT_EQ(bf(verb).err,
                  "bf: parts of e.mcap have no checksum, so nobody can tell whether they were changed\n");
}

TEST_F(Untrusted, ADamagedTimeStampMakesNoReplayEndless) {
    write("m.yaml", sine_model);
    bf("run m.yaml --record r.mcap");
    std::string file = read("r.mcap");
    const auto times = edit(file);
    const auto replayed = [&](std::int64_t time) {
        number_at<std::int64_t>(file, times.back()) = time;
        std::ofstream(folder / "e.mcap", std::ios::binary) << file;
        return shell(hang_guard + "'" BF_PROGRAM "' replay e.mcap");
    };
    const auto late = replayed(9'000'000'000'000'000'000);
    EXPECT_EQ(late.code, 1);
    EXPECT_CONTAINS(late.err,
                    "the recording is damaged: it has a sample at 9e+09 s, but the run ends at 1 s");
    EXPECT_CONTAINS(replayed(5).err, "go back; what follows is left out");

    write("m.yaml", "model: m\nstep: 0.01\nstop: Inf\nblocks: {c: {block: Clock}}\n");
    bf("run m.yaml --stop Inf --until 'c > 0.5' --record r.mcap");
    file = read("r.mcap");
    const auto endless = edit(file);
    ASSERT_GT(endless.size(), 10u);
    number_at<std::int64_t>(file, endless.back()) = 9'000'000'000'000'000'000;
    std::ofstream(folder / "e.mcap", std::ios::binary) << file;
    EXPECT_CONTAINS(shell(hang_guard + "'" BF_PROGRAM "' replay e.mcap").err,
                    "the recording is damaged: it has no sample between ");
}

TEST_F(Untrusted, DocumentsAreReadInATimeThatGrowsWithTheirSize) {
    std::string text = "model: m\nstep: 1\nblocks:\n", connections = "connections:\n", overrides;
    for (int i = 0; i < 20000; ++i) {
        const std::string n = std::to_string(i);
        text += "  b" + n + ": {block: Unknown" + n + "}\n";
        connections += "  nothing" + n + ": c" + n + "\n";
        overrides += "nowhere" + n + ": 1\n";
    }
    write("blocks.yaml", text);
    write("connections.yaml", text + connections);
    write("overrides.yaml", overrides);
    write("small.yaml", sine_model);
    text = "model: m\nstep: 1\nstop: 1\nblocks: {c: {block: Constant}}\nvariables:\n";
    for (int i = 0; i < 200000; ++i) text += "  v" + std::to_string(i) + ": 1\n";
    write("variables.yaml", text);
    std::string unknown = "blocks:\n";
    for (int i = 0; i < 20000; ++i)
        unknown += "  b" + std::to_string(i) + ": {block: Constant, value: u" + std::to_string(i) + "}\n";
    write("unknown.yaml", "model: m\nstep: 1\nstop: 1\n" + text.substr(text.find("variables:")) + unknown);
    text = "model: m\nstep: 1\nstop: 1\nblocks: {c: {block: Constant}, s: {block: Sum, signs: " +
           std::string(50000, '+') + "}}\nconnections:\n  c: [s.u1";
    for (int i = 2; i <= 50000; ++i) text += ", s.u" + std::to_string(i);
    write("sum.yaml", text + "]\n");
    const auto check = [&](const std::string& arguments) {
        return shell(hang_guard + "'" BF_PROGRAM "' check " + arguments);
    };
    EXPECT_CONTAINS(check("unknown.yaml").err, "20000 errors");
    EXPECT_EQ(check("sum.yaml").code, 0);
    const std::string sum = "1" + std::string(300000, '+');
    write("long.yaml", "model: m\nstep: 1\nblocks: {c: {block: Constant, value: " + sum + "}}\n");
    EXPECT_LT(check("long.yaml").err.size(), 10000u);
    const auto blocks = check("blocks.yaml");
    EXPECT_EQ(blocks.code, 1);
    EXPECT_CONTAINS(blocks.err, "b0: there is no block 'Unknown0'");
    EXPECT_CONTAINS(blocks.err, "20000 errors");
    EXPECT_CONTAINS(check("connections.yaml").err, "there is no 'c0' to connect");
    EXPECT_CONTAINS(check("small.yaml --params overrides.yaml").err, "20000 errors");
    EXPECT_EQ(check("variables.yaml").code, 0);
}

} // namespace

} // namespace bf::tools
