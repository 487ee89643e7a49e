"""Blocks that are written in Python."""

import gc
import subprocess
import sys
import threading

import numpy as np
import pytest
import scipy.signal

import blockfactory as bf
from conftest import ROOT


class LowPass(bf.Block):
    """First-order low-pass filter."""

    u = bf.Input("n", doc="signal to filter")
    y = bf.Output("n", unit="m/s", doc="filtered signal")
    a = bf.Parameter(initial=0.9, minimum=0, maximum=1, doc="pole")
    x = bf.DiscreteState("n", doc="last output")

    def output(self, at, out):
        out.y = at.a * at.x + (1 - at.a) * at.u

    def update(self, at, next):
        next.x = at.y


class Oscillator(bf.Block):
    k = bf.Argument(4.0, minimum=0)
    y = bf.Output(2)
    x = bf.ContinuousState(2, initial=[1, 0])

    def output(self, at, out):
        out.y = at.x

    def derivative(self, at, rate):
        rate.x[0] = at.x[1]
        rate.x[1] = -self.k * at.x[0]


@bf.block
def Cubed(u, *, gain=1.0):
    return gain * u**3


def around(block, settings=None, *, source=("Constant", {"value": [1.0, 2.0, 3.0]}), step=0.1, solver=None):
    """source -> block -> terminator"""
    m = bf.Model("m").add("source", source[0], **source[1]).add("b", f"python/{block.__name__}", **(settings or {}))
    m.add("end", "Terminator").set("", step=step, **({"solver": solver} if solver else {}))
    if any(member.role == "input" for member in block._members.values()):
        m.connect("source", "b")
    else:
        m.remove("source")
    return bf.load(m.connect("b", "end"), blocks=[block])


def run(block, settings=None, steps=1, **how):
    sim = around(block, settings, **how).simulate()
    sim.step(steps)
    return sim


def test_a_filter_agrees_with_scipy_and_with_snapshots():
    m = around(LowPass, {"a": 0.8}, source=("Sine", {}))
    sim = m.simulate()
    recording = sim.record(["source", "b"])
    sim.step(40)
    here = sim.snapshot()
    sim.step(40)
    u, y = recording["source"].values, recording["b"].values
    np.testing.assert_allclose(y, scipy.signal.lfilter([0.2], [1, -0.8], u), rtol=1e-12, atol=1e-15)
    last = sim["b"].copy()
    sim.restore(here)
    sim.step(40)
    assert sim["b"] == last


def test_what_a_class_declares_is_in_the_model():
    m = around(LowPass)
    block = m.blocks["b"]
    assert (block.type, block.library) == ("python/LowPass", "python")
    assert block.inputs["u"].shape == block.outputs["y"].shape == (3,)
    assert block.outputs["y"].unit == "m/s" and block.inputs["u"].doc == "signal to filter"
    assert (block.parameters["a"].minimum, block.parameters["a"].maximum) == (0, 1)
    with pytest.raises(bf.WrongValue, match="from 0 to 1|at most 1"):
        m.simulate().parameters["b.a"] = 2


def test_a_solver_integrates_a_continuous_state():
    sim = run(Oscillator, {"k": 9}, steps=101, step=0.01, solver="rk4")
    np.testing.assert_allclose(sim["b"], [np.cos(3), -3 * np.sin(3)], atol=1e-6)
    with pytest.raises(bf.ModelError, match="argument 'k'.*-1"):
        around(Oscillator, {"k": -1}, solver="rk4")


def test_a_function_is_a_block():
    np.testing.assert_array_equal(run(Cubed, {"gain": 2})["b"], [2, 16, 54])
    np.testing.assert_array_equal(run(Cubed, source=("Constant", {"value": [[1, 2], [3, 4]]}))["b"], [[1, 8], [27, 64]])
    sim = run(Cubed)
    sim.parameters["b.gain"] = -1
    sim.step()
    np.testing.assert_array_equal(sim["b"], [-1, -8, -27])


def test_a_function_with_several_outputs_and_fixed_shapes():
    @bf.block(inputs={"x": 3}, outputs={"norm": (), "direction": 3})
    def Direction(x):
        norm = np.linalg.norm(x)
        return norm, x / norm

    m = bf.Model("m").add("c", "Constant", value=[3, 0, 4]).add("b", "python/Direction").connect("c", "b.x")
    m.add("e", "Terminator").add("f", "Terminator").connect("b.norm", "e").connect("b.direction", "f").set("", step=1)
    sim = bf.load(m, blocks=[Direction]).simulate()
    sim.step()
    assert sim["b.norm"] == 5
    np.testing.assert_allclose(sim["b.direction"], [0.6, 0, 0.8])
    with pytest.raises(bf.ModelError, match="b: input 'x'|b.x"):
        bf.load(m.set("c", value=[1, 2]), blocks=[Direction])


