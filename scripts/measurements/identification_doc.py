#!/usr/bin/env python3
"""Identifies simulated robots of known parameters: the tables of docs/measurements/identification.md.

    PYTHONPATH=build/release/python scripts/measurements/identification_doc.py [--draws 100] [--only arm|walk]

Moves data/scenes/arm7.yaml along sums of sines for 30 s at 1 kHz, adds noise to angles and torques, and runs
build/release/bin/counterpoint identify --objective torque. Lets the quadruped of `counterpoint control quadruped_walk`
walk, adds noise, and runs identify --objective explain. About eight minutes on two cores. Needs NumPy.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import counterpoint as cp
import numpy as np

import marked

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs/measurements/identification.md"
PROGRAM = ROOT / "build/release/bin/counterpoint"
SCENE = ROOT / "data/scenes/arm7.yaml"
STEP, SECONDS = 1e-3, 30  # [s]
ANGLE, TORQUE = 1e-5, 0.3  # standard deviations of the noise [rad, N m]
DELAY = 7.3e-3  # [s]
DESIGN = ("mass:shoulder_pitch_link=4.4,mass:arm_roll_link=2.2,mass:elbow_link=3.2,mass:wrist_pitch_link=1.5,"
          "com_x:elbow_link=0.01,com_z:arm_roll_link=0.12,spread_x:forearm_roll_link=1.15,"
          "spread_z:shoulder_pitch_link=0.9")
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
WALK_SCENE = ROOT / "data/scenes/optimize/scenes/quadruped.yaml"
WALK_RATE = 100  # [1/s]
WALK_BASE, WALK_JOINT, WALK_TORQUE = 1e-3, 3e-4, 0.3  # standard deviations [m, rad; rad; N m]
WALK_DESIGN = "mass:trunk=9,com_x:trunk=0.03,com_y:trunk=-0.02,com_z:trunk=0.02"
PAYLOAD = {"mass": 1.7, "com_x": 0.03, "com_y": 0.0, "com_z": 0.08}  # [kg, m]


class Arm:
    def __init__(self, settings=""):
        self.scene = cp.recordings.with_settings(cp.load_scene(SCENE), settings) if settings else cp.load_scene(SCENE)
        self.model, self.options = self.scene.model, self.scene.options
        self.options.time_step = STEP
        for effect in ("contacts", "limits"):
            self.options.switch_effect(effect, False)
        self.names = [joint.name for joint in self.model.joints]

    def moved(self, seed):
        """Angles and torques (rows x joints) of a motion."""
        random = np.random.default_rng(seed)
        t = STEP * np.arange(-1, round(SECONDS / STEP) + 1)[:, None]
        q = sum(1.5 / k * random.uniform(-1, 1, self.model.nv)
                * np.sin(0.2 * np.pi * k * t + random.uniform(-np.pi, np.pi, self.model.nv)) for k in range(1, 6))
        v = np.diff(q, axis=0) / STEP
        workspace = cp.Workspace(self.model)
        u = [cp.step_inverse(self.model, self.options, q[i + 1], v[i], v[i + 1], workspace=workspace).applied_force
             for i in range(len(q) - 2)]
        return q[1:-1], np.array(u)


def noisy(motion, seed):
    random = np.random.default_rng(seed)
    q, u = motion
    return q + ANGLE * random.normal(size=q.shape), u + TORQUE * random.normal(size=u.shape)


def delayed(motion):
    """The same motion with torques that are read DELAY later."""
    q, u = motion
    rows = np.arange(len(u))
    return q, np.stack([np.interp(rows - DELAY / STEP, rows, column) for column in u.T], axis=1)


class Fits:
    def __init__(self, folder, names):
        self.folder, self.names = folder, names
        self.map = folder / "map.yaml"
        self.map.write_text("time: t\ncolumns:\n" + "".join(f"  {n}.{x}: {n}.{x}\n" for n in names for x in "qu"))

    def write(self, name, motion):
        q, u = motion
        columns = ["t"] + [f"{n}.q" for n in self.names] + [f"{n}.u" for n in self.names]
        np.savez(self.folder / name, numbers=np.column_stack([STEP * np.arange(len(q)), q, u]), columns=columns)
        return self.folder / f"{name}.npz"

    def run(self, parameters, recordings, *more):
        report = self.folder / "fit.json"
        start = time.perf_counter()
        subprocess.run([PROGRAM, "identify", SCENE, *recordings, "--columns", self.map, "--objective", "torque", "--parameters",
                        parameters, "--option", "effects.contacts=false", "--train", "1", "--json", report, *more],
                       check=True, stdout=subprocess.DEVNULL)
        return json.loads(report.read_text()), time.perf_counter() - start


def values(report):
    return {p["name"]: p["value"] for p in report["parameters"]}


def base_table(arm, fits, draws):
    motion, other = arm.moved(1), arm.moved(2)
    exact, _ = fits.run("inertial:*", [fits.write("exact", motion)], "--cutoff", "200")
    truth = np.array([b["value"] for b in exact["base_parameters"]])
    inside, seconds, ratios = [], [], []
    for draw in range(draws):
        recording = fits.write("noisy", noisy(motion, 100 + draw))
        test = fits.write("other", noisy(other, 1000 + draw))
        report, took = fits.run("inertial:*", [recording], "--set", DESIGN)
        base = report["base_parameters"]
        inside.append([abs(b["value"] - t) <= 1.96 * b["deviation"] for b, t in zip(base, truth)])
        seconds.append(took)
        if draw % 10 == 0:  # on another motion: the fit, and the true scene
            found, _ = fits.run("mass:elbow_link", [test], "--set", DESIGN + "," + report["set"])
            true, _ = fits.run("mass:elbow_link", [test])
            rms = [np.sqrt(sum(c["rms"]**2 for c in r["train"]["coordinates"]["scene"])) for r in (found, true)]
            ratios.append(rms[0] / rms[1])
    return (f"| base parameters inside their 95 % intervals, {draws} draws of noise | {100 * np.mean(inside):.1f} % |\n"
            f"| torques of another motion: rms of the error over that of the true arm, largest of {len(ratios)} | {max(ratios):.3f} |\n"
            f"| time of a fit, with reading and scores, median [s] | {statistics.median(seconds):.2f} |\n")


def payload_rows(fits, draws):
    loaded = Arm(",".join(f"{kind}:flange_roll_link={value}" for kind, value in PAYLOAD.items()))
    motion = loaded.moved(3)
    errors = []
    for draw in range(draws):
        report, _ = fits.run("inertial:flange_roll_link", [fits.write("noisy", noisy(motion, draw))])
        found = values(report)
        errors.append([found[f"{kind}:flange_roll_link"] - value for kind, value in PAYLOAD.items()])
    errors = np.abs(errors)
    return (f"| payload of 1.7 kg: largest error of its mass, {draws} draws [%] | {100 * errors[:, 0].max() / 1.7:.2f} |\n"
            f"| largest error of its centre [mm] | {1e3 * np.linalg.norm(errors[:, 1:], axis=1).max():.2f} |\n")


def delay_row(arm, fits, draws):
    motion = delayed(arm.moved(4))
    errors = []
    for draw in range(draws):
        report, _ = fits.run("force_delay:elbow,force_delay:shoulder_pitch", [fits.write("noisy", noisy(motion, draw))])
        errors += [abs(value - DELAY) for value in values(report).values()]
    return f"| torques read 7.3 ms late: largest error of the delay, {draws} draws [ms] | {1e3 * max(errors):.3f} |\n"


def excitation_row(folder):
    report = folder / "excite.json"
    start = time.perf_counter()
    subprocess.run([PROGRAM, "excite", SCENE, "--parameters", "inertial:*", "--output", folder / "motion.csv", "--json", report],
                   check=True, stdout=subprocess.DEVNULL)
    took, found = time.perf_counter() - start, json.loads(report.read_text())
    return (f"| condition number of a motion of `excite`, best of 100 random ones | {found['condition']:.4g}, "
            f"{found['random_condition']:.4g} |\n| time of `excite` [s] | {took:.1f} |\n")


def turned(quaternion, by):
    """A quaternion w, x, y, z turned by a small rotation vector in body axes."""
    w, v = quaternion[0], quaternion[1:]
    out = np.concatenate([[w - v @ by / 2], v + (w * by + np.cross(v, by)) / 2])
    return out / np.linalg.norm(out)


class Walk:
    """Logs of a quadruped that walks, WALK_RATE rows a second."""

    def __init__(self, folder):
        self.folder = folder
        truth = folder / "walk.csv"
        subprocess.run([PROGRAM, "control", "quadruped_walk", "--duration", "5", "--seed", "1", "--output", truth],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        table = np.genfromtxt(truth, delimiter=",", names=True, deletechars="")
        joints = [name[:-2] for name in table.dtype.names if name.endswith(".q")]
        self.time = table["time"]
        self.pose = np.stack([table[f"trunk.{c}"] for c in POSE], axis=1)
        self.q = np.stack([table[f"{j}.q"] for j in joints], axis=1)
        self.u = np.stack([table[f"{j}.u"] for j in joints], axis=1)
        self.columns = [f"trunk.{c}" for c in POSE] + [f"{j}.q" for j in joints] + [f"{j}.u" for j in joints]
        self.map = folder / "walk.yaml"
        self.map.write_text(
            "time: t\nfree: trunk\ncolumns:\n" + "".join(f"  {c}: {c}\n" for c in self.columns) + "deviations:\n"
            + "".join(f"  trunk.{c}: {WALK_BASE}\n" for c in ("x", "y", "z", "qw"))
            + "".join(f"  {j}.q: {WALK_JOINT}\n  {j}.u: {WALK_TORQUE}\n" for j in joints))

    def log(self, name, seed, begin, end):
        """Writes the rows between two times; torques are means over the intervals beside a row, as encoders see them."""
        random = np.random.default_rng(seed)
        every = round(1 / WALK_RATE / (self.time[1] - self.time[0]))
        weights = np.convolve(np.ones(every), np.ones(every)) / every**2
        rows = []
        for i in range(every, len(self.time) - every, every):
            if not begin <= self.time[i] < end:
                continue
            u = weights @ self.u[i - every:i + every - 1]
            rows.append(np.concatenate([
                [self.time[i]], self.pose[i, :3] + WALK_BASE * random.normal(size=3),
                turned(self.pose[i, 3:], WALK_BASE * random.normal(size=3)),
                self.q[i] + WALK_JOINT * random.normal(size=self.q.shape[1]), u + WALK_TORQUE * random.normal(size=len(u))]))
        np.savez(self.folder / name, numbers=np.array(rows), columns=["t"] + self.columns)
        return self.folder / f"{name}.npz"


def walk_table(folder, draws):
    walk = Walk(folder)
    names, truth = ("mass", "com_x", "com_y", "com_z"), np.array([7.0, 0.0, 0.0, 0.0])
    errors, inside, seconds = [], [], []
    for draw in range(draws):
        logs = [walk.log(f"log{k}", 10 * draw + k, 0.3 + 1.1 * k, 1.4 + 1.1 * k) for k in range(4)]
        report = folder / "walk.json"
        start = time.perf_counter()
        subprocess.run([PROGRAM, "identify", WALK_SCENE, *logs, "--columns", walk.map, "--objective", "explain", "--train", "1",
                        "--set", WALK_DESIGN, "--parameters", ",".join(f"{n}:trunk" for n in names), "--json", report],
                       check=True, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - start)
        found = json.loads(report.read_text())["parameters"]
        errors.append(np.array([p["value"] for p in found]) - truth)
        inside.append([p["lower_95"] <= t <= p["upper_95"] for p, t in zip(found, truth)])
    errors = np.abs(errors)
    return (f"| | |\n|---|---|\n| trunk of 7 kg, 9 kg at the start: largest error of its mass, {draws} draws [%] "
            f"| {100 * errors[:, 0].max() / 7:.2f} |\n"
            f"| its centre, 41 mm off at the start: largest error forward, sideways, upward [mm] "
            f"| {', '.join(f'{1e3 * e:.2f}' for e in errors[:, 1:].max(axis=0))} |\n"
            f"| parameters inside their 95 % intervals | {np.sum(inside)} of {np.size(inside)} |\n"
            f"| time of a fit, median [s] | {statistics.median(seconds):.1f} |\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--only", choices=("arm", "walk"))
    options = parser.parse_args()
    draws = options.draws
    if options.only != "arm":
        with tempfile.TemporaryDirectory() as folder:
            table = walk_table(pathlib.Path(folder), max(draws // 10, 1))
        print(table)
        marked.write(PAGE, "walk", table)
    if options.only == "walk":
        return
    arm = Arm()
    with tempfile.TemporaryDirectory() as folder:
        fits = Fits(pathlib.Path(folder), arm.names)
        table = ("| | |\n|---|---|\n" + base_table(arm, fits, draws) + payload_rows(fits, draws // 5)
                 + delay_row(arm, fits, draws // 5) + excitation_row(fits.folder))
    print(table)
    marked.write(PAGE, "arm", table)


if __name__ == "__main__":
    main()
