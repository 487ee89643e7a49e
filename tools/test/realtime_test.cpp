// bf run --realtime, as a process.
#include "command.hpp"

namespace bf::tools {

namespace {

class Realtime : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("sine.yaml", sine_model);
    }
    /// Sends a signal after half a second of an endless run.
    Outcome interrupted(const std::string& signal) const {
        return shell("'" BF_PROGRAM
                     "' run sine.yaml --realtime --priority 0 --stop Inf --record r.mcap --summary "
                     "s.json & sleep 0.5; kill -" +
                     signal + " $!; wait $!");
    }
};

TEST_F(Realtime, ReportsWhatHappened) {
    const auto run = bf("run sine.yaml --realtime --realtime-factor 5 --priority 0 --quiet --record r.mcap "
                        "--summary s.json");
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_CONTAINS(run.out, "period of 2000 us, 100 steps");
    EXPECT_CONTAINS(run.out, "wake-up latency");
    EXPECT_CONTAINS(run.out, "deadlines missed: ");
    const auto json = this->json("s.json");
    EXPECT_EQ(json["outcome"], "finished");
    EXPECT_GE(json["wall_s"].get<double>(), 0.99 * 0.2);
    const auto& realtime = json["realtime"];
    EXPECT_EQ(realtime["steps"], 100);
    EXPECT_EQ(realtime["period_us"], 2000);
    EXPECT_EQ(realtime["lost_samples_recorded"], 0);
    std::int64_t periods = 0, missed = 0;
    for (const auto& row : realtime["deviation_of_the_period"]) periods += row["count"].get<int>();
    EXPECT_EQ(periods, 99);
    for (const auto& [cause, count] : realtime["missed_by_cause"].items()) missed += count.get<int>();
    EXPECT_EQ(missed, realtime["missed"]);
    for (const char* figure : {"wake_up_us", "step_us", "response_us", "deviation_us"})
        EXPECT_LE(realtime[figure]["p50"], realtime[figure]["worst"]) << figure;
}

TEST_F(Realtime, RecordsWhatASimulationRecords) {
    bf("run sine.yaml --quiet --record simulated.mcap");
    bf("run sine.yaml --quiet --realtime --realtime-factor 10 --priority 0 --record real.mcap");
    bf("export simulated.mcap -o simulated.csv");
    bf("export real.mcap -o real.csv");
    EXPECT_EQ(lines("real.csv"), 101);
    EXPECT_EQ(read("real.csv"), read("simulated.csv"));
}

TEST_F(Realtime, SignalsEndARunAsItsStopTimeDoes) {
    for (const auto& [signal, code] : {std::pair("INT", 130), std::pair("TERM", 143)}) {
        const auto run = interrupted(signal);
        EXPECT_EQ(run.code, code) << run.err;
        EXPECT_CONTAINS(run.err, "interrupted");
        const auto json = this->json("s.json");
        EXPECT_EQ(json["outcome"], "interrupted");
        bf("export r.mcap -o r.csv");
        EXPECT_EQ(lines("r.csv"), json["steps"].get<int>() + 1) << "every step is recorded";
    }
}

TEST_F(Realtime, ASignalEndsTheWaitOfABlock) {
    write("waits.yaml", "model: m\nplugins: [WholeBodyToolbox]\nstep: 0.01\nstop: 1\nblocks:\n"
                        "  hold: {block: WholeBodyToolbox/RealTimeSynchronizer, interval: 1e9}\n");
    for (const std::string options : {"", "--realtime --priority 0 --watchdog 100 "}) {
        const auto run = shell("'" BF_PROGRAM "' run waits.yaml --quiet " + options +
                               "--summary s.json & sleep 2; kill -TERM $!; wait $!");
        EXPECT_EQ(run.code, 143) << run.err;
        EXPECT_CONTAINS(run.err, " s: interrupted");
        const auto json = this->json("s.json");
        EXPECT_EQ(json["outcome"], "interrupted");
        EXPECT_FALSE(json.contains("failure")) << json;
    }
}

