#!/usr/bin/env python3
"""Measures how well `explain` finds known forces from noisy rows; writes docs/measurements/explaining.md.

    scripts/measurements/explain_doc.py [--seeds 10] [--case NAME] [--folder FOLDER]
    scripts/measurements/explain_doc.py --torques DATA

Motions are simulated with a small time step; the command gets the rows with white noise, but no forces. The true force
of a row is the mean over the two adjacent intervals with triangular weights. --case prints one case and writes nothing;
--folder keeps the files. --torques computes joint torques of human_walk instead; DATA is the folder that contains it.
"""
import argparse
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import marked
import numpy as np
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "build/release/python"))
import counterpoint as cp  # noqa: E402
from counterpoint import optimization  # noqa: E402

DOCUMENT = ROOT / "docs/measurements/explaining.md"
COMMAND = ROOT / "build/release/bin/counterpoint"
FIRST = 10  # rows: earlier rows are the start, which the estimate leaves free


class Motion:
    """A motion with its forces: q, force (joints) and contact (sum on the robot, in W), by row."""

    def __init__(self, scene_file, scene, time, q, force, contact, peak=0.3, sensor=None):
        self.scene_file, self.scene, self.time, self.q = scene_file, scene, time, q
        self.force, self.contact, self.peak, self.sensor = force, contact, peak, sensor
        self.weight = cp.total_mass(scene.model) * 9.80665


def triangle(steps, substeps):
    """Triangular means over the two intervals around each row; maps columns of steps to columns of rows. Semi-implicit
    Euler changes the velocity at the start of a step, so with one step per row the step is the row's force."""
    weights = 1 - abs(np.arange(1 - substeps, substeps)) / substeps
    rows = steps.shape[1] // substeps + 1
    out = np.full((steps.shape[0], rows), np.nan)
    for row in range(1, rows - 1):
        out[:, row] = steps[:, (row - 1) * substeps + 1:(row + 1) * substeps] @ weights / weights.sum()
    return out


def from_ground(contacts):
    """Force of the ground on the robot, in W [N]."""
    out = np.zeros(3)
    for c in contacts:
        if "ground" in (c.geometry_a, c.geometry_b):
            out += c.force if c.geometry_a == "ground" else -c.force
    return out


def simulated(scene_file, scene, rate, seconds, step, act, truth_scene=None, **more):
    """A simulation in steps of about `step`: act(simulator, time) sets the forces."""
    simulator = cp.Simulator(truth_scene or scene)
    substeps = max(1, round(1 / rate / step))
    simulator.options.time_step = 1 / rate / substeps
    rows = round(seconds * rate)
    q, force, contact = [], [], []
    for k in range(rows * substeps):
        if k % substeps == 0:
            q.append(simulator.q.copy())
        act(simulator, k / rate / substeps)
        simulator.step()
        last = simulator.last_forces()
        force.append(last.applied_force + (last.servo_force if len(last.servo_force) else 0))
        contact.append(from_ground(last.contacts))
    q.append(simulator.q.copy())
    return Motion(scene_file, scene, np.arange(rows + 1) / rate, np.array(q), triangle(np.array(force).T, substeps),
                  triangle(np.array(contact).T, substeps), **more)


def quadruped(folder, seed, height=None):
    file = ROOT / "data/scenes/quadruped_drop.yaml"
    if height:
        text = yaml.safe_load(file.read_text())
        text["models"][0]["urdf"] = str(ROOT / "data/robots/quadruped.urdf")
        text["models"][0]["position"] = [0, 0, height]
        file = folder / "high.yaml"
        file.write_text(yaml.safe_dump(text))
    scene = cp.load_scene(file)
    random = np.random.default_rng(1000 + seed)

    def act(simulator, _):
        force = np.zeros(scene.model.nv)
        force[6:] = 0.3 * random.standard_normal(scene.model.nv - 6)
        simulator.input.applied_force = force

    return simulated(file, scene, 100, 1.5, 0.002, act)


def cube(folder, seed):
    random = np.random.default_rng(2000 + seed)
    text = yaml.safe_load((ROOT / "data/scenes/cube_toss.yaml").read_text())
    model = text["models"][0]
    model["urdf"] = str(ROOT / "data/robots/toss_cube.urdf")
    model["rpy"] = [float(x) for x in random.uniform(-1, 1, 3)]
    model["velocity"]["angular"] = [float(x) for x in random.uniform(-6, 6, 3)]
    file = folder / f"cube_{seed}.yaml"
    file.write_text(yaml.safe_dump(text))
    return simulated(file, cp.load_scene(file), 148, 1.0, 0.001, lambda simulator, time: None, peak=2.0)


