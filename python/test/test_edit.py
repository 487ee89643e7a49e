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