TEST_F(Realtime, DurationIsOnTheClock) {
    const auto run = bf("run sine.yaml --realtime --priority 0 --stop Inf --duration 0.2 --json");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_LE(nlohmann::json::parse(run.out)["steps"], 20);
}

TEST_F(Realtime, WhatTheMachineRefusesIsOneWarningOrAnError) {
    const auto lenient =
        bf("run sine.yaml --realtime --realtime-factor 10 --priority 0 --cpu 100000 --quiet");
    EXPECT_EQ(lenient.code, 0);
    EXPECT_CONTAINS(lenient.err,
                    "bf: warning: the period is not guaranteed on this machine (see bf doctor)\n  ");
    EXPECT_CONTAINS(lenient.err, "processor 100000 was refused (Invalid argument): name one of those that");
    const auto strict =
        bf("run sine.yaml --realtime --strict --priority 0 --cpu 100000 --quiet --record r.mcap");
    EXPECT_EQ(strict.code, 1);
    EXPECT_CONTAINS(strict.err, "bf: this machine refuses real time\n  processor 100000 was refused");
}

TEST_F(Realtime, AMissedDeadlineEndsTheRunWherePolicySaysSo) {
    // No machine makes a step in a nanosecond.
    write("fast.yaml", "model: fast\nstep: 1e-9\nstop: 1\nblocks:\n  t: {block: Clock}\n");
    const auto run = bf("run fast.yaml --realtime --priority 0 --overrun stop --quiet --summary s.json");
    EXPECT_EQ(run.code, 1);
    EXPECT_CONTAINS(run.err, "fast stopped at t = 1e-09 s: step 0 missed its deadline by ");
    EXPECT_CONTAINS(run.err, "; choose another --overrun than stop, or give the step more time");
    EXPECT_EQ(json("s.json")["outcome"], "failed");
    const auto always =
        bf("run fast.yaml --realtime --priority 0 --overrun catch-up --quiet --duration 0.1 --json");
    EXPECT_EQ(always.code, 0) << always.err;
    const auto realtime = nlohmann::json::parse(always.out)["realtime"];
    EXPECT_EQ(realtime["missed"], realtime["steps"]);
}

TEST_F(Realtime, APortThatIsTakenIsNamedBeforeTheRun) {
    const auto run = shell(
        "'" BF_PROGRAM "' run sine.yaml --realtime --priority 0 --stop Inf --serve 0 --quiet 2>one & "
        "one=$!; sleep 0.5; port=$(grep -o 'ws://127.0.0.1:[0-9]*' one | grep -o '[0-9]*$'); '" BF_PROGRAM
        "' run sine.yaml --realtime --priority 0 --serve $port; code=$?; kill $one; wait $one; exit "
        "$code");
    EXPECT_EQ(run.code, 1);
    EXPECT_CONTAINS(run.err, "Address already in use; give another port, or 0 for any free one");
}

