"""What a model says of itself, and what is wrong with it."""

import pathlib

import numpy as np
import pytest

import blockfactory as bf
from conftest import OSCILLATOR, ROOT


def test_a_model_names_its_blocks_signals_and_parameters(motor):
    assert motor.name == "motor"
    assert motor.step == 0.001
    assert motor.stop == 1.2
    gain = motor.blocks["controller.proportional"]
    assert (gain.type, gain.library, gain.period) == ("Gain", "", 0.01)
    assert list(gain.inputs) == ["u"] and list(gain.outputs) == ["y"] and list(gain.parameters) == ["K"]
    assert gain.where.endswith("motor.yaml:22:7")
    assert motor.signals["motor.omega"].shape == ()
    assert motor.signals["motor.omega"].dtype == "float64"
    assert motor.plots["Current [A]"] == ["motor.i"]
    assert "controller.limit.upper" in motor.parameters


def test_values_of_variables_reach_the_blocks():
    file = ROOT / "docs/start/motor.yaml"
    for m in (
        bf.load(file, {"Gain.Kp": 0.3}),
        bf.load(file, {"Gain": {"Kp": 0.3}}),
        bf.load(file, {"Gain.Kp": "0.1*3"}),
        bf.load(file, {"controller.proportional.K": np.float64(0.3)}),
    ):
        assert m.simulate().parameters["controller.proportional.K"] == pytest.approx(0.3, abs=1e-16)
    assert bf.load(file, stop=0.5).stop == 0.5


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, -2.5, 7, np.float32(0.1), np.int8(-3)])
def test_numbers_keep_every_bit(oscillator, value):
    m = bf.load(oscillator.edit(), d=value)
    assert m.simulate().parameters["damper.K"] == float(value)


def test_arrays_become_vectors_and_matrices():
    m = bf.Model("gains")
    m.add("one", "Constant", value=np.arange(3.0)).add("two", "Constant", value=[[1, 2], [3, 4.5]])
    m.add("end1", "Terminator").add("end2", "Terminator")
    m.connect("one", "end1").connect("two", "end2").set("", step=0.1)
    sim = bf.load(m).simulate()
    np.testing.assert_array_equal(sim["one"], [0, 1, 2])
    np.testing.assert_array_equal(sim["two"], [[1, 2], [3, 4.5]])


def test_what_is_wrong_is_one_exception_with_all_mistakes(write):
    text = OSCILLATOR.replace("{block: Gain, K: k}", "{block: Gian, K: k}").replace("K: d}", "K: dd}")
    with pytest.raises(bf.ModelError, match=r"oscillator.yaml:\d+:\d+: spring: .*Gian.*did you mean 'Gain'") as caught:
        bf.load(write("oscillator.yaml", text))
    first, second = caught.value.diagnostics
    assert (first.path, second.path) == ("spring", "damper.K")
    assert pathlib.Path(first.file).name == "oscillator.yaml" and first.line > 0 and first.column > 0
    assert isinstance(caught.value, ValueError)


def test_a_wrong_model_can_be_examined_and_not_be_run(write):
    m = bf.examine(write("oscillator.yaml", OSCILLATOR.replace("K: d}", "K: dd}")))
    assert [d.path for d in m.diagnostics] == ["damper.K"]
    assert m.signals["position"].shape == ()
    with pytest.raises(bf.ModelError, match="dd"):
        m.simulate()


def test_names_that_are_not_there_are_key_errors_with_near_ones(motor):
    with pytest.raises(KeyError):
        motor.blocks["controller.pd"]
    with pytest.raises(bf.UnknownName, match="no block 'controler.limit'; did you mean 'controller.limit'"):
        motor.blocks["controler.limit"]


def test_values_that_no_model_has_are_refused(motor):
    with pytest.raises(bf.WrongValue, match="is no value of a model"):
        bf.load(motor.file, {"Gain.Kp": object()})
    with pytest.raises(bf.WrongValue, match="at most two dimensions"):
        bf.load(motor.file, {"Gain.Kp": np.zeros((2, 2, 2))})
    with pytest.raises(bf.ModelError, match="Gain.Kq"):
        bf.load(motor.file, {"Gain.Kq": 3})


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(bf.Error, match="none.yaml"):
        bf.load(tmp_path / "none.yaml")
    with pytest.raises(OSError):
        bf.read_recording(tmp_path / "none.mcap")


def test_limits_of_parameters_are_said():
    m = bf.Model("m").add("c", "Constant", value=1).add("q", "Quantize").add("e", "Terminator")
    m.connect("c", "q").connect("q", "e").set("", step=0.01)
    assert bf.load(m).parameters["q.interval"].above == 0
    with pytest.raises(bf.WrongValue, match="must be greater than 0, but is -1"):
        bf.load(m).simulate().parameters["q.interval"] = -1


def test_a_diagram_draws_itself(motor):
    svg = motor._repr_svg_()
    assert svg.startswith("<svg") and "controller" in svg
    assert "proportional" in motor.draw("controller").svg
    assert motor.draw("controller", dark=True).svg != motor.draw("controller").svg
    with pytest.raises(bf.UnknownName, match="sizes"):
        motor.draw(show="colours")
    with pytest.raises(bf.ModelError, match="nowhere"):
        motor.draw("nowhere")


def test_examples_come_with_the_package():
    assert bf.load(bf.example("cart_pole/model.yaml")).name == "cart_pole"
    with pytest.raises(bf.FileError, match="no example 'none.yaml'; there is .*cart_pole/model.yaml"):
        bf.example("none.yaml")
    with pytest.raises(bf.FileError, match="build folder"):
        bf.prefix()
