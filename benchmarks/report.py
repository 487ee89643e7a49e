#!/usr/bin/env python3
"""Runs the benchmark program, prints a table and writes bench.json.

Usage: report.py PROGRAM OUTPUT [FILTER]. Figures are the least CPU time of interleaved repetitions, which other work on
the machine disturbs least; the ratio is value / reference of the same run.
"""
import collections
import json
import os
import pathlib
import re
import subprocess
import sys

SECOND = {"ns": 1e9, "us": 1e6, "ms": 1e3, "s": 1.0}
SIMULATED = 4.0  # s, of the closed-loop measurements

# name, unit, our measurement, its reference, target. Unit x: simulated seconds per second.
ROWS = [
    ("engine.scalar_block", "ns", "engine.scalar_block", "engine.scalar_block/hand_virtual", "<= 5 ns"),
    ("engine.vector23_block", "ns", "engine.vector23_block", "engine.vector23_block/hand_loop", "<= 16 ns"),
    ("engine.cartpole", "x", "engine.cartpole/diagram", "engine.cartpole/hand_loop", ">= 1000 x"),
    ("engine.cvode_1000_states", "ms", "engine.cvode_1000_states/diagram", "engine.cvode_1000_states/bare", "<= 1.15 x"),
    ("elaborate.1000_blocks", "ms", "elaborate.1000_blocks", "elaborate.blocks/10000", "< 100 ms"),
    ("analysis.linearize_1000", "ms", "analysis.linearize_1000/exact", "analysis.linearize_1000/differences", "< 100 ms"),
    ("analysis.linearize_icub", "ms", "analysis.linearize_icub/exact", "analysis.linearize_icub/steps", "<= 0.05 x"),
    ("analysis.linearize_icub_blocks", "ms", "analysis.linearize_icub/exact", "analysis.linearize_icub/blocks", ""),
    ("analysis.gradient_cartpole", "ms", "analysis.gradient_cartpole/gradient", "analysis.gradient_cartpole/run", "<= 5 x"),
    ("analysis.gradient_1024", "ms", "analysis.gradient_1024/adjoint", "analysis.gradient_1024/forward", "<= 0.05 x"),
    ("codegen.scalar_block", "ns", "codegen.scalar_block", "codegen.scalar_block/hand_loop", "<= 1 ns"),
    ("codegen.vector23_block", "ns", "codegen.vector23_block", "engine.vector23_block", "<= 10 ns"),
    ("codegen.compile_1000_blocks", "s", "codegen.compile_1000_blocks", "codegen.compile_1000_blocks/three_blocks", "< 15 s"),
    ("codegen.icub_vs_engine", "us", "codegen.icub_law/generated", "codegen.icub_law/engine", "<= 0.5 x"),
    ("codegen.icub_arithmetic", "us", "codegen.icub_law/arithmetic", "codegen.icub_law/engine", ""),
    ("codegen.icub_vs_hand", "us", "codegen.icub_law/generated", "codegen.icub_law/hand", "<= 1.2 x"),
    ("toolbox.whole_body_step", "us", "toolbox.whole_body_step/diagram", "toolbox.whole_body_step/bare_pinocchio", "<= 1.05 x"),
    ("toolbox.whole_body_step_30", "us", "toolbox.whole_body_step_30/diagram", "toolbox.whole_body_step_30/bare_pinocchio", "<= 1.05 x"),
    ("fmu.step", "ns", "fmu.step", "fmu.step/generated", "<= 100 ns more"),
    ("fmu.block", "ns", "fmu.block", "fmu.step", "<= 150 ns more"),
    ("fmu.save", "ns", "fmu.save", "fmu.save/memcpy", "<= 1.5 x"),
    ("fmu.restore", "ns", "fmu.restore", "fmu.save/memcpy", "<= 1.5 x"),
    ("fmu.icub", "x", "fmu.icub", "fmu.icub/model", ">= 0.95 of it"),
    ("fmu.export_1000_blocks", "s", "fmu.export_1000_blocks", "fmu.export_1000_blocks/three_blocks", "< 15 s"),
    ("toolbox.whole_body_step_idyntree", "us", "toolbox.whole_body_step/diagram", "toolbox.whole_body_step/idyntree", ""),
    ("toolbox.qp_12x38", "us", "toolbox.qp_12x38/block", "toolbox.qp_12x38/bare_daqp", "<= 1.1 x"),
    ("toolbox.hierarchy_3x60", "us", "toolbox.hierarchy_3x60/hierarchy", "toolbox.hierarchy_3x60/bare_daqp", "<= 1.2 x"),
    ("toolbox.ik_30", "us", "toolbox.ik_30/api", "toolbox.ik_30/bare_pinocchio", "< 50 us"),
    ("toolbox.walking_plan", "us", "toolbox.walking_plan/diagram", "toolbox.walking_plan/bare_dcm", "< 100 us"),
    ("toolbox.forward_dynamics", "us", "toolbox.forward_dynamics/api", "toolbox.forward_dynamics/bare_pinocchio", "<= 1.5 x"),
    ("toolbox.coriolis_matrix", "us", "toolbox.coriolis_matrix/api", "toolbox.coriolis_matrix/bare_pinocchio", "<= 1.5 x"),
    ("physics.step", "us", "physics.step/block", "physics.step/bare_mj_step", "<= 1.05 x"),
    ("physics.two_robots", "us", "physics.two_robots/world", "physics.two_robots/bare_mj_step", "<= 1.05 x"),
    ("physics.camera_320x240", "ms", "physics.camera_320x240/block", "physics.camera_320x240/bare_mujoco", "<= 1.1 x"),
    ("loop.icub_100hz", "x", "loop.icub_100hz/diagram", "loop.icub/bare_physics", ">= 45 x"),
    ("loop.icub_1khz", "x", "loop.icub_1khz/diagram", "loop.icub/bare_physics", ">= 0.5 of it"),
    ("middleware.exchange", "ns", "middleware.exchange/read", "middleware.exchange/memcpy", "< 200 ns"),
    ("middleware.shared_memory", "us", "middleware.shared_memory/round_trip", "middleware.shared_memory/pipes", "< 3 us"),
    ("middleware.yarp_read", "us", "middleware.yarp_read/board", "middleware.yarp_read/bare", "< 60 us"),
    ("middleware.ros2_latency", "us", "middleware.ros2_latency/streams", "middleware.ros2_latency/bare", "<= 1.2 x bare"),
    ("editor.open_1000", "ms", "editor.open_1000", "editor.open_100", "< 1000 ms"),
    ("editor.open_10000", "ms", "editor.open_10000", "editor.open_1000", "< 5000 ms"),
    ("editor.edit_1000", "ms", "editor.edit_1000", "editor.edit_1000/service", "< 100 ms"),
    ("editor.edit_1000/service", "ms", "editor.edit_1000/service", "editor.edit_1000/check", "< 100 ms"),
    ("editor.pan_1000", "ms", "editor.pan_1000", "editor.pan_1", "<= 20 ms"),
    ("editor.pan_1000/longest", "ms", "editor.pan_1000/longest", "editor.pan_1", "< 100 ms"),
    ("editor.draw_50", "ms", "editor.draw_50", "editor.edit_1000/check", "< 16 ms"),
    ("editor.live_100_signals", "ms", "editor.live_100_signals/watched", "editor.live_100_signals/alone", "<= 50 ms more"),
    ("editor.scrub", "ms", "editor.scrub", "editor.edit_1000/check", "< 200 ms"),
    ("boundary.read_23", "ns", "boundary.read_23", "boundary.read_23/bare", "<= 60 ns"),
    ("boundary.hosting", "ns", "boundary.hosting", "boundary.hosting/native", "<= 50 ns more"),
    ("realtime.overhead_p9999", "us", "realtime.overhead_p9999", "realtime.latency_p9999/cyclictest", "<= 20 us"),
    ("realtime.latency_p9999", "us", "realtime.latency_p9999", "realtime.latency_p9999/cyclictest", ""),
    ("realtime.ten_topics", "us", "realtime.ten_topics/with", "realtime.ten_topics/without", "1 x, within the scatter"),
    ("realtime.ten_topics/load", "us", "realtime.ten_topics/with", "realtime.ten_topics/beside", "1 x, within the scatter"),
    ("realtime.ten_topics/scatter", "us", "realtime.ten_topics/again", "realtime.ten_topics/without", ""),
    ("recording.append_23", "ns", "record_23_vector/at_ease", "copy_23_vector", ""),
    ("snapshot.icub", "us", "snapshot.icub", "snapshot.icub/memcpy", "< 1000 us"),
    ("restore.icub", "us", "restore.icub", "snapshot.icub/memcpy", "< 1000 us"),
    ("record.overhead", "ms", "record.overhead/all_signals/process_time/wall", "record.overhead/no_recording/process_time/wall", "<= 1.10 x"),
    ("record.overhead_cpu", "ms", "record.overhead/all_signals/process_time", "record.overhead/no_recording/process_time", ""),
    ("python.step_overhead", "ns", "python.step_overhead", "python.step/engine", "< 150 ns"),
    ("python.read", "ns", "python.read", "python.read/numpy_view", ""),
    ("python.block", "us", "python.block", "python.step/engine", ""),
    ("python.import", "ms", "python.import", "python.import/numpy", "< 300 ms"),
    ("profile.overhead", "ms", "profile.overhead/profiled/process_time", "record.overhead/no_recording/process_time", ""),
]


