"""Runs: stepping, signals, parameters, snapshots, events, threads."""

import gc
import subprocess
import sys
import threading
import time
import weakref

import numpy as np
import pytest
import scipy.integrate
import scipy.signal

import blockfactory as bf
from conftest import LINEAR, OSCILLATOR, ROOT


def test_a_run_knows_its_model(motor):
    assert motor.simulate().model is motor


def test_a_run_agrees_with_scipy(oscillator):
    sim = oscillator.simulate()
    sim.run(2)
    exact = scipy.integrate.solve_ivp(lambda t, x: [x[1], -40 * x[0] - 1.5 * x[1]], (0, 2), [1, 0], rtol=1e-11, atol=1e-12)
    # Outputs are those of the last step, the states are one step on: one more step shows them.
    sim.step()
    assert sim.time == pytest.approx(2.01)
    assert sim["position"] == pytest.approx(exact.y[0, -1], abs=1e-6)
    assert sim["velocity"] == pytest.approx(exact.y[1, -1], abs=1e-5)


def test_inputs_are_written_between_steps_and_a_linear_system_agrees_with_scipy(write):
    sim = bf.load(write("linear.yaml", LINEAR)).simulate()
    u = np.random.default_rng(1).normal(size=(50, 2))
    A = [[0.9, 0.1, 0], [-0.2, 0.8, 0.05], [0, 0.3, 0.7]]
    B = [[1, 0], [0, 0.5], [0.2, 0]]
    _, expected, _ = scipy.signal.dlsim((A, B, [[1, 0, 0], [0, 1, 1]], np.zeros((2, 2)), 0.1), u)
    y = sim["y"]
    for k in range(50):
        sim.inputs["u"] = u[k]
        sim.step()
        np.testing.assert_allclose(y, expected[k], rtol=1e-12, atol=1e-14)


def test_a_signal_is_a_view_that_follows_the_run(oscillator):
    sim = oscillator.simulate()
    sim.step()
    x = sim["position"]
    address = x.__array_interface__["data"][0]
    assert x == 1 and sim["position"].__array_interface__["data"][0] == address
    sim.run(0.1)
    assert x == sim["position"] != 1
    with pytest.raises(ValueError, match="read-only"):
        x[()] = 3
    with pytest.raises(ValueError):
        x.flags.writeable = True


def test_a_view_keeps_the_run_alive_and_nothing_else_does(oscillator):
    sim = oscillator.simulate()
    x = sim["position"]
    sim.run(0.1)
    value = float(x)
    gone = weakref.ref(sim)
    del sim
    gc.collect()
    assert gone() is not None and float(x) == value
    del x
    gc.collect()
    assert gone() is None


def test_matrices_have_rows_and_columns():
    m = bf.Model("m").add("c", "Constant", value=[[1, 2, 3], [4, 5, 6]]).add("e", "Terminator").connect("c", "e").set("", step=1)
    sim = bf.load(m).simulate()
    assert sim["c"].shape == (2, 3) and sim["c"].strides == (8, 16)
    np.testing.assert_array_equal(sim["c"], [[1, 2, 3], [4, 5, 6]])


def test_parameters_are_set_in_the_run_within_their_limits(motor):
    sim = motor.simulate()
    gain = sim.parameters["controller.proportional.K"]
    sim.parameters["controller.proportional.K"] = 0.5
    assert gain == 0.5
    with pytest.raises(bf.WrongValue, match="NaN"):
        sim.parameters["controller.proportional.K"] = float("nan")
    with pytest.raises(bf.WrongValue, match=r"shape \(\), but the value has shape \(2,\)"):
        sim.parameters["controller.proportional.K"] = [1, 2]
    with pytest.raises(bf.WrongValue, match="upper"):
        sim.parameters.set({"controller.proportional.K": 1, "controller.limit.upper": -100})
    with pytest.raises(bf.UnknownName, match="did you mean"):
        sim.parameters["controller.proportional.k"] = 1
    with pytest.raises(bf.WrongValue, match="text"):
        sim.parameters["controller.proportional.K"] = "text"
    assert gain == 0.5, "what is refused changes nothing"


def test_a_variable_changes_all_that_follows_from_it(motor):
    sim = motor.simulate()
    sim.variables["supply"] = 12
    assert sim.parameters["controller.limit.lower"] == -12 and sim.parameters["controller.limit.upper"] == 12
    assert sim.variables["supply"] == 12
    with pytest.raises(bf.UnknownName, match="suply"):
        sim.variables["suply"] = 1


def test_snapshots_go_on_bit_for_bit(motor):
    sim = motor.simulate()
    sim.run(0.3)
    here = sim.snapshot()
    sim.run(0.4)
    after = {path: sim[path].copy() for path in sim.keys()}
    sim.restore(here)
    assert sim.time == pytest.approx(0.3)
    sim.run(0.4)
    for path, value in after.items():
        np.testing.assert_array_equal(sim[path], value, err_msg=path)
    other = motor.simulate()
    other.restore(here)
    other.run(0.4)
    assert all((other[path] == value).all() for path, value in after.items())


