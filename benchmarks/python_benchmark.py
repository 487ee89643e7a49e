#!/usr/bin/env python3
"""What Python costs, as JSON: seconds by name of the measurement, the least of interleaved repetitions. Run it with the package
in PYTHONPATH."""
import json
import resource
import subprocess
import sys
import time

import blockfactory as bf
import numpy

REPETITIONS = 7


class Twice(bf.Block):
    u = bf.Input("n")
    y = bf.Output("n")

    def output(self, at, out):
        out.y = 2 * at.u


def gain(type, **settings):
    m = bf.Model("m").set("", step=0.001).add("c", "Constant", value=[1, 2, 3]).add("t", "Clock").add("s", "Product")
    m.add("g", type, **settings).add("e", "Terminator").connect("c", "s.u1").connect("t", "s.u2")
    return bf.load(m.connect("s", "g").connect("g", "e"), blocks=[Twice]).simulate()


def per_call(call, count):
    begin = time.process_time()
    for _ in range(count):
        call()
    return (time.process_time() - begin) / count


def per_step(sim, count):
    begin = time.process_time()
    sim.step(count)
    return (time.process_time() - begin) / count


def empty():
    pass


def of_import(module):
    def spent(code):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return spent(f"import {module}") - spent("")


cpp, python = gain("Gain", K=2), gain("python/Twice")
array = numpy.zeros(3)
measurements = {
    "python.step": lambda: per_call(cpp.step, 200_000) - per_call(empty, 200_000),
    "python.step/engine": lambda: per_step(cpp, 1_000_000),
    "python.read": lambda: per_call(lambda: cpp["g"], 50_000) - per_call(empty, 50_000),
    "python.read/numpy_view": lambda: per_call(lambda: array[:], 50_000) - per_call(empty, 50_000),
    "python.block": lambda: per_step(python, 20_000),
    "python.import": lambda: of_import("blockfactory"),
    "python.import/numpy": lambda: of_import("numpy"),
}
times = {name: [] for name in measurements}
for _ in range(REPETITIONS):
    for name, measure in measurements.items():
        times[name].append(measure())
least = {name: min(all) for name, all in times.items()}
least["python.step_overhead"] = least["python.step"] - least["python.step/engine"]
json.dump(least, sys.stdout)