def measure(program, pattern):
    """Least CPU seconds per item (or iteration) by name of the measurement."""
    command = [program, "--benchmark_format=json", "--benchmark_repetitions=5", "--benchmark_enable_random_interleaving=true",
               "--benchmark_min_time=0.05"]
    if pattern:
        command.append(f"--benchmark_filter={pattern}")
    result = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    runs = collections.defaultdict(list)
    for entry in result["benchmarks"]:
        if entry["run_type"] != "iteration" or entry.get("error_occurred"):
            continue
        # A measurement that names its own clock is not about the CPU time of this program.
        own_clock = re.search("/(manual|real)_time", entry["run_name"])
        seconds = entry["real_time" if own_clock else "cpu_time"] / SECOND[entry["time_unit"]]
        if entry.get("items_per_second"):
            seconds = 1 / entry["items_per_second"]
        name = re.sub("/(iterations:[0-9]+|repeats:[0-9]+|manual_time|real_time)", "", entry["run_name"])
        runs[name].append(seconds)
        if name.endswith("/process_time"):  # of all threads; what a user waits for is
            runs[name + "/wall"].append(entry["real_time"] / SECOND[entry["time_unit"]])
    return {name: min(seconds) for name, seconds in runs.items()}


def measure_topics(build):
    """The same of the loop beside topics of ROS 2, where it is."""
    script = pathlib.Path(__file__).parent / "ros2_topics_benchmark.py"
    return json.loads(subprocess.run([sys.executable, script, build], check=True, stdout=subprocess.PIPE).stdout)


