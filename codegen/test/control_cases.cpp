// Subsystems that do not always run, loops, zero crossings, and the examples.
#include "cases.hpp"

#include "bf/formats/yaml.hpp"

namespace bf::codegen::test {
namespace {

model::Model read(const std::string& name, const std::string& text) {
    return formats::read_yaml_text("model: " + name + "\n" + text, "m.yaml");
}

/// Triggered subsystems: of a scalar and of a vector, with states and a period, one inside another, enabled.
model::Model triggered(const std::string& edge, const std::string& states) {
    const std::string when = states == "reset" ? "reset" : "held";
    return read("triggered_" + edge, R"m(step: 0.01
inputs: [u, w]
blocks:
  pair: {block: Mux}
  fast: {block: Sine, frequency: 60}
  on: {block: CompareToConstant, operator: ">", constant: -0.3}
  one:
    execution: triggered
    trigger: )m" + edge + R"m(
    inputs: [u, w]
    outputs: {y: {initial: 3}, z: {}, t: {}}
    blocks:
      five: {block: Constant, value: 5}
      sum: {block: DiscreteIntegrator, initial: 1}
      clock: {block: Clock}
      five_times: {block: Product}
      inner:
        execution: enabled
        states: )m" + states + R"m(
        inputs: [u]
        outputs: {y: {initial: [1, 2, 3], when_disabled: )m" +
                                         when + R"m(}}
        blocks: {spread: {block: Gain, K: [1, 2, 3]}, past: {block: UnitDelay, initial: 4}}
        connections: {u: spread, spread: past, past: y}
      deeper:
        execution: triggered
        inputs: [u]
        outputs: [y]
        blocks: {i: {block: DiscreteIntegrator}, k: {block: Gain, K: 2}}
        connections: {u: i, i: k, k: y}
    connections: {u: [sum, five_times.u1, inner.u, deeper.u], five: five_times.u2, w: [inner.enable, deeper.trigger],
                  sum: y, inner: z, clock: t}
  many:
    execution: enabled_and_triggered
    trigger: )m" + edge + R"m(
    states: )m" + states + R"m(
    inputs: [u]
    outputs: {y: {initial: -1, when_disabled: )m" +
                                         when + R"m(}}
    blocks: {i: {block: DiscreteIntegrator, method: trapezoidal, initial: 2}}
    connections: {u: i, i: y}
  after: {block: Gain, K: 10}
connections: {u: [one.u, many.u, pair.u1, on], w: [one.w, pair.u2], fast: one.trigger, pair: many.trigger,
              on: many.enable, one.y: after}
)m");
}

/// Resets of subsystems that run always, at a slower rate, and while enabled.
model::Model resets(const std::string& edge) {
    const std::string keys = "inputs: [u]\n    outputs: [y]\n    reset: " + edge +
                             "\n    blocks: {i: {block: DiscreteIntegrator, initial: [1, 2]}}\n"
                             "    connections: {u: i, i: y}\n";
    return read("reset_" + edge,
                "step: 0.01\nsolver: rk4\ninputs: [u, on, again]\nblocks:\n  always:\n    " + keys +
                    "  slow:\n    period: 0.03\n    " + keys + "  enabled:\n    execution: enabled\n    " +
                    keys +
                    "  wave: {block: Sine, frequency: 30}\n"
                    "  plant:\n    inputs: [u]\n    outputs: [y]\n    reset: " +
                    edge +
                    "\n    blocks: {x: {block: Integrator, initial: 3}}\n"
                    "    connections: {u: x, x: y}\n"
                    "connections: {u: [always.u, slow.u, enabled.u, plant.u], on: enabled.enable,"
                    " again: [always.reset, slow.reset, enabled.reset], wave: plant.reset}\n");
}

/// Actions of If and SwitchCase, merged, and function calls at rates of their own.
model::Model actions() {
    const auto branch = [](const std::string& name, const std::string& out) {
        return "  " + name + ":\n    execution: enabled\n    inputs: [u]\n    outputs: [y]\n" +
               "    blocks: {k: {block: Constant, value: 10}, p: {block: Product}, d: {block: UnitDelay}}\n" +
               "    connections: {u: p.u1, k: p.u2, " + out + "}\n";
    };
    return read("actions", R"m(step: 0.01
inputs: [u, v]
blocks:
  big: {block: CompareToConstant, operator: ">", constant: 0.5}
  positive: {block: CompareToConstant, operator: ">", constant: 0}
  if: {block: If, conditions: 2}
  tens: {block: Gain, K: 2}
  case: {block: SwitchCase, cases: [1, -1, 2, 1]}
  merge: {block: Merge, inputs: 3}
  merged: {block: Merge, inputs: 2}
  each: {block: FunctionCallGenerator, period: 0.03}
  called:
    execution: triggered
    trigger: function_call
    inputs: [u]
    outputs: [y, v, w]
    blocks:
      i: {block: DiscreteIntegrator}
      d: {block: DiscreteDerivative}
      c: {block: DiscretePID, I: 3, D: 0.1, method: trapezoidal}
    connections: {u: [i, d, c], i: y, d: v, c: w}
)m" + branch("a", "p: [d, y]") +
                               branch("b", "p: d, d: y") + branch("c", "p: [d, y]") +
                               branch("one", "p: d, d: y") + branch("other", "p: [d, y]") + R"m(
connections:
  u: [big, positive, a.u, b.u, c.u, called.u]
  v: [tens, one.u, other.u]
  tens: case
  big: if.u1
  positive: if.u2
  if.y1: a.enable
  if.y2: b.enable
  if.y3: c.enable
  a: merge.u1
  b: merge.u2
  c: merge.u3
  case.y1: one.enable
  case.y5: other.enable
  one: merged.u1
  other: merged.u2
  each: called.trigger
)m");
}

/// Loops within loops, with triggered subsystems inside, and one for each part of a vector.
model::Model loops(const std::string& states) {
    return read("loops_" + states, R"m(step: 0.01
inputs: [u, n]
blocks:
  five_times: {block: Gain, K: 3}
  slow: {block: Gain, period: 0.02}
  sum:
    execution: for
    states: )m" + states + R"m(
    inputs: [u]
    outputs: [y, z, t, r]
    blocks:
      i: {block: Iteration}
      three: {block: Constant, value: 3}
      add: {block: Sum, signs: +++}
      past: {block: UnitDelay}
      odd: {block: Trigonometry, function: cos}
      inner:
        execution: for
        iterations: 4
        inputs: [u]
        outputs: [y]
        blocks: {k: {block: Iteration}, p: {block: Product}, a: {block: Sum}, m: {block: UnitDelay, initial: 1}}
        connections: {u: p.u1, k: p.u2, p: a.u1, m: a.u2, a: [m, y]}
      counter:
        execution: triggered
        trigger: either
        inputs: [u, i]
        outputs: [y, r]
        blocks:
          c: {block: DiscreteIntegrator}
          half: {execution: enabled, inputs: [u], outputs: [y], blocks: {g: {block: UnitDelay}}, connections: {u: g, g: y}}
          relay: {block: Relay, on_point: 5, off_point: 3}
        connections: {u: [c, half.u, half.enable], half: y, i: relay, relay: r}
    connections: {u: [add.u1, inner.u, counter.u], i: [add.u2, odd, counter.i], past: add.u3, add: [past, y], inner: z,
                  odd: counter.trigger, counter.y: t, counter.r: r}
  root:
    execution: while
    states: )m" + states + R"m(
    inputs: [a, begin]
    outputs: [y]
    blocks:
      x: {block: UnitDelay, initial: 1}
      q: {block: Product, operations: "*/"}
      mean: {block: Sum, signs: ++}
      half: {block: Gain, K: 0.5}
      d: {block: Sum, signs: +-}
      abs: {block: Abs}
      more: {block: CompareToConstant, operator: ">", constant: 1e-12}
      w: {block: While, most: 200}
    connections: {a: q.u1, x: [q.u2, mean.u1, d.u2], q: mean.u2, mean: half, half: [x, d.u1, y], d: abs, abs: more,
                  more: w.condition, begin: w.initial}
  square: {block: Square}
  above: {block: Sum}
  bias: {block: Constant, value: 0.1}
  parts: {block: Gain, K: [1, 2, 3, 4]}
  each:
    execution: for_each
    iterations: 2
    inputs: {u: {each: true}, k: }
    outputs: [y]
    blocks:
      p: {block: Product}
      sum: {block: Sum}
      past: {block: UnitDelay}
      g: {block: Gain, K: iteration}
    connections: {u: p.u1, k: p.u2, p: sum.u1, past: sum.u2, sum: [past, g], g: y}
connections: {u: [sum.u, square, parts, slow, root.begin], n: five_times, five_times: sum.iterations, square: above.u1,
              bias: above.u2, above: root.a, parts: each.u, slow: each.k}
)m");
}

/// A while loop that does not end.
model::Model endless() {
    return read("endless", R"m(step: 0.01
inputs: [u]
blocks:
  s:
    execution: while
    inputs: [u]
    outputs: [y]
    blocks: {g: {block: Gain}, c: {block: CompareToConstant, operator: "<", constant: 1}, w: {block: While, most: 7}}
    connections: {u: g, g: [c, y], c: w.condition}
connections: {u: s.u}
)m");
}

/// Everything among the standard blocks that answers zero crossings, under one condition and alone.
model::Model crossings(const std::string& solver, const std::string& states) {
    return read("crossings_" + solver + "_" + states, "step: 0.01\nsolver: " + solver + R"m(
inputs: [noise]
blocks:
  gravity: {block: Constant, value: -9.81}
  velocity: {block: LimitedIntegrator, reset: falling, initial_source: external, state_port: true}
  factor: {block: Step, period: 0.01, time: 0.01, after: -0.8}
  rebound: {block: Product}
  height: {block: Integrator, initial: 0.03}
  wave: {block: Sine, frequency: 40, amplitude: [1, 2]}
  first: {block: Selector, indices: 1}
  drive: {block: Integrator}
  on: {block: CompareToConstant, operator: ">", constant: -0.2}
  slow: {block: Sine, frequency: 9, period: 0.02}
  part:
    execution: enabled
    states: )m" + states + R"m(
    reset: either
    inputs: [u]
    outputs: {r: {initial: 1, when_disabled: )m" + states +
                                                          R"m(}, y: {}, x: {}, p: {}, b: {}, h: {}}
    blocks:
      relay: {block: Relay, on_point: 0.3, off_point: -0.2}
      limited: {block: LimitedIntegrator, lower: -0.02, upper: 0.01, reset: rising}
      second: {block: SecondOrderIntegrator, lower_x: -0.001, upper_x: 0.001}
      pid: {block: PID, reset: either, I: 3, D: 0.1, initial: 0.5}
      play: {block: Backlash, width: 0.4}
      hit: {block: HitCrossing, level: 0.1}
      one: {block: Selector, indices: 2}
    connections: {u: [relay, limited.u, second, one, play, hit], one: [pid.e, pid.reset, limited.reset], relay: r,
                  limited: y, second.x: x, pid: p, play: b, hit: h}
connections: {gravity: velocity.u, velocity.y: height, velocity.state: rebound.u1, factor: rebound.u2,
              rebound: velocity.x0, height: velocity.reset, wave: [part.u, first], first: drive, drive: part.reset, slow: on,
              on: part.enable}
)m");
}

/// A limit that is reached in the step of an edge, or of a call: what runs then is updated once.
model::Model triggered_at_a_crossing(const std::string& trigger) {
    return read("crossing_and_" + trigger, R"m(step: 0.1
solver: rk4
blocks:
  up: {block: Step, time: 0.45}
  down: {block: Step, time: 0.65, after: -1}
  again: {block: Step, time: 0.85}
  edges: {block: Sum, signs: +++}
  one: {block: Constant, value: 1}
  limit: {block: LimitedIntegrator, upper: 0.45}
  counter:
    execution: triggered
    trigger: )m" + trigger + R"m(
    inputs: [u]
    outputs: [n, last, total, follows]
    blocks:
      c: {block: Constant, value: 1}
      sum: {block: Sum, signs: ++}
      past: {block: UnitDelay}
      seen: {block: Gain}
      i: {block: DiscreteIntegrator}
      follow: {block: Gain, K: 3}
    connections: {c: sum.u1, past: [sum.u2, seen], sum: [past, n], seen: last, u: [i, follow], i: total, follow: follows}
connections: {one: limit, limit: counter.u, up: edges.u1, down: edges.u2, again: edges.u3, edges: counter.trigger}
)m");
}

/// 1/0 in an enabled subsystem's loop, which the model refuses.
model::Model infinite() {
    return read("infinite", R"m(step: 0.01
solver: rk4
non_finite: error
inputs: [u]
blocks:
  slow: {block: Gain, period: 0.02}
  s:
    execution: enabled
    inputs: [u]
    outputs: [y]
    blocks:
      loop:
        execution: for
        iterations: 2
        inputs: [u]
        outputs: [y]
        blocks: {above: {block: CompareToConstant, operator: "<", constant: 0.5}, real: {block: Convert, type: double}, inverse: {block: Reciprocal}}
        connections: {u: above, above: real, real: inverse, inverse: y}
    connections: {u: loop.u, loop: y}
  x: {block: Integrator}
  one: {block: Constant, value: 1}
connections: {u: slow, slow: [s.u, s.enable], one: x}
)m");
}

/// Loops in the continuous rate: one counts, one begins anew.
model::Model loops_between_steps() {
    return read("loops_between_steps", R"m(step: 0.01
solver: rk4
inputs: [u]
blocks:
  t: {block: Clock}
  counts:
    execution: for
    iterations: 3
    inputs: [u]
    outputs: [y]
    blocks: {a: {block: Sum}, m: {block: UnitDelay}}
    connections: {u: a.u1, m: a.u2, a: [m, y]}
  anew:
    execution: for
    states: reset
    iterations: 4
    inputs: [u]
    outputs: [y]
    blocks: {k: {block: Iteration}, p: {block: Product}, a: {block: Sum}, m: {block: UnitDelay, initial: 1}}
    connections: {u: p.u1, k: p.u2, p: a.u1, m: a.u2, a: [m, y]}
  sum: {block: Sum, signs: "++-+"}
  x: {block: Integrator}
connections: {t: [counts.u, anew.u], counts: sum.u1, anew: sum.u2, x: sum.u3, u: sum.u4, sum: x}
)m");
}

/// Tables with several points in each dimension, inside of them and beyond.
model::Model tables() {
    return read("tables", R"m(step: 0.01
inputs: [u, v]
blocks:
  line: {block: Lookup1D, breakpoints: [-1, -0.2, 0.5, 2], table: [3, 1, 4, 1.5], extrapolation: linear}
  held: {block: Lookup1D, breakpoints: [-1, -0.2, 0.5, 2], table: [3, 1, 4, 1.5]}
  flat: {block: Lookup1D, breakpoints: [-1, -0.2, 0.5, 2], table: [3, 1, 4, 1.5], interpolation: flat}
  nearest: {block: Lookup2D, breakpoints1: [-1, 0, 1], breakpoints2: [-0.5, 0.5], table: "[1 2; 3 4; 5 7]", interpolation: nearest}
  plane: {block: Lookup2D, breakpoints1: [-1, 0, 1], breakpoints2: [-0.5, 0.5], table: "[1 2; 3 4; 5 7]", extrapolation: linear}
  space: {block: LookupND, breakpoints1: [-1, 0, 1], breakpoints2: [-0.5, 0.5], breakpoints3: [0, 1],
          table: "[1 2 3 4; 5 6 8 9; 7 1 0 2]"}
  first: {block: Prelookup, breakpoints: [-1, 0, 1]}
  second: {block: Prelookup, breakpoints: [-0.5, 0.5], extrapolation: linear}
  at: {block: InterpolateAt, size: [3, 2], table: "[1 2; 3 4; 5 7]"}
  four: {block: Gain, K: 4}
  direct: {block: DirectLookup, table: [5, 6, 7, 8]}
  cell: {block: DirectLookup, dimensions: 2, from_zero: true, table: "[1 2 3; 4 5 6]"}
connections: {u: [line, held, flat, nearest.u1, plane.u1, space.u1, first, four], v: [nearest.u2, plane.u2, space.u2, space.u3, second],
              first.k: at.k1, first.f: at.f1, second.k: at.k2, second.f: at.f2, four: [direct, cell.i1, cell.i2]}
)m");
}

/// Two charts of states in states, of inputs of different types; one runs to completion.
model::Model charts() {
    return read("charts", R"m(step: 0.1
inputs: {force: {shape: [3]}, go: {type: int8}, stop: {type: boolean}}
blocks:
  walk:
    block: StateMachine
    p: [0.3, 2]
    chart:
      inputs: [force]
      parameters: [T, most]
      variables: {n: 1, steps: 0}
      outputs: [n, walking]
      states:
        standing:
          entry: n = -n; send late after T
          transitions:
            - {to: [walking.left.down, memory], if: "force(1) > 0 | time_in_state > 1", after: T/2}
            - {to: stopped, on: late, if: steps > 40}
        walking:
          exit: "if steps > most, raise tired; elseif n < 0, cancel late; else, n = mod(n*3, 7); end"
          regions:
            left:
              begin: n = n + 0.1
              states:
                up: {during: n = n + sin(force(2)), transitions: [{to: down, every: 0.3, do: steps = steps + 1}]}
                down: {transitions: [{to: up, if: "force(3) > force(2) & ~body.high"}, {on: tired, do: steps = 0}]}
            body:
              states:
                memory: {history: deep, to: low.a}
                low:
                  states:
                    a: {transitions: [{to: b, if: left.up}]}
                    b: {during: n = n*0.9, transitions: [{to: high, after: 0.2}]}
                high: {transitions: [{to: done, if: n > 3}, {to: low, if: force(1) < -1}]}
                done: {final: true}
          transitions: [{to: standing, if: force(1) < -0.5, do: "n = min(n, 5)"}, {to: standing, on: done.state.body}]
        stopped: {final: true}
  lamp:
    block: StateMachine
    chart:
      events: [go, stop]
      variables: {k: 0}
      run_to_completion: true
      states:
        off: {transitions: [{to: on, on: go, do: k = k + 1; raise blink}]}
        on:
          initial: shine
          states:
            last: {history: shallow, to: blinking}
            shine: {transitions: [{to: blinking, on: blink, do: send dark after 0.25}]}
            blinking: {entry: k = k + 0.5, transitions: [{to: shine, on: stop}]}
          transitions: [{to: off, on: dark}, {to: last, on: go, if: k < 20}]
  number: {block: Convert, type: int8}
connections: {force: walk.force, go: lamp.go, stop: number, number: lamp.stop}
)m");
}

} // namespace

std::vector<Case> control_cases() {
    std::vector<Case> cases;
    const auto add = [&](model::Model model, int steps) { cases.push_back({Elaborated(model), steps}); };
    for (const std::string edge : {"rising", "falling", "either", "function_call"})
        add(triggered(edge, edge == "rising" ? "reset" : "held"), 60);
    for (const std::string edge : {"rising", "falling", "either", "level_hold"}) add(resets(edge), 40);
    add(actions(), 60);
    for (const std::string states : {"held", "reset"}) {
        add(loops(states), 30);
        add(crossings("rk4", states), 60);
    }
    add(crossings("euler", "held"), 60);
    for (const std::string trigger : {"rising", "falling", "either", "function_call"})
        add(triggered_at_a_crossing(trigger), 14);
    add(loops_between_steps(), 40);
    add(endless(), 20);
    add(infinite(), 40);
    add(tables(), 60);
    add(charts(), 400);
    return cases;
}

std::vector<Case> example_cases() {
    std::vector<Case> cases;
    for (const std::string name : {"bouncing_ball", "buck_converter", "cart_pole", "dc_motor", "docking",
                                   "double_pendulum", "stick_slip", "thermostat", "two_rates"}) {
        model::Model model = formats::read_yaml(std::filesystem::path(BF_EXAMPLES) / name / "model.yaml");
        if (model.solver && is_adaptive(solver_method(model.solver->text).value()))
            model.solver->text = "rk4";
        cases.push_back({Elaborated(model), name == "docking" ? 1800 : 200}); // its chart has been everywhere
    }
    return cases;
}

Case three_rates() {
    return {Elaborated(read("three_rates", R"m(step: 0.001
solver: rk4
inputs: {u: {}, v: {shape: [3]}}
blocks:
  limit: {block: Constant, value: 0.2}
  difference: {block: Sum, signs: "+-+"}
  fast: {block: DiscreteIntegrator, period: 0.001}
  x: {block: Integrator}
  back: {block: Gain, K: 0.1}
  sample: {block: ZeroOrderHold, period: 0.006}
  medium:
    period: 0.006
    inputs: [u, w]
    outputs: [y]
    blocks:
      clock: {block: Sine, frequency: 500}
      g: {block: Sum, signs: "+++"}
      i: {block: DiscreteIntegrator}
      p: {block: UnitDelay, initial: 2}
      high: {block: CompareToConstant, operator: ">", constant: 0}
      part:
        execution: enabled
        inputs: [u]
        outputs: [y]
        blocks: {count: {block: DiscreteIntegrator}, now: {block: Clock}, both: {block: Sum}}
        connections: {u: count, count: both.u1, now: both.u2, both: y}
      triggered:
        execution: triggered
        trigger: either
        inputs: [u]
        outputs: [y]
        blocks: {k: {block: Gain, K: 2}, d: {block: DiscreteDerivative}}
        connections: {u: k, k: d, d: y}
      loop:
        execution: for
        iterations: 3
        inputs: [u]
        outputs: [y]
        blocks: {a: {block: Sum}, m: {block: UnitDelay, initial: 1}}
        connections: {u: a.u1, m: a.u2, a: [m, y]}
      sum: {block: Sum, signs: "++++"}
    connections: {u: g.u1, clock: [g.u2, high, triggered.trigger], w: g.u3, g: [i, part.u, triggered.u, loop.u],
                  i: p, high: part.enable, p: sum.u1, part: sum.u2, triggered: sum.u3, loop: sum.u4, sum: y}
  waves: {block: RateTransition, period: 0.03, offset: 0.006}
  slow:
    period: 0.03
    offset: 0.006
    inputs: [u, v]
    outputs: [y, z]
    blocks: {g: {block: Gain, K: 0.3}, c: {block: Clock}, s: {block: Sum, signs: "+++"}, h: {block: UnitDelay},
             b: {block: DiscreteIntegrator}, k: {block: Gain, K: "[1; 2; 10]"}}
    connections: {u: g, g: s.u1, c: s.u2, h: s.u3, s: [h, y], v: b, b: k, k: z}
  command: {block: RateTransition, mode: delay, period: 0.03, offset: 0.006, initial: 0.5}
  direct: {block: UnitDelay, period: 0.03, offset: 0.006}
outputs: [y, z, l]
connections: {u: difference.u1, command: difference.u2, limit: [difference.u3, l], difference: fast, fast: [sample, back],
              back: x, sample: medium.u, direct: medium.w, medium: waves, waves: slow.u, v: slow.v, slow.y: [command, direct],
              slow.z: z, x: y}
)m")),
            200,
            {.has_function_per_rate = true}};
}

std::vector<Case> rate_cases() {
    std::vector<Case> cases;
    cases.push_back(three_rates());
    cases.push_back({Elaborated(read("inserted_rates", R"m(step: 0.01
rate_transitions: inserted
inputs: [u]
blocks:
  fast: {block: DiscreteIntegrator}
  slow: {block: Gain, K: 0.3, period: 0.03}
  slower: {block: UnitDelay, period: 0.06}
  sum: {block: Sum, signs: "+++"}
connections: {u: sum.u1, slow: [sum.u2, slower], slower: sum.u3, sum: fast, fast: slow}
)m")),
                     60,
                     {.has_function_per_rate = true}});
    model::Model one = formats::read_yaml(std::filesystem::path(BF_EXAMPLES) / "two_rates/model.yaml");
    one.name = "two_rates_apart";
    cases.push_back({Elaborated(one), 200, {.has_function_per_rate = true}});
    return cases;
}

std::vector<std::vector<Case> (*)()> families() {
    return {block_cases, structure_cases, control_cases, example_cases, rate_cases};
}

} // namespace bf::codegen::test
