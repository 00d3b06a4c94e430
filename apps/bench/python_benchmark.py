"""Measures the overhead of Python: a call over the C++ step, a rollout over the C++ batch, two threads over one.

Usage: PYTHONPATH=build/release/python apps/bench/python_benchmark.py [COMMAND]   (COMMAND: build/release/bin/counterpoint)

The two sides of a ratio run in turns in one process or directly after each other; the result is the median ratio.
"""
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np

import counterpoint as cp

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "data" / "scenes"


def seconds(call):
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def show(what, values, unit):
    values = sorted(values)
    print(f"{what:<58}{statistics.median(values):>10.3g} {unit:<6} ({values[0]:.3g} ... {values[-1]:.3g})")


def call_overhead(count=100_000, rounds=15):
    """Time of a step called from Python minus the time of the same step within C++."""
    sim = cp.Simulator(cp.load_scene(SCENES / "pendulum.yaml"))
    step, inside, over, bare = sim.step, [], [], []

    def loop():
        for _ in range(count):
            step()

    def empty():
        for _ in range(count):
            pass

    for _ in range(rounds):
        sim.reset()
        within = seconds(lambda: sim.advance(count))
        sim.reset()
        called = seconds(loop)
        inside.append(1e9 * within / count)
        over.append(1e9 * (called - within) / count)
        bare.append(1e9 * seconds(empty) / count)
    show("pendulum: step within C++", inside, "ns")
    show("pendulum: sim.step() over that, with the loop", over, "ns")
    show("an empty loop", bare, "ns")


def access_costs(count=200_000, rounds=7):
    scene = cp.load_scene(SCENES / "pendulum.yaml")
    sim, state = cp.Simulator(scene), scene.state()
    name = state.coordinates.q[0]
    calls = {
        "sim.q": lambda: sim.q,
        "sim.state.q": lambda: sim.state.q,
        "state['name']": lambda: state[name],
        "state.copy()": state.copy,
    }
    for what, call in calls.items():
        def loop():
            for _ in range(count):
                call()
        show(what, [1e9 * seconds(loop) / count for _ in range(rounds)], "ns")


def rollouts(command, count=1000, steps=25, rounds=5):
    """cp.rollout of many humanoids compared with `counterpoint rollout`, which times only its batch."""
    file = SCENES / "humanoid_drop.yaml"
    scene = cp.load_scene(file)
    batch = cp.Batch(scene)
    starts = np.tile(np.concatenate([scene.q, scene.v]), (count, 1))
    out = np.empty((count, steps, starts.shape[1]))
    duration = steps * scene.options.time_step
    ratios, ours = [], []
    with tempfile.TemporaryDirectory() as folder:
        report = os.path.join(folder, "report.json")

        def theirs():
            subprocess.run([command, "rollout", str(file), "--count", str(count), "--duration", str(duration), "--json", report],
                           check=True, capture_output=True)
            with open(report) as stream:
                return json.load(stream)["wall_seconds"]

        for _ in range(rounds):
            # C++, Python, Python, C++: other load on the machine affects both.
            before = theirs()
            mine = [seconds(lambda: batch.rollout(starts, steps=steps, out=out)) for _ in range(2)]
            after = theirs()
            ours.append(statistics.mean(mine))
            ratios.append(2.0 * statistics.mean(mine) / (before + after))
    show(f"rollout of {count} humanoids, {steps} steps", ours, "s")
    show("the same over the C++ batch's time", ratios, "")


class Run:
    """Resources that a call took from the thread that ran it."""

    def __init__(self, call):
        before, start = resource.getrusage(resource.RUSAGE_THREAD), time.thread_time()
        self.seconds = seconds(call)
        self.processor = time.thread_time() - start
        self.waits = resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw - before.ru_nvcsw


def two_threads(steps=1500, rounds=9):
    """Two simulators, one after the other and in parallel. Wall time depends on the load of other programs; processor time
    and waits depend on the module only."""
    scene = cp.load_scene(SCENES / "humanoid_drop.yaml")
    sims = [cp.Simulator(scene) for _ in range(2)]

    def loop(sim):
        sim.reset()
        for _ in range(steps):
            sim.step()

    def within(sim):  # the same steps without Python in between: the speed-up that the machine allows
        sim.reset()
        sim.advance(steps)

    def compare(run, found):
        alone = [Run(lambda s=s: run(s)) for s in sims]
        both = []
        threads = [threading.Thread(target=lambda s=s: both.append(Run(lambda: run(s)))) for s in sims]

        def together():
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

        found["wall"].append(sum(r.seconds for r in alone) / seconds(together))
        found["processor"].append(2.0 * sum(r.processor for r in alone) / sum(r.processor for r in both))
        found["waits"].append(100.0 * sum(r.waits for r in both) / (2 * steps))

    results = {name: {"wall": [], "processor": [], "waits": []} for name in ("loop", "within")}
    for _ in range(rounds):
        compare(loop, results["loop"])
        compare(within, results["within"])
    for name, what in (("loop", "two threads, sim.step() each"), ("within", "two threads, sim.advance() each")):
        show(f"{what}: speed-up", results[name]["wall"], "")
        show("  by processor time (2: nothing lost)", results[name]["processor"], "")
        show("  waits for the other thread, of the steps", results[name]["waits"], "%")


if __name__ == "__main__":
    print(f"counterpoint {cp.__version__}, Python {sys.version.split()[0]}, NumPy {np.__version__}, {os.cpu_count()} cores; "
          "medians (least ... most)")
    call_overhead()
    access_costs()
    two_threads()
    if len(sys.argv) > 1:
        rollouts(sys.argv[1])
