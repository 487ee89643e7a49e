"""Recordings, of runs and of files."""

import subprocess

import mcap.reader
import numpy as np
import pytest

import blockfactory as bf
from conftest import OSCILLATOR


def test_a_recording_in_memory_grows_with_the_run(motor):
    sim = motor.simulate()
    recording = sim.record()
    assert set(recording) == {"reference", "motor.omega", "motor.i", "controller.voltage"}
    sim.run(0.1)
    omega = recording["motor.omega"]
    assert len(omega) == 100 and len(recording["controller.voltage"]) == 10
    np.testing.assert_allclose(omega.time, np.arange(100) * 0.001, atol=1e-12)
    before = omega.values
    sim.run(0.1)
    assert len(before) == 100 and len(omega.values) == 200
    np.testing.assert_array_equal(omega.values[:100], before)
    sim.end_record(recording)
    sim.run(0.1)
    assert len(omega.values) == 200


def test_a_recording_in_a_file_is_the_same_and_others_read_it(motor, tmp_path):
    file = tmp_path / "run.mcap"
    sim = motor.simulate()
    memory = sim.record()
    with sim.record_to(file) as recorder:
        sim.run(0.5)
        recorder.checkpoint()
    read = bf.read_recording(file)
    assert read.complete and set(read) == set(memory)
    for path in memory:
        np.testing.assert_array_equal(read[path].values, memory[path].values)
        np.testing.assert_array_equal(read[path].nanoseconds, memory[path].nanoseconds)
    assert read.plots == memory.plots == motor.plots
    assert "checkpoint/500" in read.attachments and b"model: motor" in read.attachments["model"]
    with open(file, "rb") as stream:
        summary = mcap.reader.make_reader(stream).get_summary()
    assert {c.topic for c in summary.channels.values()} == {"/" + p.replace(".", "/") for p in memory}


def test_values_of_a_file_are_views_that_keep_it(motor, tmp_path):
    sim = motor.simulate()
    with sim.record_to(tmp_path / "run.mcap"):
        sim.run(0.2)
    values = bf.read_recording(tmp_path / "run.mcap")["motor.omega"].values
    assert len(values) == 200 and not values.flags.writeable and not values.flags.owndata
    assert np.isfinite(values).all()


def test_vectors_and_matrices_keep_their_shape(tmp_path):
    m = bf.Model("m").add("t", "Clock").add("v", "Gain", K=[1, 2, 3]).add("c", "Constant", value=[[1, 2, 3], [4, 5, 6]])
    m.add("e", "Terminator").add("f", "Terminator").connect("t", "v").connect("v", "e").connect("c", "f")
    m.set("", step=0.1)
    sim = bf.load(m).simulate()
    memory = sim.record(["v", "c"])
    with sim.record_to(tmp_path / "r.mcap", ["v", "c"]):
        sim.step(5)
    for recording in (memory, bf.read_recording(tmp_path / "r.mcap")):
        np.testing.assert_allclose(recording["v"].values, 0.1 * np.outer(np.arange(5), [1, 2, 3]), atol=1e-15)
        np.testing.assert_array_equal(recording["c"].values, [[[1, 2, 3], [4, 5, 6]]])
        assert recording["c"].elements() == [f"[{r}][{c}]" for r in (1, 2) for c in (1, 2, 3)]


def test_xarray_has_a_time_for_each_rate_and_pandas_one_for_all(motor):
    sim = motor.simulate()
    recording = sim.record()
    sim.run(0.1)
    data = recording.to_xarray()
    assert dict(data.sizes) == {"time": 100, "time_2": 10}
    assert data["motor.omega"].sel(time=0.05, method="nearest") == recording["motor.omega"].values[50]
    table = recording.to_pandas()
    assert list(table.columns) == list(recording) and len(table) == 100
    assert table["controller.voltage"].notna().sum() == 10, "NaN between its samples"
    np.testing.assert_array_equal(table["motor.omega"].to_numpy(), recording["motor.omega"].values)


def test_signals_are_chosen_by_patterns(motor):
    sim = motor.simulate()
    assert "controller.sum.y" in sim.record("controller.*")
    with pytest.raises(bf.UnknownName, match="no signal 'motor.omego'; did you mean"):
        sim.record("motor.omego")
    with pytest.raises(bf.FileError, match="nowhere"):
        sim.record_to("/nowhere/run.mcap")


def test_a_recording_draws_itself(motor):
    sim = motor.simulate()
    recording = sim.record()
    sim.run(0.5)
    svg = recording._repr_svg_()
    assert svg.lstrip().startswith("<?xml") and "<path" in svg
    assert [axis.get_title(loc="left") for axis in recording.plot().axes] == list(motor.plots)
    assert [len(axis.lines) for axis in recording.plot().axes] == [2, 1, 1]


def test_a_cut_file_is_read_up_to_there(motor, tmp_path):
    sim = motor.simulate()
    with sim.record_to(tmp_path / "run.mcap"):
        sim.run(1)
    content = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    cut = bf.read_recording(tmp_path / "cut.mcap")
    assert not cut.complete and cut.defect
    (tmp_path / "none.mcap").write_bytes(b"no recording at all")
    with pytest.raises(bf.FileError, match="none.mcap"):
        bf.read_recording(tmp_path / "none.mcap")


def test_a_run_is_not_recorded_from_its_own_observer(oscillator, tmp_path):
    sim = oscillator.simulate()
    began = [sim.record(), sim.record_to(tmp_path / "a.mcap")]

    def look(of):
        for begin in (of.record, lambda: of.record_to(tmp_path / "b.mcap"), began[1].close, lambda: of.end_record(began[0])):
            with pytest.raises(bf.RunError, match="stepped by another thread, or by its own observer"):
                begin()

    sim.observe(look)
    sim.step(3)
    assert len(began[0]["position"]) == 3


def test_a_table_has_the_samples_of_events_in_their_order():
    m = bf.load(bf.example("bouncing_ball/model.yaml"))
    with m.simulate() as sim:
        recording = sim.record()
        sim.run()
    table = recording.to_pandas()
    assert len(table) == max(len(series) for series in recording.values())
    height = recording["height"]
    np.testing.assert_array_equal(table["height"].dropna(), height.values)
    assert table.index.is_monotonic_increasing and table.index.duplicated().any()


def test_a_recording_without_samples_shows_itself(oscillator):
    recording = oscillator.simulate().record()
    assert len(recording.to_pandas()) == 0
    assert recording._repr_svg_().startswith("<?xml")


def test_a_checkpoint_is_not_made_within_a_step(oscillator, tmp_path):
    sim = oscillator.simulate()
    recorder = sim.record_to(tmp_path / "a.mcap")
    sim.observe(lambda of: recorder.checkpoint())
    with pytest.raises(bf.RunError, match="stepped by another thread, or by its own observer"):
        sim.step()
