// A function per rate: the same results whenever slow ones get the processor, and what cannot be split.
#include "cases.hpp"
#include "compare.hpp"
#include "folder.hpp"

#include "bf/formats/yaml.hpp"

#include <cstdlib>
#include <gtest/gtest.h>

namespace bf::codegen::test {
namespace {

TEST(FunctionsPerRate, CalledInTheirOrderEqualTheEngine) {
    compare_all(rate_cases(), {BF_CASE_DRIVERS, BF_C_DRIVERS, BF_HOSTED_DRIVER, BF_TEST_PLUGINS});
}

/// A processor with priorities: while a slower function is at work, time may go on at each of its basic
/// blocks, where the compiler puts a call, and faster functions then run on top of it.
const char* const scheduler = R"c(
#include "three_rates.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { steps = 600, tasks = 3, idle = tasks };
static const struct { int ticks, offset; bool (*step)(three_rates_model *); } task[tasks] = {
    {1, 0, three_rates_step_1ms}, {6, 0, three_rates_step_6ms}, {30, 6, three_rates_step_30ms_after_6ms}};
static three_rates_model model, expected[steps];
static int now = -1, at_work = idle, due_since[tasks], is_pending[tasks], is_begun[tasks], latest, wrong, interrupted;
static unsigned chance = 1, odds;

static int is_due(int t, int k) { return k >= task[t].offset && (k - task[t].offset) % task[t].ticks == 0; }

static void write_inputs(three_rates_model *m, int t, int k) {
    if (t == 0) m->inputs.u = sin(0.1 * k);
    if (t == 2) for (int i = 0; i < 3; ++i) m->inputs.v[i] = cos(0.1 * k + i);
}

static void check(const char *name, double found, double wanted, int k) {
    if (memcmp(&found, &wanted, sizeof found) == 0) return;
    if (wrong++ < 5) printf("%s of step %d: %.17g instead of %.17g\n", name, k, found, wanted);
}
#define CHECK(t, name) if (which == t) check(#name, model.signals.name, expected[k].signals.name, k)

static void work(int t) {
    const int before = at_work, which = t, k = due_since[t];
    is_pending[t] = 0;
    is_begun[t] = 1;
    at_work = t;
    write_inputs(&model, t, k);
    if (!task[t].step(&model)) ++wrong;
    CHECK(0, fast_y); CHECK(0, back_y); CHECK(0, command_y); CHECK(0, sample_y);
    CHECK(1, medium_g_y); CHECK(1, medium_i_y); CHECK(1, medium_p_y); CHECK(1, medium_sum_y);
    CHECK(1, medium_part_count_y); CHECK(1, medium_part_now_y); CHECK(1, medium_triggered_d_y); CHECK(1, waves_y);
    CHECK(1, direct_y); CHECK(2, slow_s_y); CHECK(2, slow_c_y); CHECK(2, slow_k_y[2]); CHECK(2, slow_h_y);
    if (now - k > latest) latest = now - k;
    is_begun[t] = 0;
    at_work = before;
}

/* Time goes on, unless somebody would then not be ready before it is due again. */
static void tick(void) {
    for (int t = 0; t < tasks; ++t)
        if ((is_pending[t] || is_begun[t]) && is_due(t, now + 1)) return;
    if (++now >= steps) return;
    for (int t = 0; t < tasks; ++t) if (is_due(t, now)) { is_pending[t] = 1; due_since[t] = now; }
    for (int t = 0; t < at_work; ++t) if (is_pending[t]) work(t);
}

void __sanitizer_cov_trace_pc(void);
void __sanitizer_cov_trace_pc(void) {
    if (at_work == 0 || at_work == idle) return;
    chance = chance * 1103515245u + 12345u;
    if ((chance >> 16) % odds != 0 || now + 1 >= steps) return;
    ++interrupted;
    tick();
}

int main(void) {
    static three_rates_model reference;
    at_work = idle;
    three_rates_set_defaults(&reference);
    odds = 1;
    if (!three_rates_initialize(&reference)) return 2;
    for (int k = 0; k < steps; ++k) {
        for (int t = 0; t < tasks; ++t) if (is_due(t, k)) write_inputs(&reference, t, k);
        if (!three_rates_output(&reference)) return 2;
        expected[k] = reference;
        if (!three_rates_update(&reference)) return 2;
    }
    for (odds = 1; odds <= 40; ++odds) {
        three_rates_set_defaults(&model);
        if (!three_rates_initialize(&model)) return 2;
        for (now = -1; now < steps;) tick();
    }
    printf("interrupted %d times, latest after %d steps\n", interrupted, latest);
    return wrong != 0 || latest < 29 || interrupted < 1000;
}
)c";

TEST(FunctionsPerRate, ComputeTheSameWhereverFasterOnesInterruptThem) {
    if (std::system("command -v gcc >/dev/null") != 0) GTEST_SKIP() << "gcc is not installed";
    const Folder folder("rates");
    Case one = three_rates();
    one.options.statements_per_function = 1; // each is a basic block of its own
    for (const auto& [file, text] : c_files(one)) write_text(folder.path / file, text);
    write_text(folder.path / "scheduler.c", scheduler);
    const auto run = [&](const std::string& command) {
        return std::system(("cd " + folder.path.string() + " && " + command).c_str());
    };
    ASSERT_EQ(run("gcc -std=c11 -O1 -ffp-contract=off -fsanitize-coverage=trace-pc -c three_rates.c && gcc "
                  "-std=c11 -Wall -Wextra scheduler.c three_rates.o -lm -o scheduler"),
              0);
    EXPECT_EQ(run("./scheduler > out.txt"), 0) << read_text(folder.path / "out.txt");
}

std::string reason(const std::string& model, const Options& options = {.has_function_per_rate = true}) {
    const Elaborated elaborated(formats::read_yaml_text("model: m\nstep: 0.1\n" + model, "m.yaml"));
    try {
        generate(elaborated.diagram, options);
    } catch (const GenerationError& error) {
        return error.what();
    }
    return "";
}

void expect_refused(const std::string& model, const std::string& why) {
    const std::string text = reason(model);
    EXPECT_NE(text.find("\n  " + why + "\n"), std::string::npos) << text;
    EXPECT_EQ(reason(model, {}), "");
}

TEST(FunctionsPerRate, NameTheWiresBetweenRatesThatNothingCarriesOver) {
    const std::string blocks =
        "blocks:\n  a: {block: Clock, period: 0.1}\n  b: {block: Gain, period: 0.3}\n  c: "
        "{block: Gain, period: 0.2}\n  d: {block: Gain, period: 0.1}\n";
    expect_refused(blocks + "connections: {a: [b, c, d]}\n",
                   "b: at 0.3 s it reads a.y at 0.1 s; put a RateTransition with period 0.3 s in between, or "
                   "say `rate_transitions: inserted`");
    expect_refused(blocks + "connections: {a: [b, c], b: d}\n",
                   "d: at 0.1 s it reads b.y at 0.3 s; put a RateTransition with period 0.3 s and `mode: "
                   "delay` in between, or say `rate_transitions: inserted`");
    expect_refused(blocks + "connections: {a: [c, d], c: b}\n",
                   "b: at 0.3 s it reads c.y at 0.2 s, and neither is hit whenever the other is; pass the "
                   "signal through a block of a period that both are multiples of");
    // A sample of the slow side is not there yet when the fast one runs.
    expect_refused("blocks:\n  a: {block: Clock, period: 0.2}\n  z: {block: ZeroOrderHold, period: 0.1}\n"
                   "  b: {block: Gain, period: 0.1}\nconnections: {a: z, z: b}\n",
                   "z: at 0.1 s it reads a.y at 0.2 s; put a RateTransition with period 0.2 s and `mode: "
                   "delay` in between, or say `rate_transitions: inserted`");
    // A held sample is that of one rate: a slower one would be interrupted by the next.
    expect_refused("blocks:\n  a: {block: Clock, period: 0.1}\n  z: {block: ZeroOrderHold, period: 0.2}\n"
                   "  b: {block: Gain, period: 0.4}\nconnections: {a: z, z: b}\n",
                   "b: at 0.4 s it reads z.y at 0.2 s; put a RateTransition with period 0.4 s in between, or "
                   "say `rate_transitions: inserted`");
}

TEST(FunctionsPerRate, NameWhatBelongsToSeveralRates) {
    expect_refused(
        "inputs: [on, u]\nblocks:\n  part:\n    execution: enabled\n    inputs: [u]\n    outputs: [y]\n"
        "    blocks: {a: {block: UnitDelay, period: 0.1}, b: {block: UnitDelay, period: 0.2}}\n"
        "    connections: {u: a, a: b, b: y}\nconnections: {on: part.enable, u: part.u}\n",
        "part.y: runs at 0.2 s in 'part', which is decided about at 0.1 s; give all of that "
        "subsystem one period, and change rates outside of it");
    expect_refused("solver: rk4\ninputs: [u]\nblocks: {x: {block: LimitedIntegrator}}\nconnections: {u: x}\n",
                   "x: answers zero crossings, after which blocks of all periods may compute again; generate "
                   "one function for all periods");
}

} // namespace
} // namespace bf::codegen::test