TEST_F(Realtime, ChangesOfParametersAndVariablesAreReplayed) {
    write("tuned.yaml",
          "model: tuned\nstep: 0.002\nvariables: {k: 2, d: k^2}\nblocks:\n  t: {block: Clock}\n"
          "  a: {block: Gain, K: k}\n  b: {block: Gain, K: \"d*[1 2]\"}\n  c: {block: Constant, value: k}\n"
          "  sum: {block: DiscreteIntegrator}\n  last: {block: UnitDelay, initial: k}\n"
          "connections: {t: [a, b], a: [sum, last]}\n");
    write("client.py", R"py(
import json, struct, sys, time, websockets.sync.client
url = sys.argv[1]
with websockets.sync.client.connect(url, subprotocols=["foxglove.websocket.v1"]) as viewer:
    def change(**values):
        viewer.send(json.dumps({"op": "setParameters", "id": "x", "who": "a test", "parameters": [
            {"name": n.replace("__", "."), "value": v} for n, v in values.items()]}))
        while True:
            message = viewer.recv(30)
            if isinstance(message, str) and json.loads(message).get("id") == "x":
                return {p["name"]: p["value"] for p in json.loads(message)["parameters"]}
    assert change(k=3) == {"k": 3}  # before the start, so that initial states follow
    viewer.send(struct.pack("<BIII", 2, 0, 0, 4) + b"json" + b'{"who": "a test"}')
    time.sleep(0.2)
    assert change(b__K=[5, 6], k=4) == {"b.K": [5, 6], "k": 4}
    time.sleep(0.1)
    assert change(k=-1, nothing=2) == {"k": 4}  # refused as a whole
)py");
    const auto run =
        shell("'" BF_PROGRAM
              "' run tuned.yaml --realtime --priority 0 --stop Inf --serve 0 --control --wait --quiet "
              "--record r.mcap --summary s.json 2>err & one=$!; for i in $(seq 200); do url=$(grep -o "
              "'ws://.*$' err) && break; sleep 0.05; done; " BF_PYTHON
              " client.py $url; code=$?; sleep 0.1; kill -TERM $one; wait $one; exit $code");
    ASSERT_EQ(run.code, 0) << run.err << read("err");
    EXPECT_EQ(json("s.json")["realtime"]["parameter_changes"], 2);
    const auto log = json("s.json")["realtime"]["log"];
    ASSERT_EQ(log.size(), 4u);
    EXPECT_EQ(log[0]["what"], "k = 3, was 2");
    EXPECT_EQ(log[1]["what"], "start");
    EXPECT_EQ(log[2]["what"], "k = 4, was 3");
    EXPECT_EQ(log[3]["what"], "b.K = [5 6], was [9 18]");
    EXPECT_EQ(log[1]["who"].get<std::string>().rfind("a test at 127.0.0.1:", 0), 0u);
    write("metadata.py", R"py(
import mcap.reader
with open("r.mcap", "rb") as file:
    records = {record.name: record.metadata for record in mcap.reader.make_reader(file).iter_metadata()}
control, first = records["control 0"], records["parameter change 0"]
assert control["what"] == "start" and control["who"].startswith("a test at ") and float(control["clock"]) > 1.7e9, control
assert first["step"] == "-1" and first["who"].startswith("a test at "), first
)py");
    EXPECT_EQ(shell(BF_PYTHON " metadata.py").code, 0);
    const auto replay = bf("replay r.mcap");
    EXPECT_EQ(replay.code, 0) << replay.err;
    EXPECT_CONTAINS(replay.out, "identical: ");
}

TEST_F(Realtime, WhatIsStoppedWhileItWaitsWasNotRun) {
    write("checked.yaml", "model: checked\nstep: 0.01\nstop: 1\nblocks:\n  c: {block: Constant, value: 2}\n"
                          "  high: {block: Check, kind: maximum, at_most: 1}\nconnections: {c: high}\n");
    const auto run =
        shell("'" BF_PROGRAM "' run checked.yaml --realtime --priority 0 --serve 0 --control --wait "
              "--quiet --summary s.json 2>err & one=$!; for i in $(seq 200); do grep -q 'ws://' err "
              "&& break; sleep 0.05; done; kill -TERM $one; wait $one");
    EXPECT_CONTAINS(run.out, "  high         not run\n  high.passed  not run\n");
    EXPECT_TRUE(json("s.json")["checks"]["high.passed"].is_null());
    EXPECT_CONTAINS(bf("run checked.yaml").out, "  high.passed  NO\n");
}

