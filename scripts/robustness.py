#!/usr/bin/env python3
"""Runs random piles, and every URDF below some folders, and writes one row of figures a run: does contact ever stop?

    scripts/robustness.py build/release/bin/counterpoint
    scripts/robustness.py build/release/bin/counterpoint --robots ~/robots --package example-robot-data=~/erd --full

Default is a quick choice of two minutes, --full the whole matrix: piles of 16 to 1000 bodies (friction, masses, time
step, overlap, seeds), robots floating and fixed on the ground, unpowered and under random torques, at 0.5, 2 and 10 ms.
Every run is one `counterpoint simulate`, and stands in its row as a command that repeats it. Exit code 1 if a run failed
or ran out of time (a URDF that is refused as bad input does not count). Standard library only.
"""
import argparse
import concurrent.futures
import csv
import json
import pathlib
import shlex
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
from pile_scenes import pile, pile_name, write  # noqa: E402

# Column: key of the report of simulate (docs/reference/json-reports.md).
FIGURES = {"simulated_s": "simulated_seconds", "steps": "steps", "newton_mean": "newton_iterations_mean",
           "newton_p99": "newton_iterations_p99", "newton_max": "newton_iterations_max",
           "failed_steps": "solver_failures", "softened_steps": "softened_steps", "step_median_us": "step_time_median_us",
           "step_p99_us": "step_time_p99_us", "step_max_us": "step_time_max_us", "wall_s": "wall_seconds",
           "contacts": "contacts_mean", "max_penetration_m": "max_penetration_m", "end_penetration_m": "end_penetration_m",
           "end_below_ground_m": "end_below_ground_m", "energy_start_J": "energy_start_J",
           "input_work_J": "input_work_J", "energy_gain_J": "energy_gain_max_J", "state_hash": "state_hash"}
COLUMNS = ["kind", "scene", "base", "inputs", "bodies", "friction", "mass_range", "overlap", "seed", "time_step_s",
           "duration_s", "exit", "status", *FIGURES, "message", "command"]
QUICK_LIMIT, FULL_LIMIT = 10.0, 120.0  # s of steps a run
SLACK = 30.0                           # s beyond that for reading, and for one step that takes long: then it is killed


# ---- what is run ---------------------------------------------------------------------------------------

def pile_choices(full):
    """Options of pile(), time step and duration [s]."""
    if not full:
        chosen = []
        for count, friction, masses, step, overlap, extra in (
                (16, 0.5, 1, 0.002, 0, {}), (16, 2, 1e3, 0.002, 0, {}), (16, 0.5, 1, 0.002, 0.5, {}),
                (16, 2, 1e4, 0.01, 0.5, {}), (16, 0.5, 1, 0.002, 0, {"with_chain": True}), (64, 0.5, 1, 0.002, 0, {}),
                (64, 2, 1e3, 0.01, 0, {}), (64, 0.5, 1, 0.01, 0.5, {}), (64, 0.5, 1, 0.002, 0, {"in_bin": True}),
                (200, 0.5, 1, 0.01, 0, {})):
            chosen.append(({"count": count, "friction": friction, "mass_range": masses, "overlap": overlap, "seed": 0,
                            **extra}, step, 1.0))
        return chosen
    chosen = []
    for count, seeds, duration in ((16, 5, 5.0), (64, 3, 5.0), (200, 1, 5.0), (1000, 1, 3.0)):
        for friction in (0.5, 2):
            for masses in (1, 1e3, 1e4):
                for overlap in (0, 0.5):
                    for seed in range(seeds):
                        for step in (0.002, 0.01):
                            chosen.append(({"count": count, "friction": friction, "mass_range": masses,
                                            "overlap": overlap, "seed": seed}, step, duration))
    for extra in ({"with_chain": True}, {"in_bin": True}):
        for count in (16, 64, 200):
            for masses in (1, 1e3):
                chosen.append(({"count": count, "friction": 0.5, "mass_range": masses, "overlap": 0, "seed": 0, **extra},
                               0.002, 5.0))
    return chosen