def arm(folder, seed):
    """The arm presses its flange on the ground and slides over it; torques are measured with a deviation of 1 N m."""
    random = np.random.default_rng(3000 + seed)
    file = ROOT / "data/scenes/arm7.yaml"
    held = cp.load_scene(ROOT / "data/scenes/arm7_servo.yaml")
    start = held.q.copy()
    phase = random.uniform(0, 1, 7)

    def act(simulator, time):
        target = start.copy()
        target[1] += 0.66 * min(1.0, time / 0.6) + 0.02 * math.sin(4 * time + phase[1])
        target[0] += 0.1 * math.sin(3 * time + phase[0])
        simulator.input.servo_position = target

    return simulated(file, cp.load_scene(file), 100, 1.5, 0.002, act, truth_scene=held, sensor=1.0)


GAIT = {}


def gait(folder, seed):
    """Half gaits of the bundled problem, replanned with frames of 10 ms; forces computed by the inverse."""
    if not GAIT:
        text = yaml.safe_load((ROOT / "data/scenes/optimize/humanoid_walk.yaml").read_text())
        text["scene"] = str(ROOT / "data/scenes/optimize" / text["scene"])
        text["time_step"], text["steps"] = 0.01, 48
        file = folder / "gait.yaml"
        file.write_text(yaml.safe_dump(text))
        result = optimization.optimize(optimization.load_problem(file))
        GAIT["motion"] = optimization.repeated(result, 4)
        GAIT["file"] = text["scene"]
    motion = GAIT["motion"]
    scene = cp.load_scene(GAIT["file"])
    scene.options.time_step = 0.01
    rows = 151
    q, v = motion.q[:rows], motion.v[:rows]
    force = np.full((scene.model.nv, rows - 1), np.nan)
    contact = np.full((3, rows - 1), np.nan)
    simulator = cp.Simulator(scene)
    simulator.options.time_step = 0.01
    for k in range(rows - 1):
        inverse = simulator.inverse(q[k], v[k], v[k + 1], q_next=q[k + 1])
        force[:, k] = inverse.applied_force
        contact[:, k] = from_ground(inverse.contacts)
    return Motion(GAIT["file"], scene, 0.01 * np.arange(rows), q, triangle(force, 1), triangle(contact, 1))


def explained(folder, name, motion, noise, seed):
    """Runs `explain` on the motion with white noise [m, rad]; returns its table of forces and its report."""
    model = motion.scene.model
    random = np.random.default_rng(seed)
    q = [cp.integrate_configuration(model, row, noise * random.standard_normal(model.nv), 1.0) for row in motion.q]
    names = model.coordinates
    stem = folder / f"{name}_{noise:g}_{seed}"
    columns = {"time": "time", "columns": {n: n for n in names.q}}
    table = [motion.time, *np.array(q).T]
    heads = ["time", *names.q]
    if motion.sensor:
        columns["sensors"] = {}
        for i, n in enumerate(names.force):
            joint = n.removesuffix(".u")
            heads.append(f"{joint}.torque")
            table.append(motion.force[i] + motion.sensor * random.standard_normal(len(motion.time)))
            columns["sensors"][f"{joint} torque"] = {"kind": "joint_force", "coordinate": n,
                                                     "columns": [f"{joint}.torque"], "deviation": motion.sensor}
    links = [b.name for b in model.bodies if b.name != "world"]
    columns["contact_forces"] = {"all": {"links": links, "x": "fx", "y": "fy", "z": "fz"}}
    heads += ["fx", "fy", "fz"]
    table += list(motion.contact)
    np.savetxt(f"{stem}.csv", np.nan_to_num(np.array(table).T), delimiter=",", header=",".join(heads), comments="",
               fmt="%.12g")
    pathlib.Path(f"{stem}.yaml").write_text(yaml.safe_dump(columns, sort_keys=False))
    done = subprocess.run([str(COMMAND), "explain", str(motion.scene_file), f"{stem}.csv", "--columns", f"{stem}.yaml",
                           "--threads", "1", "--forces", f"{stem}_forces.csv", "--json", f"{stem}.json"],
                          capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"{stem}: {done.stderr}")
    found = np.genfromtxt(f"{stem}_forces.csv", delimiter=",", names=True, deletechars="")
    return found, json.loads(pathlib.Path(f"{stem}.json").read_text())["recordings"][0]