def failing(name, output):
    return type(name, (bf.Block,), {"u": bf.Input("n"), "y": bf.Output("n"), "output": output})


def raises(self, at, out):
    raise ZeroDivisionError("no {braces}")


def wrong_shape(self, at, out):
    out.y = [1, 2]


def imaginary(self, at, out):
    out.y = 1j * at.u


def text(self, at, out):
    out.y = "text"


def unknown(self, at, out):
    out.z = 1


def writes_input(self, at, out):
    at.u[0] = 3


def replaces_input(self, at, out):
    at.u = 3


def unknown_input(self, at, out):
    out.y = at.v


@pytest.mark.parametrize(
    "output, message",
    [
        (raises, r"b: ZeroDivisionError: no \(braces\)"),
        (wrong_shape, r"b: ValueError: 'y' has shape \(3,\): .*\(2,\)"),
        (text, "b: ValueError: 'y' has shape"),
        (imaginary, "b: WrongValue: 'y' is real, and given complex numbers; give one of their parts"),
        (unknown, "b: AttributeError: here is no 'z' to write; there is y"),
        (writes_input, "b: ValueError: .*read-only"),
        (replaces_input, "b: AttributeError: 'u' is read here; write outputs by out, states by next"),
        (unknown_input, "b: AttributeError: the block has no 'v'; it has u, y"),
    ],
)
def test_what_a_block_does_wrong_ends_the_run_with_its_path(output, message):
    sim = around(failing("Failing", output)).simulate()
    with pytest.raises(bf.StepError, match=message) as caught:
        sim.run(1)
    assert caught.value.__cause__ is not None and caught.value.__cause__.__traceback__ is not None
    assert caught.value.time == 0


def test_a_block_that_returns_no_number_where_the_model_refuses_it():
    block = failing("Nan", lambda self, at, out: setattr(out, "y", np.nan))
    m = bf.Model("m").add("c", "Constant", value=1).add("b", "python/Nan").add("e", "Terminator")
    m.connect("c", "b").connect("b", "e").set("", step=1, non_finite="error")
    with pytest.raises(bf.StepError, match="^b: "):
        bf.load(m, blocks=[block]).simulate().step()


def test_a_start_that_raises_is_no_start():
    def start(self, at):
        raise OSError("no device")

    with pytest.raises(bf.RunError, match="b: OSError: no device"):
        around(type("Device", (bf.Block,), {"y": bf.Output(), "start": start, "output": lambda *_: None})).simulate()


def test_what_a_block_keeps_of_a_run_outlives_the_run():
    kept = []
    block = failing("Keeper", lambda self, at, out: kept.append(at.u))
    sim = run(block)
    del sim
    gc.collect()
    np.testing.assert_array_equal(kept[0], [1, 2, 3])


def test_a_class_that_is_deleted_while_a_run_uses_it():
    class Gone(bf.Block):
        y = bf.Output()

        def output(self, at, out):
            out.y = at.step

    m = around(Gone)
    sim = m.simulate()
    del Gone, m
    gc.collect()
    sim.step(5)
    assert sim["b"] == 4


def test_what_is_no_block_is_refused():
    with pytest.raises(bf.PluginError, match="is no block; give classes"):
        bf.load(bf.Model("m").set("", step=1), blocks=[LowPass()])
    with pytest.raises(bf.PluginError, match="is no block"):
        bf.load(bf.Model("m").set("", step=1), blocks=[dict])
    with pytest.raises(TypeError, match="'time' is what a block reads"):
        type("Bad", (bf.Block,), {"time": bf.Input()})
    with pytest.raises(bf.RunError, match="needs a default"):
        bf.block(lambda u, *, k: u)
    with pytest.raises(bf.ModelError, match="no unit 'parsec'"):
        around(type("Bad", (bf.Block,), {"y": bf.Output(unit="parsec"), "output": lambda *_: None}))
    with pytest.raises(bf.ModelError, match="no element type 'complex'"):
        around(type("Bad", (bf.Block,), {"y": bf.Output(dtype="complex"), "output": lambda *_: None}))


def test_generated_code_and_sweeps_refuse_blocks_in_python_by_name(tmp_path):
    m = around(LowPass)
    with pytest.raises(bf.GenerationError, match=r"b \(python/LowPass\)"):
        m.generate(tmp_path / "generated")
    with pytest.raises(bf.RunError, match="written in Python"):
        bf.sweep(m, {"b.a": [0.1, 0.2]})


def test_models_without_them_are_generated(motor, tmp_path):
    motor.generate(tmp_path / "generated")
    assert (tmp_path / "generated/CMakeLists.txt").exists()


