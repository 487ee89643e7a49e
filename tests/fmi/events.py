"""What happens between the steps of a model, in an FMU for model exchange: subsystems begin, end and run where signals that
control them cross 0, and solvers stop where signals jump, in our block and in FMPy. Looking at a variable changes nothing.

Usage: events.py BF EXAMPLES
"""
import ctypes
import pathlib
import shutil
import sys
import tempfile

from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi3 import FMU3Model

bf, examples = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

FALLING = "  one: {block: Constant, value: -1}\n  x: {block: Integrator, initial: 0.53}\n"
# x = 0.53 - t enables what counts the time, so that 0.53 s are counted.
ENABLED = FALLING + """  relay: {block: Relay, on_point: 100, off_point: -100}
  air:
    execution: enabled
    outputs: [s]
    blocks: {one: {block: Constant, value: 1}, i: {block: Integrator}}
    connections: {one: i, i: s}
connections: {one: x, x: [air.enable, relay], air: y, relay: r}
"""
# A sine of period 2 rises twice through 0 until t = 3.5, at 1/3 and 7/3; the time, a state, of the last one is held.
TRIGGERED = """  wave: {block: Sine, frequency: 3.141592653589793, phase: -1.0471975511965976}
  rate: {block: Constant, value: 1}
  t: {block: Integrator}
  seen: {block: Gain, K: 1}
  counted: {block: Gain, K: 1}
  last:
    execution: triggered
    inputs: [time]
    outputs: [s, count]
    blocks:
      sum: {block: Sum, signs: ++}
      past: {block: UnitDelay}
      one: {block: Constant, value: 1}
      through: {block: Gain, K: 1}
    connections: {time: through, through: s, one: sum.u1, past: sum.u2, sum: [past, count]}
connections: {wave: last.trigger, rate: t, t: last.time, last.s: seen, last.count: counted, seen: y, counted: r}
"""
# Two pulses of 10 ms and height 100.
PULSES = """  p: {block: Pulse, amplitude: 100, cycle: 0.5, width: 2, delay: 0.234}
  i: {block: Integrator}
  off: {block: Constant, value: 0}
connections: {p: i, i: y, off: r}
"""
# Signals that jump where a state, t, passes a place: what they integrate to.
JUMPS = """  one: {block: Constant, value: 1}
  x: {block: Integrator}
  ahead: {block: Bias, bias: -0.7654321}
  sign: {block: Sign}
  switch: {block: Switch}
  rough: {block: Quantize, interval: 0.77}
  table: {block: Lookup1D, breakpoints: [0, 0.3333, 1.2345], table: [1, 100, -50], interpolation: flat}
  step: {block: Step, time: 0.777, after: 100}
  all: {block: Sum, signs: "+++++"}
  sum: {block: Integrator}
  hundred: {block: Gain, K: 100}
  off: {block: Constant, value: 0}
connections:
  one: x
  x: [ahead, table, rough]
  ahead: [sign, switch.u2]
  step: [all.u1, switch.u1]
  off: [switch.u3, r]
  sign: hundred
  hundred: all.u2
  switch: all.u3
  rough: all.u4
  table: all.u5
  all: sum
  sum: y
"""
MODELS = {"enabled": (ENABLED, 2, 0.53), "triggered": (TRIGGERED, 3.5, 7 / 3), "pulses": (PULSES, 1, 2.0),
          # Step and switch from 0.777 to 2, sign -1 and +1, 0.77, 1.54 and 2.31 from 0.385, 1.155 and 1.925, the table.
          "jumps": (JUMPS, 2, 2 * 100 * (2 - 0.777) + 100 * (2 - 2 * 0.7654321) + 0.77 * 0.77 + 1.54 * 0.77 + 2.31 * (2 - 1.925)
                    + 0.3333 + 100 * (1.2345 - 0.3333) - 50 * (2 - 1.2345))}


def common(one, its, other, others):
    """Pairs of values at the times, those of steps, that both recordings have."""
    pairs = [(values[-1][0], other[others][t][-1][0]) for t, values in one[its].items() if t in other[others]]
    assert pairs
    return pairs


def written(text, name, stop, solver):
    return (f"model: {name}\nstep: 0.1\nstop: {stop}\nsolver: {solver}\nrelative_tolerance: 1e-9\noutputs: [y, r]\nblocks:\n"
            + text + "record: [y, r]\n")


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    (folder / "fmus").mkdir()

    def recorded(file):
        run(bf, "run", file, "--quiet", "--plugin-path", folder / "fmus", "--record", folder / "run.mcap")
        return read_recording(bf, folder / "run.mcap")

    for name, (text, stop, exact) in MODELS.items():
        plain, wrapper = folder / f"{name}.yaml", folder / "wrapper.yaml"
        for version in (2, 3):
            plain.write_text(written(text, name, stop, "rk4"))
            fmu = folder / "fmus" / f"{name}.fmu"
            run(bf, "export-fmu", plain, "--fmi", version, "-o", fmu)
            for solver in ("rk4", "heun", "dormand_prince45"):
                plain.write_text(written(text, name, stop, solver))
                wrapper.write_text(f"model: wrapper\nplugins: [FMI]\nstep: 0.1\nstop: {stop}\nsolver: {solver}\n"
                                   f"relative_tolerance: 1e-9\nblocks:\n  f: {{block: FMI/ModelExchange, fmu: {fmu.name}}}\n"
                                   "record: [f.*]\n")
                own, inside = recorded(plain), recorded(wrapper)
                for port in ("y", "r"):
                    worst = max(abs(a - b) for a, b in common(own, port, inside, f"f.{port}"))
                    assert worst == 0 if solver != "dormand_prince45" else worst < 1e-8, (name, version, solver, port, worst)
            result = simulate_fmu(str(fmu), stop_time=stop, fmi_type="ModelExchange", relative_tolerance=1e-9,
                                  output_interval=0.1)
            assert abs(result["y"][-1] - exact) < 1e-5, (name, version, result["y"][-1], exact)
            print(f"{name}, FMI {version}.0: {result['y'][-1]:.9f} in FMPy, {exact:.9f} exactly")

    # In the Continuous-Time Mode conditions are what they were, whatever states and getters an importer tries.
    where = extract(str(folder / "fmus/enabled.fmu"))
    description = read_model_description(where)
    fmu = FMU3Model(guid=description.guid, unzipDirectory=where, instanceName="it",
                    modelIdentifier=description.modelExchange.modelIdentifier)
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    while fmu.updateDiscreteStates()[0]:
        pass
    fmu.enterContinuousTimeMode()
    fmu.setTime(0.05)
    references = {v.name: v.valueReference for v in description.modelVariables}
    numbers = ctypes.c_double * 2

    def counts(x):
        """What the subsystem's integral grows by where x is, once y was looked at."""
        rates, indicators = numbers(), (ctypes.c_double * fmu.getNumberOfEventIndicators())()
        fmu.setContinuousStates(numbers(x, 0.05), 2)
        assert fmu.getFloat64([references["y"]]) == [0.05]
        fmu.getEventIndicators(indicators, len(indicators))
        fmu.getContinuousStateDerivatives(rates, 2)
        return rates[1]

    assert [counts(x) for x in (0.3, -0.02, 0.3)] == [1, 1, 1]
    fmu.setContinuousStates(numbers(-0.02, 0.05), 2)
    fmu.enterEventMode()
    fmu.updateDiscreteStates()
    fmu.enterContinuousTimeMode()
    assert [counts(x) for x in (-0.02, 0.3)] == [0, 0]
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(where)