TEST_F(Realtime, ATokenFileServesForEachRunAndIsNotPrinted) {
    write("look.py", R"py(
import sys, websockets.sync.client
websockets.sync.client.connect(sys.argv[1] + "/?token=" + sys.argv[2], subprotocols=["foxglove.websocket.v1"]).close()
)py");
    std::string tokens;
    for (int run = 0; run < 2; ++run) {
        const auto served = shell(
            "'" BF_PROGRAM "' run sine.yaml --realtime --priority 0 --stop Inf --serve 0 --token secret "
            "--quiet 2>err & one=$!; for i in $(seq 200); do url=$(grep -o 'ws://[0-9.:]*' err) && break; "
            "sleep 0.05; done; " BF_PYTHON
            " look.py $url $(cat secret); code=$?; kill -TERM $one; wait $one; exit $code");
        EXPECT_EQ(served.code, 0) << served.err << read("err");
        EXPECT_EQ(read("err").find(read("secret").substr(0, 32)), std::string::npos);
        EXPECT_CONTAINS(read("err"), "/?token=..., the line in secret");
        tokens += read("secret");
    }
    EXPECT_EQ(tokens.size(), 66u);
    EXPECT_EQ(tokens.substr(0, 33), tokens.substr(33));
    shell("chmod 644 secret");
    const auto open = bf("run sine.yaml --realtime --priority 0 --serve 0 --token secret");
    EXPECT_EQ(open.code, 1);
    EXPECT_CONTAINS(open.err, "the token file secret is open to others than its owner; say chmod 600 secret");
}

TEST_F(Realtime, AStepThatHangsEndsTheProgramAndAPauseDoesNot) {
    write("hang.yaml", hanging_model);
    const auto hang = bf("run hang.yaml --realtime --priority 0 --watchdog 0.3 --quiet --summary s.json");
    EXPECT_EQ(hang.code, 1);
    EXPECT_CONTAINS(hang.err, "bf: hang: step 0 at t = 0 s has not ended for 0.3 s");
    EXPECT_EQ(json("s.json")["outcome"], "failed");
    EXPECT_CONTAINS(json("s.json")["failure"].get<std::string>(), "step 0 at t = 0 s has not ended");
    const auto paused =
        shell("'" BF_PROGRAM "' run sine.yaml --realtime --priority 0 --stop Inf --duration 1.5 "
              "--watchdog 0.3 --quiet & one=$!; sleep 0.7; kill -STOP $one; sleep 1; kill "
              "-CONT $one; wait $one");
    EXPECT_EQ(paused.code, 0) << paused.err;
}

TEST_F(Realtime, RefusesASolverThatChoosesItsSteps) {
    write("stiff.yaml",
          "model: stiff\nstep: 0.01\nstop: 1\nsolver: cvode_bdf\nblocks:\n  one: {block: Constant}\n"
          "  x: {block: Integrator}\nconnections: {one: x}\n");
    const auto run = bf("run stiff.yaml --realtime --priority 0 --quiet");
    EXPECT_EQ(run.code, 1);
    EXPECT_CONTAINS(run.err, "the solver 'cvode_bdf' chooses its own steps");
    EXPECT_CONTAINS(run.err, "e.g. solver: rk4");
}

TEST_F(Realtime, WrongOptionsAreRefused) {
    const auto refused = [&](const std::string& options, const std::string& text) {
        const auto run = bf("run sine.yaml " + options);
        EXPECT_EQ(run.code, 2) << options;
        EXPECT_CONTAINS(run.err, text);
    };
    refused("--serve", "--serve requires --realtime");
    refused("--realtime --token secret", "--token requires --serve");
    refused("--realtime --control", "--control requires --serve");
    refused("--realtime --serve --wait", "--wait requires --control");
    refused("--realtime --serve here", "'here' is neither a port, 0 to 65535, nor unix:PATH");
    refused("--cpu 0", "--cpu requires --realtime");
    refused("--realtime --overrun hope", "--overrun");
    refused("--realtime --priority 100", "--priority");
    refused("--realtime --realtime-factor 0", "--realtime-factor");
    refused("--realtime --duration -1", "--duration");
    refused("--realtime --serve 70000", "--serve");
    const auto endless = bf("run sine.yaml --realtime --set stop=Inf");
    EXPECT_EQ(endless.code, 1) << "a model without a stop time needs one";
}

} // namespace

} // namespace bf::tools