def test_blocks_in_python_run_in_threads():
    m = around(LowPass, {"a": 0.5})
    results = []

    def work():
        sim = m.simulate()
        sim.step(200)
        results.append(sim["b"].tolist())

    threads = [threading.Thread(target=work) for _ in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert len(results) == 4 and all(r == results[0] for r in results)


def test_an_interpreter_ends_while_a_block_in_python_runs():
    code = f"""
import sys, threading, time
sys.path.insert(0, {str(ROOT / "python/test")!r})
import test_block
sim = test_block.around(test_block.LowPass).simulate()
threading.Thread(target=lambda: sim.run(1e9), daemon=True).start()
time.sleep(0.2)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert (ended.returncode, ended.stderr) == (0, "")


class Untold(Exception):
    def __str__(self):
        raise RuntimeError("no text")


@pytest.mark.parametrize(
    "error, text",
    [(Untold(), "Untold: its text cannot be had"), (ValueError("a\ud800b"), r"ValueError: a\\ud800b")],
    ids=["without a text", "no Unicode"],
)
def test_an_exception_with_a_text_that_cannot_be_had_ends_the_run_as_any(error, text):
    @bf.block
    def Fails(u):
        raise error

    with pytest.raises(bf.StepError, match=text) as raised:
        around(Fails).simulate().step()
    assert raised.value.__cause__ is error


def test_a_function_that_returns_nothing_is_told_so():
    @bf.block
    def Nothing(u):
        pass

    with pytest.raises(bf.StepError, match="'y' is given None; write numbers, or return them"):
        around(Nothing).simulate().step()


def test_initial_values_that_do_not_fit_are_refused():
    class Wrong(bf.Block):
        y = bf.Output(3)
        x = bf.DiscreteState(3, initial=[1, 2])

        def output(self, at, out):
            out.y = at.x

    with pytest.raises(bf.ModelError, match="the initial value of discrete state 'x' has 2 elements, but needs 3; give one element or 3"):
        around(Wrong)


@pytest.mark.parametrize("shape, why", [((100000, 100000), "more than 100 million elements"), (-1, "a length of -1")])
def test_shapes_that_nothing_has_are_refused(shape, why):
    class Wrong(bf.Block):
        y = bf.Output(shape)

        def output(self, at, out):
            pass

    with pytest.raises(bf.ModelError, match=why):
        around(Wrong)


def test_blocks_that_compute_nothing_are_refused():
    class Silent(bf.Block):
        y = bf.Output()

    class Returns(bf.Block):
        y = bf.Output()

        def output(self, at, out):
            return 3.0

    with pytest.raises(bf.PluginError, match="Silent has no method 'output', which gives 'y' its value"):
        around(Silent)
    with pytest.raises(bf.StepError, match="its method 'output' returned float, which nobody takes; write to its last argument"):
        around(Returns).simulate().step()


@pytest.mark.parametrize("shape", [(2, 3, 4), "n-1", "2*n", 2.0, None, [2]])
def test_a_shape_that_says_nothing_is_refused_where_it_is_written(shape):
    with pytest.raises(ValueError, match="no length|has no shape"):
        bf.Input(shape)


def test_initial_values_of_a_matrix_are_its_rows():
    class Held(bf.Block):
        y = bf.Output((2, 3))
        x = bf.DiscreteState((2, 3), initial=np.arange(6.0).reshape(2, 3))

        def output(self, at, out):
            out.y = at.x

    sim = around(Held).simulate()
    sim.step()
    np.testing.assert_array_equal(sim["b"], [[0, 1, 2], [3, 4, 5]])


def test_ctrl_c_in_a_block_is_ctrl_c():
    @bf.block
    def Interrupted(u):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        around(Interrupted).simulate().run(1)


def test_a_model_without_the_classes_of_its_blocks_says_so():
    m = bf.Model("m").add("one", "Constant").add("b", "python/LowPass").set("", step=0.1).connect("one", "b")
    with pytest.raises(bf.ModelError, match=r"classes were not given; give them: load\(..., blocks=\[CLASS, ...\]\)"):
        bf.load(m)


SCRIPT = """
import blockfactory as bf

class Pass(bf.Block):
    u = bf.Input()
    y = bf.Output()
    def output(self, at, out):
        out.y = at.u
    def stop(self, at):
        print("stopped")

m = bf.Model("m").add("one", "Constant").add("b", "python/Pass").add("e", "Terminator").set("", step=0.1)
sim = bf.load(m.connect("one", "b").connect("b", "e"), blocks=[Pass]).simulate()
sim.observe(lambda of: None)
recorder = sim.record_to("run.mcap", "b")
sim.step(5)
"""


def test_a_script_that_ends_closes_its_devices_and_recordings(tmp_path):
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "stopped\n"), done.stderr
    recording = bf.read_recording(tmp_path / "run.mcap")
    assert recording.complete and len(recording["b"]) == 5