@pytest.mark.parametrize("damage", [lambda s: s[:-5], lambda s: b"", lambda s: s[:100] + b"x" + s[101:]])
def test_a_snapshot_that_is_damaged_is_refused(motor, damage):
    sim = motor.simulate()
    with pytest.raises(bf.RunError, match="snapshot"):
        sim.restore(damage(sim.snapshot()))
    with pytest.raises(TypeError):
        sim.restore("text")


def test_a_snapshot_of_another_model_is_refused(motor, oscillator):
    with pytest.raises(bf.RunError, match="oscillator|motor"):
        motor.simulate().restore(oscillator.simulate().snapshot())


def test_runs_end_at_events(motor):
    sim = motor.simulate()
    assert sim.run(until="motor.omega > 100")
    assert sim["motor.omega"] > 100
    time = sim.time
    other = motor.simulate()
    assert other.run(until=lambda s: s["motor.omega"] > 100)
    assert other.time == time
    assert not sim.run(to=1.2, until="motor.omega > 1000")
    assert sim.time == pytest.approx(1.2)
    with pytest.raises(bf.RunError, match="is no event"):
        sim.run(1, until="motor.omega")


def test_a_run_without_an_end_asks_for_one(write):
    sim = bf.load(write("linear.yaml", LINEAR)).simulate()
    with pytest.raises(bf.RunError, match="does not say when it ends: give a duration"):
        sim.run()
    with pytest.raises(bf.RunError, match="both a duration and a time"):
        sim.run(1, to=2)
    with pytest.raises(bf.RunError):
        sim.run(float("nan"))
    with pytest.raises(bf.RunError):
        sim.step(-1)


def test_a_step_that_fails_says_where_and_why_and_restore_goes_back():
    m = bf.Model("m").add("c", "Constant", value=1).add("a", "Assertion").add("d", "Clock")
    m.add("small", "CompareToConstant", operator="<", constant=0.45).remove("c")
    m.connect("d", "small").connect("small", "a").set("", step=0.1)
    sim = bf.load(m).simulate()
    here = sim.snapshot()
    with pytest.raises(bf.StepError, match="^a: ") as caught:
        sim.run(2)
    assert caught.value.time == pytest.approx(0.5)
    assert sim.failure.startswith("a: ")
    with pytest.raises(bf.StepError):
        sim.step()
    sim.restore(here)
    sim.run(0.3)


def test_signals_that_are_not_there_are_key_errors_with_near_ones(motor):
    sim = motor.simulate()
    with pytest.raises(KeyError):
        sim["nothing"]
    with pytest.raises(bf.UnknownName, match="did you mean 'motor.omega'"):
        sim["motor.omego"]
    assert "motor.omega" in sim and "motor.omego" not in sim and 3 not in sim
    with pytest.raises(TypeError):
        sim[3]


def test_observers_see_every_step_and_what_they_raise_ends_the_run(motor):
    sim = motor.simulate()
    seen = []
    end = sim.observe(lambda s: seen.append(float(s["motor.omega"])))
    recording = sim.record("motor.omega")
    sim.run(0.1)
    np.testing.assert_array_equal(seen, recording["motor.omega"].values)
    end()
    sim.step()
    assert len(seen) == 100

    def refuse(s):
        if s.steps == 110:
            raise ZeroDivisionError("enough")

    sim.observe(refuse)
    with pytest.raises(ZeroDivisionError, match="enough"):
        sim.run(1)
    assert sim.steps in (110, 111)


def test_a_function_that_observes_is_ended_beside_recordings(motor):
    sim, seen = motor.simulate(), []
    recording = sim.record("motor.omega")
    end = sim.observe(lambda s: seen.append(s.steps))
    sim.step(2)
    end()
    sim.step(2)
    assert len(seen) == 2 and len(recording["motor.omega"]) == 4


def test_a_run_whose_observer_holds_it_is_freed(motor):
    class Watch:
        def __init__(self):
            self.sim = motor.simulate()
            self.sim.record("motor.omega")
            self.sim.observe(self.look)
            self.sim.step()

        def look(self, sim):
            pass

    watch = Watch()
    freed = weakref.ref(watch), weakref.ref(watch.sim)
    del watch
    gc.collect()
    assert [one() for one in freed] == [None, None]


def test_an_observer_does_not_step_its_own_run(motor):
    sim = motor.simulate()
    sim.observe(lambda s: s.step())
    with pytest.raises(bf.RunError, match="being stepped"):
        sim.step()


def test_checks_say_what_the_model_checks(motor):
    sim = motor.simulate()
    sim.run()
    assert set(sim.checks) == {"speed_error", "speed_error.passed", "top_speed", "top_speed.passed"}
    assert sim.checks["top_speed.passed"] is True and 150 < sim.checks["top_speed"] < 210


