"""Documents that are built and edited."""

import json
import typing

import pytest

import blockfactory as bf
from blockfactory import _native
from blockfactory import operations as op
from conftest import OSCILLATOR


def built():
    m = bf.Model("oscillator")
    m.set("", step=0.01, stop=4, solver="rk4")
    m.set_variable("k", 40, minimum=0, unit="N/m").set_variable("d", 1.5)
    m.add("force", "Sum", signs="--").add("velocity", "Integrator").add("position", "Integrator", initial=1)
    m.add("spring", "Gain", K="k").add("damper", "Gain", K="d")
    m.connect("force", "velocity").connect("velocity", "position", "damper").connect("position", "spring")
    m.connect("spring", "force.u1").connect("damper", "force.u2")
    return m.record("position", "velocity").plot("Position", ["position"])


def test_a_model_that_is_built_equals_the_one_that_is_written():
    assert built() == bf.Model.parse(OSCILLATOR)


def test_edits_keep_the_text_of_all_else_and_are_undone():
    text = "# kept\n" + OSCILLATOR
    m = bf.Model.parse(text)
    assert m.text == text
    m.rename("damper", "friction").set("friction", K="8*d")
    assert m.text.startswith("# kept\n") and m.settings("friction") == {"K": "8*d"}
    assert "friction: force.u2" in m.text
    assert m.undo() and m.undo() and not m.undo()
    assert m.text == text
    assert m.redo() and "friction" in m.blocks


def test_sample_time_doc_and_variant_are_of_every_block():
    m = bf.Model("m").set("", step=0.1)
    m.add("one", "Constant", value=3, period=0.2, doc="slow").add("end", "Terminator", when="1 == 1")
    m.add("late", "Gain", period="T", offset=0.1).set_variable("T", 0.3)
    m.connect("one", "late").connect("late", "end")
    assert m.settings("one") == {"value": "3"}
    assert m == bf.Model.parse(m.text)
    assert bf.load(m).signals["late"].period == pytest.approx(0.3)
    with pytest.raises(bf.ModelError, match="fast: the block has no argument or parameter 'rate'"):
        bf.load(m.copy().add("fast", "Constant", rate=1))


def test_a_chart_is_a_mapping_as_in_a_file():
    chart = {"parameters": ["T"], "outputs": ["b"], "states": {"a": {"transitions": [{"to": "b", "after": "T"}]}, "b": {}}}
    m = bf.Model("m").set("", step=0.1).add("plan", "StateMachine", p=0.2, chart=chart)
    assert m == bf.Model.parse(m.text)
    sim = bf.load(m).simulate()
    assert sim.run(1, until="plan.b > 0") and sim["plan.time_in_state"] == 0
    m.set("plan", chart={"outputs": ["c"], "states": {"c": {}}})
    assert "plan.c" in bf.load(m).signals


def test_an_edit_that_is_refused_changes_nothing():
    m = bf.Model.parse(OSCILLATOR)
    with pytest.raises(bf.ModelError, match="no block or port 'dampr'.*did you mean 'damper'"):
        m.edit(op.Rename("spring", "s"), op.Rename("dampr", "d"))
    assert m == bf.Model.parse(OSCILLATOR)
    with pytest.raises(bf.ModelError, match="taken"):
        m.rename("spring", "damper")
    with pytest.raises(bf.ModelError, match="there is no operation 'explode'"):
        m.edit({"do": "explode"})


def test_models_are_values():
    a = bf.Model.parse(OSCILLATOR)
    b = a.copy()
    b.remove("spring")
    assert a != b and "spring" in a.blocks and "spring" not in b.blocks


def test_an_edited_model_runs_and_its_file_is_written_when_saved(write):
    file = write("m.yaml", OSCILLATOR)
    m = bf.Model.read(file)
    m.set("position", initial=2)
    sim = bf.load(m).simulate()
    sim.step()
    assert sim["position"] == 2
    assert file.read_text() == OSCILLATOR
    m.save()
    assert bf.Model.read(file) == m and file.read_text() != OSCILLATOR


def test_subsystems_are_grouped_and_dissolved():
    m = built()
    m.edit(op.Group("", ["spring", "damper"], "material"))
    assert "material.spring" in m.blocks
    m.edit(op.Dissolve("material"))
    assert set(m.blocks) == set(built().blocks)


def sample(kind, hints):
    """A value of an annotation that is not the usual one."""
    origin = typing.get_origin(kind)
    arguments = [a for a in typing.get_args(kind) if a is not type(None)]
    if kind is str:
        return "a"
    if kind is bool:
        return True
    if kind is int:
        return 2
    if kind is float:
        return 3.5
    if origin is not None and arguments == list(typing.get_args(op.Operation)):
        return op.Remove("x")
    if origin is not None and len(arguments) == 1:
        inner = sample(arguments[0], hints)
        return [inner] if "Sequence" in str(origin) else inner
    return filled(kind)


WORDS = {
    ("Port", "when_disabled"): "reset",
    ("System", "execution"): "enabled",
    ("System", "states"): "reset",
    ("System", "trigger"): "either",
    ("System", "reset"): "falling",
    ("Display", "shows"): "bars",
    ("PlacePort", "side"): "top",
    ("Block", "system"): None,
    ("System", "blocks"): (),
    ("Variable", "fields"): (),
}


def filled(kind):
    hints = typing.get_type_hints(kind)
    return kind(**{name: WORDS.get((kind.__name__, name), None) if (kind.__name__, name) in WORDS else sample(hint, hints) for name, hint in hints.items()})


@pytest.mark.parametrize("kind", [*typing.get_args(op.Operation), op.System])
def test_every_operation_is_the_one_of_the_library(kind):
    value = filled(kind)
    if kind is op.System:
        value = op.Add("a", op.Block("a", system=value))
    text = json.dumps(op.to_json(value))
    assert json.loads(_native._operation(text)) == json.loads(text)


def test_there_are_all_operations_of_the_library():
    assert len(typing.get_args(op.Operation)) == _native._operations - 1, "all but the patch"