def figures(motion, found, report):
    """Errors of the vertical contact force [weights] and of joint forces [N, N m], and coverage of the intervals."""
    rows = slice(FIRST, len(motion.time) - 1)
    truth = motion.contact[2] / motion.weight
    error = (found["all.contact.fz"] - motion.contact[2])[rows] / motion.weight
    inside = abs(error) <= 1.96 * found["all.contact.fz.sd"][rows] / motion.weight + 1e-6
    jump = np.abs(np.diff(truth, prepend=truth[0])) > 0.3
    near = np.convolve(np.nan_to_num(jump).astype(float), np.ones(5), "same")[rows] > 0
    names = motion.scene.model.coordinates.force
    first = next((i for i, n in enumerate(names) if n.endswith(".u")), len(names))
    torque = np.array([found[n][rows] - motion.force[i][rows] for i, n in enumerate(names) if i >= first])
    holds = np.array([abs(t) <= 1.96 * found[f"{n}.sd"][rows] for t, n in zip(torque, names[first:])])
    out = {"rms": np.sqrt(np.mean(error**2)), "median": np.median(abs(error)), "seconds": report["seconds"],
           "steps": report["newton_steps"], "errors": report["errors"],
           "rest": inside[~near].mean() if (~near).any() else np.nan,
           "impact": inside[near].mean() if near.any() else np.nan}
    if torque.size:
        out.update(torque=np.sqrt(np.mean(torque**2)), torque_median=np.median(abs(torque)),
                   torque_rest=holds[:, ~near].mean(), torque_impact=holds[:, near].mean() if near.any() else np.nan)
    # Impulses: intervals with the force above the peak, extended by three rows on each side.
    wide = np.convolve((np.nan_to_num(truth) > motion.peak).astype(float), np.ones(7), "same")[rows] > 0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], wide, [0]))))
    impulses = [(error[a:b].sum(), truth[rows][a:b].sum()) for a, b in zip(edges[::2], edges[1::2])]
    out["impulse"] = np.median([abs(e / t) for e, t in impulses]) if impulses else np.nan
    return out


def high(folder, seed):
    return quadruped(folder, seed, 1.6)


CASES = {
    "quadruped": (quadruped, (1e-4, 1e-3, 3e-3), "quadruped drops 0.1 m under random torques"),
    "high": (high, (1e-3,), "the same from 1.3 m"),
    "gait": (gait, (1e-3,), "humanoid walks"),
    "arm": (arm, (1e-3,), "arm strikes the ground and slides, torques measured to 1 N m"),
    "cube": (cube, (1e-3,), "tossed cube, restitution 0.125 in the truth only, 148 Hz"),
}


def one(arguments):
    folder, name, noise, seed = arguments
    motion = CASES[name][0](folder, seed)
    return figures(motion, *explained(folder, name, motion, noise, seed))


def row(name, noise, done):
    """A line of the table: medians over the seeds with the worst value in brackets, and means of shares."""
    def spread(key, scale=1.0):
        values = sorted(scale * f[key] for f in done)
        return f"{np.median(values):.2g} ({values[-1]:.2g})"

    def share(key):
        values = [100 * f[key] for f in done if key in f and not math.isnan(f[key])]
        return f"{np.mean(values):.0f}" if values else "-"

    torques = f"{spread('torque_median')} N m" if "torque" in done[0] else "-"
    white = sum(f["errors"] == "white" for f in done)
    return (f"| {CASES[name][2]} | {1e3 * noise:g} | {spread('rms')} | {spread('median')} | {spread('impulse', 100)} "
            f"| {torques} | {share('rest')}, {share('impact')} | {share('torque_rest')}, {share('torque_impact')} "
            f"| {white} of {len(done)} | {spread('seconds')} |")


def plate_wrench(plates, side, time, h):
    """Force and moment about the origin of W measured by a foot's plate, mean with triangular weights over +- h."""
    weight = np.clip(1 - abs(plates["time"] - time) / h, 0, None)
    weight /= weight.sum()
    fx, fy, fz, px, py, tz = (np.nan_to_num(plates[f"{side}.{c}"]) for c in ("fx", "fy", "fz", "px", "py", "tz"))
    return (np.array([fx @ weight, fy @ weight, fz @ weight]),
            np.array([(py * fz) @ weight, (-px * fz) @ weight, (px * fy - py * fx + tz) @ weight]))