def test_threads_run_at_the_same_time_and_alike(motor):
    expected = motor.simulate()
    expected.run()
    results = []

    def work():
        sim = motor.simulate()
        sim.run()
        results.append(float(sim["motor.omega"]))

    threads = [threading.Thread(target=work) for _ in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert results == [float(expected["motor.omega"])] * 8


def test_python_goes_on_while_a_run_computes(motor):
    sim = motor.simulate()
    thread = threading.Thread(target=lambda: sim.run(2000))
    thread.start()
    count = 0
    while thread.is_alive():
        count += 1
        time.sleep(0.001)
        if count == 5:
            with pytest.raises(bf.RunError, match="stepped by another thread"):
                sim.step()
    thread.join()
    assert count >= 5, "the GIL was held"


ENDS = {
    "a run in the main thread": "bf.load(file).simulate().run(0.1)",
    "a view that is left": "global x; sim = bf.load(file).simulate(); x = sim['motor.omega']",
    "a daemon thread in mid-run": (
        "import threading, time; sim = bf.load(file).simulate()\n"
        "threading.Thread(target=lambda: sim.run(1e9), daemon=True).start(); time.sleep(0.1)"
    ),
    "a daemon thread with an observer": (
        "import threading, time; sim = bf.load(file).simulate(); sim.observe(lambda s: None)\n"
        "threading.Thread(target=lambda: sim.run(1e9), daemon=True).start(); time.sleep(0.1)"
    ),
    "an exit in an observer": "sim = bf.load(file).simulate(); sim.observe(lambda s: sys.exit(0)); sim.run(1)",
}


@pytest.mark.parametrize("how", ENDS)
def test_the_interpreter_ends_in_mid_run(how):
    file = str(ROOT / "docs/start/motor.yaml")
    code = f"import sys, blockfactory as bf\nfile = {file!r}\n{ENDS[how]}\nprint('done')"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=20)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""


def test_ctrl_c_ends_a_run_between_two_steps():
    file = str(ROOT / "docs/start/motor.yaml")
    code = (
        "import blockfactory as bf, os, signal, threading\n"
        f"sim = bf.load({file!r}).simulate()\n"
        "threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "try: sim.run(1e9)\n"
        "except KeyboardInterrupt: sim.step(); print('interrupted')\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=20)
    assert ended.stdout == "interrupted\n", ended.stderr


def test_errors_go_from_process_to_process():
    import pickle

    step = pickle.loads(pickle.dumps(bf.StepError("b: failed", 0.1)))
    assert (str(step), step.time) == ("b: failed", 0.1)
    with pytest.raises(bf.ModelError) as raised:
        bf.load(bf.Model("m").add("a", "Gian"))
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value)


def test_a_function_ends_a_run_where_a_text_does(oscillator):
    for how in ({"duration": 0.0151}, {"to": 0.012}, {"duration": 0.01}):
        plain, asked = oscillator.simulate(), oscillator.simulate()
        plain.run(**how)
        assert asked.run(**how, until=lambda of: False) is False
        assert asked.steps == plain.steps
    for how in ({"duration": float("nan")}, {"duration": -1}, {"duration": 1, "to": 5}):
        with pytest.raises(bf.RunError):
            oscillator.simulate().run(**how, until=lambda of: False)


def test_a_run_does_not_go_back_in_time(oscillator):
    sim = oscillator.simulate()
    sim.run(0.5)
    text = "a run does not go back: it is at 0.5 s, after the 0.2 s to which it should go; restore a snapshot"
    for until in (None, "position > 1e9", lambda of: False):
        with pytest.raises(bf.RunError, match=text):
            sim.run(to=0.2, until=until)
    assert not sim.run(to=sim.time)
    assert sim.time == pytest.approx(0.5)


def test_what_is_no_name_and_no_number_is_refused_as_such(oscillator):
    sim = oscillator.simulate()
    for ask in (lambda: sim.record(3), lambda: oscillator.linearize(3), lambda: sim.trim(["position", 3])):
        with pytest.raises(bf.WrongValue, match="a name is a text, and not 3"):
            ask()
    with pytest.raises(bf.WrongValue, match="'spring.K' is real, and given complex numbers"):
        sim.parameters["spring.K"] = np.array(1 + 2j)
    with pytest.raises(bf.WrongValue, match="a response lasts 0 s, until it has settled, or longer, not -1 s"):
        oscillator.linearize("force", "position").step_response(-1)
    with pytest.raises(bf.WrongValue, match="'position' takes a number, and not 'high'"):
        sim.trim(target={"position": "high"})
    with pytest.raises(bf.WrongValue, match=r"the bounds of 'position.x' are \(lower, upper\), and not 1"):
        sim.trim(bounds={"position.x": 1})
    with pytest.raises(bf.RunError, match="'position' cannot come to nan"):
        sim.trim(target={"position": float("nan")})
    with pytest.raises(bf.UnknownName, match="no variable 'kk' of numbers; did you mean 'k'"):
        sim.variables["kk"]
    with pytest.raises(bf.UnknownName, match="there is no signal 'positio'; did you mean 'position'"):
        oscillator.signals["positio"]


def test_a_folder_is_no_model():
    with pytest.raises(bf.FileError, match="cannot read '.': it is a folder; give the name of a file"):
        bf.load(".")


def test_a_file_that_is_not_there_is_an_error_of_files():
    with pytest.raises(bf.FileError, match="cannot read 'nofile.yaml': there is no such file"):
        bf.load("nofile.yaml")