def pile_runs(arguments):
    runs, folder = [], arguments.out / "piles"
    for options, step, duration in pile_choices(arguments.full):
        name = pile_name(**options)
        if not (folder / f"{name}.yaml").exists() or not arguments.keep:
            write(pile(name, duration=5.0, **options), folder)
        row = {"kind": "pile", "scene": name, "bodies": options["count"], "friction": options["friction"],
               "mass_range": options["mass_range"], "overlap": options["overlap"], "seed": options["seed"],
               "time_step_s": step, "duration_s": duration}
        runs.append((row, [str(folder / f"{name}.yaml"), "--timestep", f"{step:g}", "--duration", f"{duration:g}"]))
    return runs


def one_a_robot(urdfs, folder):
    """The shortest name of every folder right below (robots/X of example-robot-data: of X)."""
    chosen = {}
    for urdf in urdfs:
        parts = urdf.relative_to(folder).parts
        key = parts[1] if parts[0] == "robots" and len(parts) > 2 else parts[0]
        if key not in chosen or len(urdf.name) < len(chosen[key].name):
            chosen[key] = urdf
    return sorted(chosen.values())


def robot_runs(arguments):
    runs = []
    packages = [text for package in arguments.package for text in ("--package", package)]
    for folder in arguments.robots:
        if not folder.is_dir():
            print(f"Skipped: {folder} is not there", flush=True)
            continue
        urdfs = sorted(folder.rglob("*.urdf"))
        if not arguments.full:
            urdfs = one_a_robot(urdfs, folder)[::3]
        for urdf in urdfs:
            for base in ("floating", "fixed"):
                for scale in (("0", "1") if arguments.full else ("1",)):
                    for step in (0.0005, 0.002, 0.01)[0 if arguments.full else 1:]:
                        duration = 5.0 if arguments.full else 1.0
                        row = {"kind": "robot", "scene": str(urdf.relative_to(folder)), "base": base, "inputs": scale,
                               "seed": 0, "time_step_s": step, "duration_s": duration}
                        drive = ["--random-inputs", scale, "--seed", "0"] if scale != "0" else []
                        runs.append((row, [str(urdf), "--base", base, "--ground", *packages, *drive, "--timestep",
                                           f"{step:g}", "--duration", f"{duration:g}"]))
    return runs


# ---- running -------------------------------------------------------------------------------------------

def run(command, row, options, limit):
    """The row, filled in."""
    row = dict(row)
    words = [command, "simulate", *options]
    row["command"] = shlex.join(words)
    with tempfile.TemporaryDirectory() as temporary:
        report = pathlib.Path(temporary) / "report.json"
        try:
            done = subprocess.run([*words, "--wall-limit", f"{limit:g}", "--json", str(report)], capture_output=True,
                                  text=True, errors="replace", timeout=limit + SLACK)
        except subprocess.TimeoutExpired:
            row.update(exit="", status="killed", message=f"not done {limit + SLACK:g} s after its start")
            return row
        row["exit"] = done.returncode
        figures = json.loads(report.read_text()) if report.exists() else {}
    last = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else ""
    row["status"] = figures.get("status", "refused" if done.returncode == 2 else "crashed")
    row["message"] = figures.get("message", last if row["status"] != "ok" else "")
    row.update({column: figures.get(key, "") for column, key in FIGURES.items()})
    return row


def run_all(arguments, runs, limit):
    """Rows in the order of `runs`; each is written as soon as all before it are there."""
    rows = []
    with open(arguments.out / "robustness.csv", "w", newline="", encoding="utf-8") as file, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        for row in pool.map(lambda r: run(arguments.command, *r, limit), runs):
            writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
            file.flush()
            rows.append(row)
            shown = f"{row['scene']} {row.get('base', '')}".strip()
            cost = f"Newton {row['newton_mean']:.3g} / {row['newton_p99']} / {row['newton_max']}, " \
                   f"{row['step_median_us']:.3g} / {row['step_p99_us']:.3g} us" if row.get("steps") else ""
            print(f"{len(rows)}/{len(runs)} {row['status']:8} {shown}, {1000 * row['time_step_s']:g} ms: {cost}"
                  f" {row['message'][:160]}", flush=True)
    return rows