def walking_torques(data, folder):
    """Difference of the joint torques of human_walk between `explain` without plates and inverse dynamics with them:
    rms [N m/kg]."""
    walk = data / "human_walk"
    forces = folder / "walk_forces.csv"
    subprocess.run([str(COMMAND), "explain", str(walk / "scene.yaml"), str(walk / "recording_raw.csv"), "--columns",
                    str(walk / "map.yaml"), "--from", "0.45", "--to", "1.98", "--forces", str(forces)],
                   check=True, capture_output=True)
    scene = cp.load_scene(walk / "scene_no_ground.yaml")
    model = scene.model
    recorded = np.genfromtxt(walk / "recording_raw.csv", delimiter=",", names=True, deletechars="")
    plates = np.genfromtxt(walk / "forces.csv", delimiter=",", names=True, deletechars="")
    found = np.genfromtxt(forces, delimiter=",", names=True, deletechars="")
    time = recorded["time"]
    h = scene.options.time_step = time[1] - time[0]
    # Gaussian low-pass filter with half the power at 10 Hz; the ends are mirrored.
    lags = np.arange(-60, 61)
    kernel = np.exp(-((lags * h * 2 * math.pi * 10) ** 2) / (2 * math.log(2)))
    kernel /= kernel.sum()
    raw = np.array([recorded[n] for n in model.coordinates.q]).T
    ends = np.concatenate([2 * raw[:1] - raw[60:0:-1], raw, 2 * raw[-1:] - raw[-2:-62:-1]])
    q = np.apply_along_axis(lambda column: np.convolve(column, kernel, "valid"), 0, ends)
    turn = [i for i, n in enumerate(model.coordinates.q) if n.endswith((".qw", ".qx", ".qy", ".qz"))]
    q[:, turn] /= np.linalg.norm(q[:, turn], axis=1)[:, None]
    v = [cp.configuration_difference(model, a, b) / h for a, b in zip(q, q[1:])]
    state = cp.Simulator(scene).state.copy()
    rows = [int(np.argmin(abs(time - t))) for t in found["time"][1:-1]]
    reference = []
    for k in rows:
        state.q = q[k]
        known = cp.Input(model)
        for side, link in (("R", "talus_r"), ("L", "talus_l")):
            force, moment = plate_wrench(plates, side, time[k], h)
            at = cp.frame_motion(model, state, link).pose.translation
            known.add_wrench(link, force=force, torque=moment - np.cross(at, force))
        reference.append(cp.step_inverse(model, scene.options, q[k], v[k - 1], v[k], known=known).applied_force)
    reference = np.array(reference)
    text = "| joint | rms [N m/kg] |\n|---|---|\n"
    for joint in ("hip_flexion", "knee_angle", "ankle_angle"):
        error = [found[f"{joint}_{s}.u"][1:-1] - reference[:, model.coordinates.force.index(f"{joint}_{s}.u")]
                 for s in "rl"]
        text += f"| {joint} | {np.sqrt(np.mean(np.square(error))) / cp.total_mass(model):.3f} |\n"
    return text


def write(name, text):
    """Replaces a table between its marks in the document."""
    marked.write(DOCUMENT, name, text)


HEAD = """| motion | noise [mm, mrad] | rms [weights] | median error [weights] | impulse [%] | torques, median error | force within 95 %: rest, impacts | torques within 95 % | judged white | seconds of one core |
|---|---|---|---|---|---|---|---|---|---|
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--case", choices=CASES)
    parser.add_argument("--folder", type=pathlib.Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--torques", type=pathlib.Path, metavar="DATA")
    options = parser.parse_args()
    table = HEAD
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or pathlib.Path(temporary)
        folder.mkdir(exist_ok=True)
        if options.torques:
            write("torques", walking_torques(options.torques, folder))
        for name, (_, noises, _) in CASES.items():
            if options.torques or (options.case and name != options.case):
                continue
            for noise in noises:
                jobs = [(folder, name, noise, seed) for seed in range(1, options.seeds + 1)]
                with concurrent.futures.ProcessPoolExecutor(options.workers) as pool:
                    done = list(pool.map(one, jobs))
                line = row(name, noise, done)
                print(line, flush=True)
                table += line + "\n"
    if options.case or options.torques:
        return
    write("simulated", table)


main()
