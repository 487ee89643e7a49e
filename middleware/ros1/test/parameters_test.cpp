// Parameters of running models, which rosparam sees and changes.
#include "master.hpp"
#include "running.hpp"

#include <functional>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;

/// What rosparam prints, in one line.
std::string rosparam(std::vector<std::string> words) {
    words.insert(words.begin(), {"/usr/bin/python3", "/usr/bin/rosparam"});
    Program program(std::move(words));
    std::string all;
    for (std::string line; !(line = program.line()).empty();) all += (all.empty() ? "" : " ") + line;
    return all;
}
std::string get(const std::string& name) { return rosparam({"get", name}); }

/// Looks until it is so, for some seconds.
std::string when(const std::string& name, const std::function<bool(const std::string&)>& is_so) {
    std::string value = get(name);
    for (int k = 0; k < 40 && !is_so(value); ++k) value = get(name);
    return value;
}
std::string until(const std::string& name, const std::string& expected) {
    return when(name, [&](const std::string& value) { return value == expected; });
}
/// Sets one that the model does not take: the reason.
std::string refusal_of(const std::string& name, const std::string& value, const std::string& reason) {
    rosparam({"set", "/lab/model/" + name, value});
    return when("/lab/model_refused",
                [&](const std::string& text) { return text.find(reason) != text.npos; });
}

std::string tuned(const std::string& K) {
    return "model: tuned\nstep: 0.001\nvariables:\n  K: {value: " + K +
           ", minimum: 0, maximum: 10}\n  T: 0.002\nblocks:\n  w: {block: Constant, value: \"K*[1 2]\"}\n"
           "  s: {block: Sine, period: T}\n  a: {block: Gain, K: 3}\nconnections: {w: a}\nrecord: [a.y]\n";
}
Program run(const std::string& model, std::vector<std::string> more = {}) {
    std::vector<std::string> words{BF_PROGRAM,   "run",        model, "--stop",    "Inf",
                                   "--realtime", "--priority", "0",   "--overrun", "skip",
                                   "--quiet",    "--ros1",     "/lab"};
    words.insert(words.end(), more.begin(), more.end());
    return Program(std::move(words));
}

} // namespace

using Ros1Parameters = WithMaster;

TEST_F(Ros1Parameters, AreVariablesAndParametersOfARun) {
    const Folder folder;
    const std::string model = folder.write("tuned.yaml", tuned("2")), recording = folder.path / "run.mcap";
    rosparam({"set", "/lab/model/K", "3"});
    rosparam({"set", "/lab/model/other", "x"});
    Program running = run(model, {"--record", recording});
    EXPECT_EQ(until("/lab/model/w/value", "- 3.0 - 6.0"), "- 3.0 - 6.0") << "what was there is taken first";
    EXPECT_EQ(get("/lab/model/a/K"), "3.0");
    rosparam({"set", "/lab/model/K", "5"});
    EXPECT_EQ(until("/lab/model/w/value", "- 5.0 - 10.0"), "- 5.0 - 10.0") << "which follows from it";
    EXPECT_EQ(std::stod(get("/lab/model/K")), 5);
    rosparam({"set", "/lab/model/w/value", "[0.1, 0.7]"});
    EXPECT_EQ(until("/lab/model_refused", "''"), "''");
    EXPECT_EQ(get("/lab/model/w/value"), "- 0.1 - 0.7");

    expect_contains(refusal_of("K", "11", "10"), "10");
    EXPECT_EQ(std::stod(until("/lab/model/K", "5.0")), 5) << "it is put back";
    expect_contains(refusal_of("T", "3.0", "fixed"), " is fixed while the model runs: ");
    EXPECT_EQ(until("/lab/model/T", "0.002"), "0.002");
    expect_contains(refusal_of("K", "much", "type"), " is of type double, and is given another one");
    expect_contains(refusal_of("w/value", "[1, 2, 3]", "w.value"), "w.value");
    EXPECT_EQ(until("/lab/model/w/value", "- 0.1 - 0.7"), "- 0.1 - 0.7");
    rosparam({"delete", "/lab/model/a/K"});
    EXPECT_EQ(until("/lab/model/a/K", "3.0"), "3.0");

    EXPECT_EQ(running.end(SIGINT), 130);
    EXPECT_EQ(get("/lab/model"), "K: 3 other: x") << "what was there before";
    EXPECT_EQ(rosparam({"list", "/lab"}), "/lab/model/K /lab/model/other");
    rosparam({"delete", "/lab"});
    Program replay({BF_PROGRAM, "replay", recording});
    expect_contains(replay.line(), "identical"); // so the changes are in the recording
}

TEST_F(Ros1Parameters, AreNotThoseOfARunThatWasKilled) {
    const Folder folder;
    const std::string model = folder.write("tuned.yaml", tuned("2"));
    {
        Program killed = run(model);
        EXPECT_EQ(until("/lab/model/w/value", "- 2.0 - 4.0"), "- 2.0 - 4.0");
        killed.end(SIGKILL);
    }
    EXPECT_EQ(get("/lab/model/K"), "2.0") << "it is still there";
    rosparam({"set", "/lab/model/a/K", "7.0"});
    folder.write("tuned.yaml", tuned("4"));
    Program next = run(model);
    EXPECT_EQ(until("/lab/model/w/value", "- 4.0 - 8.0"), "- 4.0 - 8.0") << "as the file says now";
    EXPECT_EQ(get("/lab/model/a/K"), "7.0") << "what somebody has set since is taken";
    next.end(SIGINT);
    rosparam({"delete", "/lab"});
}

TEST_F(Ros1Parameters, RefuseWhatTheyCannotBe) {
    const Folder folder;
    const auto why = [&](const std::string& text) {
        Program program(
            {"/bin/sh", "-c",
             "'" BF_PROGRAM "' run '" + folder.write("m.yaml", text) + "' --stop 1 --ros1 /lab 2>&1"});
        return program.line();
    };
    expect_contains(why("model: m\nstep: 1\nvariables: {w: 1}\nblocks: {w: {block: Constant, value: 2}}\n"),
                    "'w' and 'w.value' cannot both be parameters of ROS 1; rename one of them");
    rosparam({"set", "/lab/model/T", "3.0"});
    expect_contains(why(tuned("2")),
                    "the parameters /lab/model of ROS 1: 'T' is fixed while the model runs: ");
    rosparam({"delete", "/lab"});
}

} // namespace bf::ros1::test