def summary(rows):
    out = {}
    for kind in sorted({row["kind"] for row in rows}):
        mine = [row for row in rows if row["kind"] == kind]
        stepped = [row for row in mine if row.get("steps")]
        out[kind] = {"runs": len(mine)}
        for status in ("ok", "failed", "stopped", "killed", "crashed", "refused"):
            out[kind][status] = sum(row["status"] == status for row in mine)
        for column in ("newton_mean", "newton_p99", "newton_max", "max_penetration_m", "end_penetration_m",
                       "end_below_ground_m", "energy_gain_J"):
            values = sorted(row[column] for row in stepped if isinstance(row[column], (int, float)))
            if values:
                out[kind][column] = {"median": values[len(values) // 2], "largest": values[-1]}
        out[kind]["softened_steps"] = sum(row["softened_steps"] or 0 for row in stepped)
    return out


def print_summary(found, rows):
    for kind, figures in found.items():
        counts = ", ".join(f"{n} {s}" for s, n in figures.items() if isinstance(n, int) and s != "runs" and n)
        print(f"\n{kind}s: {figures['runs']} runs, {counts}")
        for column, values in figures.items():
            if isinstance(values, dict):
                print(f"  {column:20} median {values['median']:.4g}, largest {values['largest']:.4g}")
    bad = [row for row in rows if row["status"] not in ("ok", "refused")]
    if bad:
        print("\nTo repeat what did not come to its end:")
        for row in bad:
            print(f"  {row['command']}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", help="counterpoint, e.g. build/release/bin/counterpoint")
    parser.add_argument("--robots", type=pathlib.Path, action="append", default=[], metavar="DIR",
                        help="folder below which URDFs are looked for; may be repeated; one that is missing is skipped aloud")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR",
                        help="where package://NAME/ of URDFs is, as for simulate")
    parser.add_argument("--full", action="store_true", help="the whole matrix: hours")
    parser.add_argument("--only", choices=("piles", "robots"), help="piles, or robots alone")
    parser.add_argument("--match", default="", metavar="TEXT", help="only runs whose scene or path has TEXT in it")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/robustness"), metavar="DIR",
                        help="folder for robustness.csv and the scenes of the piles; default out/robustness")
    parser.add_argument("--keep", action="store_true", help="take scenes of piles that are in --out already as they are")
    parser.add_argument("--limit", type=float, metavar="S",
                        help=f"seconds that the steps of a run may take; default {QUICK_LIMIT:g}, with --full {FULL_LIMIT:g}")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time; default 2")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="write the summary as JSON")
    arguments = parser.parse_args()
    if not pathlib.Path(arguments.command).is_file():
        parser.error(f"{arguments.command}: no such file; expected the counterpoint command")
    if arguments.jobs < 1 or (arguments.limit is not None and arguments.limit <= 0):
        parser.error("--jobs, --limit: expected positive numbers")
    arguments.command = str(pathlib.Path(arguments.command))
    return arguments


def main():
    arguments = parse()
    arguments.out.mkdir(parents=True, exist_ok=True)
    runs = [] if arguments.only == "robots" else pile_runs(arguments)
    if arguments.only != "piles":
        runs += robot_runs(arguments)
    runs = [r for r in runs if arguments.match in r[0]["scene"]]
    start = time.monotonic()
    rows = run_all(arguments, runs, arguments.limit or (FULL_LIMIT if arguments.full else QUICK_LIMIT))
    found = summary(rows)
    print_summary(found, rows)
    print(f"\n{len(rows)} runs in {time.monotonic() - start:.0f} s; every figure in {arguments.out / 'robustness.csv'}")
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return 1 if any(row["status"] not in ("ok", "refused") for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