def measure_python(build):
    """The same of the Python package, where it was built."""
    root = pathlib.Path(__file__).parent.parent
    python = root / ".deps/python/bin/python"
    if not list(build.glob("python/blockfactory/_native*.so")) or not python.exists():
        return {}
    return json.loads(subprocess.run([python, root / "benchmarks/python_benchmark.py"], check=True, stdout=subprocess.PIPE,
                                     env={**os.environ, "PYTHONPATH": str(build / "python")}).stdout)


def main():
    program, output = sys.argv[1:3]
    pattern = sys.argv[3] if len(sys.argv) > 3 else ""
    times = measure(program, pattern)
    if re.search(pattern, "realtime.ten_topics"):
        times |= measure_topics(pathlib.Path(program).resolve().parent.parent)
    if re.search(pattern, "python"):
        times |= measure_python(pathlib.Path(program).resolve().parent.parent)
    rows = []
    for name, unit, ours, reference, target in ROWS:
        if ours not in times or reference not in times:
            print(f"{name}: not measured ({ours if ours not in times else reference} is missing)", file=sys.stderr)
            continue
        if unit == "x":
            value, peer = SIMULATED / times[ours], SIMULATED / times[reference]
        else:
            value, peer = times[ours] * SECOND[unit], times[reference] * SECOND[unit]
        rows.append({"name": name, "value": value, "unit": unit, "reference": peer, "ratio": value / peer})
        print(f"{name:34} {value:10.3f} {unit:3} {peer:10.3f} {unit:3}  ratio {value / peer:6.3f}   {target:10} beside {reference}")
    known = {row[2] for row in ROWS} | {row[3] for row in ROWS}
    for run in sorted(set(times) - known):
        print(f"{run:60} {times[run] * 1e6:12.3f} us")
    with open(output, "w") as file:
        json.dump(rows, file, indent=2)
        file.write("\n")


if __name__ == "__main__":
    main()
