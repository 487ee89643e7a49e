"""Sweeps."""

import numpy as np
import pytest

import blockfactory as bf
from conftest import OSCILLATOR


def test_a_sweep_has_a_row_for_every_combination(motor):
    table = bf.sweep(motor, {"Gain.Kp": [0.05, 0.1], "Gain.Ki": [0.5, 1, 2]}, finals=["motor.omega"], overrides={"stop": 0.5})
    assert [(r.point["Gain.Kp"], r.point["Gain.Ki"]) for r in table] == [(p, i) for p in (0.05, 0.1) for i in (0.5, 1, 2)]
    for row in table:
        sim = bf.load(motor.file, row.point, stop=0.5).simulate()
        sim.run()
        assert row.results["motor.omega"] == sim["motor.omega"] and row.error == ""
    assert list(table.to_pandas().columns)[:2] == ["Gain.Kp", "Gain.Ki"]


def test_progress_is_told(oscillator):
    seen = []
    bf.sweep(oscillator, {"d": list(range(5))}, progress=lambda done, count: seen.append((done, count)))
    assert seen[-1] == (5, 5) and [d for d, _ in seen] == sorted(d for d, _ in seen)


def test_documents_are_swept_as_they_are(write):
    m = bf.Model.read(write("m.yaml", OSCILLATOR)).set("position", initial=2)
    table = bf.sweep(m, {"stop": [0.01]}, finals=["position"])
    assert table[0].results["position"] == 2


def test_a_run_that_fails_is_a_row_with_its_error(oscillator):
    good, bad = bf.sweep(oscillator, {"solver": ["rk4", "rk5"]})
    assert good.error == "" and "rk5" in bad.error and bad.failed_at < 0


def test_what_is_asked_wrongly_is_raised(motor, tmp_path):
    with pytest.raises(bf.FileError, match="no.yaml"):
        bf.sweep(tmp_path / "no.yaml", {"a": [1]})
    with pytest.raises(bf.WrongValue):
        bf.sweep(motor, {"Gain.Kp": [object()]})
    for value in (3, "12"):
        with pytest.raises(bf.WrongValue, match="a sweep takes a list of values of 'Gain.Kp', and not"):
            bf.sweep(motor, {"Gain.Kp": value})
    with pytest.raises(bf.RunError, match="at most 1000000"):
        bf.sweep(motor, {"Gain.Kp": [1] * 2000, "Gain.Ki": [1] * 2000})
