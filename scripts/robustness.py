#!/usr/bin/env python3
"""Runs random piles, and every URDF below some folders, and writes one row of figures per run.

    scripts/robustness.py build/release/bin/counterpoint
    scripts/robustness.py build/release/bin/counterpoint --robots ~/robots --package example-robot-data=~/erd --full
    scripts/robustness.py build/release/bin/counterpoint --robots ~/robots --full --budget 600 --page robustness.md

The default is a selection of two minutes; --full runs the whole matrix, with the runs most likely to fail first: piles
of 16 to 1000 bodies (friction, masses, time step, overlap, seeds), robots floating and fixed on the ground, unpowered
and under random torques, at 0.5, 2 and 10 ms. Every run is one `counterpoint simulate`; its row contains the command
that repeats it. Rows are kept in --out and not run again by the same build, so that a matrix of hours can be run in
parts (--budget). Every row is judged:

    ended         exit code 0
    energy        exceeds the energy of the start, plus the work of the inputs along the path of each step and of the
                  overlap correction, by at most 1 % of the highest energy. With a constant mass matrix semi-implicit
                  Euler never exceeds it: a step changes kinetic energy by h u'v+, by f'J v+ <= 0 of contacts and by
                  -|v+ - v|^2_M / 2. The 1 % allows for trees, and for the 1 mm/s at which overlaps part by velocity
    ground        no point is more than 1 cm below the ground at the end
    inverse       `counterpoint inverse` over the motion finds the applied forces with an error of at most 1e-8 of the
                  largest force at work or of 1 N, so it separates them from contact forces
    newton        no step takes more than 200 Newton steps, and 99 of 100 at most 30

Exit code 1 if a run failed, crashed or was killed, or violates the bounds of energy, ground or inverse. A URDF that is
refused as bad input, and a run that exceeded its wall time (--limit), do not count. Standard library only.
"""
import argparse
import concurrent.futures
import csv
import json
import math
import pathlib
import shlex
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
from scenes.robustness_runs import hardness, interleaved, pile_runs, robot_runs  # noqa: E402

# Maps columns to keys of the report of simulate (docs/reference/json-reports.md).
FIGURES = {"simulated_s": "simulated_seconds", "steps": "steps", "newton_mean": "newton_iterations_mean",
           "newton_p99": "newton_iterations_p99", "newton_max": "newton_iterations_max",
           "failed_steps": "solver_failures", "softened_steps": "softened_steps", "step_median_us": "step_time_median_us",
           "step_p99_us": "step_time_p99_us", "step_max_us": "step_time_max_us", "wall_s": "wall_seconds",
           "contacts": "contacts_mean", "max_penetration_m": "max_penetration_m", "end_penetration_m": "end_penetration_m",
           "end_below_ground_m": "end_below_ground_m", "below_ground_max_m": "below_ground_max_m",
           "energy_start_J": "energy_start_J", "energy_max_J": "energy_max_J", "input_work_J": "input_work_J",
           "overlap_work_J": "overlap_work_J", "energy_gain_J": "energy_gain_max_J",
           "energy_excess_J": "energy_excess_J", "state_hash": "state_hash"}
COLUMNS = ["kind", "scene", "base", "inputs", "bodies", "friction", "mass_range", "overlap", "seed", "time_step_s",
           "duration_s", "exit", "status", "short_of", *FIGURES, "inverse_error", "message",
           "command"]
ENERGY_SHARE, DEPTH, INVERSE_ERROR, NEWTON_P99, NEWTON_MAX = 0.01, 0.01, 1e-8, 30, 200  # bounds, see the docstring
BAD = {"failed", "crashed", "killed"}
QUICK_LIMIT, FULL_LIMIT = 10.0, 120.0  # largest time of the steps of a run [s]
SLACK = 30.0                           # time beyond the limit for reading and for one long step, then the run is killed [s]


# ---- running -------------------------------------------------------------------------------------------

def judge(row):
    """Criteria that a row fails, as words."""
    short = [] if row["status"] in ("ok", "refused") else [row["status"]]
    if not row.get("steps"):
        return short
    excess, highest = row["energy_excess_J"], row["energy_max_J"]
    if isinstance(excess, float) and excess > ENERGY_SHARE * abs(highest) + 1e-6:
        short.append("energy")
    if row["status"] == "ok" and row["end_below_ground_m"] > DEPTH and row["base"] != "fixed":
        short.append("ground")
    if row["inverse_error"] == "failed" or (row["inverse_error"] != "" and row["inverse_error"] > INVERSE_ERROR):
        short.append("inverse")
    if row["newton_p99"] > NEWTON_P99 or row["newton_max"] > NEWTON_MAX:
        short.append("newton")
    return short


def inverse_error(command, options, motion, limit):
    """Error of the applied forces found, relative to the largest force or 1 N; "failed"; or "" after `limit`."""
    words = [command, "inverse", options[0], str(motion)]
    rest = iter(options[1:])
    for option in rest:
        value = [] if option == "--ground" else [next(rest)]
        words += [] if option in ("--duration", "--random-inputs", "--seed") else [option, *value]
    try:
        done = subprocess.run([*words, "--json", "-"], capture_output=True, text=True, errors="replace", timeout=limit)
        found = json.loads(done.stdout)
        return found.get("applied_force_error_max", 0.0) / max(found["force_scale_max"], 1.0)
    except subprocess.TimeoutExpired:
        return ""
    except (ValueError, KeyError):
        return "failed"


def run(command, row, options, prepare, limit):
    """Runs a row and returns it with its figures."""
    if prepare:
        prepare()
    row = dict(row)
    words = [command, "simulate", *options]
    row["command"] = shlex.join(words)
    with tempfile.TemporaryDirectory() as temporary:
        report, motion = pathlib.Path(temporary) / "report.json", pathlib.Path(temporary) / "motion.h5"
        try:
            words += ["--wall-limit", f"{limit:g}", "--json", str(report), "--output", str(motion)]
            done = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=limit + SLACK)
        except subprocess.TimeoutExpired:
            row.update(exit="", status="killed", short_of="killed",
                       message=f"not done {limit + SLACK:g} s after its start")
            return row
        row["exit"] = done.returncode
        figures = json.loads(report.read_text()) if report.exists() else {}
        row["inverse_error"] = inverse_error(command, options, motion, limit + SLACK) if figures.get("steps") else ""
    last = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else ""
    row["status"] = figures.get("status", "refused" if done.returncode == 2 else "crashed")
    row["message"] = figures.get("message", last if row["status"] != "ok" else "")
    row.update({column: figures.get(key, "") for column, key in FIGURES.items()})
    row = {"base": "", "inputs": "", **row}
    row["short_of"] = " ".join(judge(row))
    return row


def number(text):
    """Parses a field of the table: an integer, a float, or the text unchanged."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def rows_before(path):
    if not path.exists():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        rows = [{k: v if k in ("state_hash", "scene", "inputs", "message", "command") else number(v)
                 for k, v in row.items()} for row in csv.DictReader(file)]
    for row in rows:  # 0.0 was written as "0"
        row["energy_excess_J"] = float(row["energy_excess_J"]) if row["energy_excess_J"] != "" else ""
    return rows


def run_all(arguments, runs, limit):
    """Returns all rows, those of earlier calls first; each new row is written once all rows before it are complete."""
    path = arguments.out / "robustness.csv"
    rows = rows_before(path)
    known = {row["command"] for row in rows}
    runs = [r for r in runs if shlex.join([arguments.command, "simulate", *r[1]]) not in known]
    end = time.monotonic() + (arguments.budget or math.inf)
    with open(path, "a", newline="", encoding="utf-8") as file, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        if not rows:
            writer.writeheader()
        started = pool.map(lambda r: run(arguments.command, *r, limit) if time.monotonic() < end else None, runs)
        for count, row in enumerate(started, 1):
            if row is None:
                print(f"{len(runs) - count + 1} runs are left for the next call", flush=True)
                break
            writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
            file.flush()
            rows.append(row)
            shown = f"{row['scene']} {row.get('base', '')}".strip()
            cost = f"Newton {row['newton_mean']:.3g} / {row['newton_p99']} / {row['newton_max']}, " \
                   f"{row['step_median_us']:.3g} / {row['step_p99_us']:.3g} us" if row.get("steps") else ""
            print(f"{count}/{len(runs)} {row['status']:8} {shown}, {1000 * row['time_step_s']:g} ms: {cost}"
                  f" {row['short_of']} {row['message'][:160]}", flush=True)
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
                       "end_below_ground_m", "energy_excess_J", "inverse_error"):
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
    bad = [row for row in rows if row["short_of"]]
    if bad:
        print("\nTo repeat what falls short:")
        for row in bad:
            print(f"  {row['short_of']}: {row['command']}")


# ---- the page ------------------------------------------------------------------------------------------

def group_of(row):
    step = f"{1000 * row['time_step_s']:g} ms"
    if row["kind"] == "robot":
        return ("robots, " + ("random torques" if row["inputs"] != "0" else "unpowered"), row["base"], step)
    decades = round(math.log10(row["mass_range"]))
    masses = f"1e-{decades} ... 1e{decades}" if decades else "equal"
    about = row["scene"].split("_")[0] if not row["scene"].startswith("chain") else "chain into pile"
    return (f"{about} of {row['bodies']}" + (", overlapped" if row["overlap"] else ""),
            f"mu {row['friction']:g}, masses {masses}", step)


def largest(rows, column):
    return max((row[column] for row in rows if isinstance(row[column], (int, float))), default=0)


def table_line(group, rows):
    stepped = [row for row in rows if row.get("steps")]
    steps = sum(row["steps"] for row in stepped)
    ended, counted = (sum(row["status"] in which for row in rows) for which in (("ok",), ("ok", "stopped", *BAD)))
    cells = [*group, f"{ended} of {counted}"]
    if not steps:
        return "| " + " | ".join(cells + ["-"] * 7) + " |"
    mean = sum(row["newton_mean"] * row["steps"] for row in stepped) / steps
    soft = 100 * sum(row["softened_steps"] for row in stepped) / steps
    gain = max((row["energy_excess_J"] / abs(row["energy_max_J"]) for row in stepped
                if isinstance(row["energy_excess_J"], float) and row["energy_max_J"]), default=0.0)
    middle = sorted(row["step_median_us"] for row in stepped)[len(stepped) // 2]
    cells += [str(steps), f"{mean:.1f} / {largest(stepped, 'newton_p99')} / {largest(stepped, 'newton_max')}",
              f"{soft:.2f} %", f"{max(gain, 0.0):.1g}", f"{1000 * largest(stepped, 'end_below_ground_m'):.2g} mm",
              f"{largest(stepped, 'inverse_error'):.1g}",
              " / ".join(f"{us / 1000:.3g}" for us in (middle, largest(stepped, "step_p99_us"),
                                                       largest(stepped, "step_max_us")))]
    return "| " + " | ".join(cells) + " |"


def bounded_softening(rows):
    """Numbers of steps and of softened steps at 2 ms, for equal-mass piles without overlap and for robots."""
    chosen = [row for row in rows if row.get("steps") and row["time_step_s"] == 0.002 and
              (row["kind"] == "robot" or (row["mass_range"] == 1 and row["overlap"] == 0))]
    return sum(row["steps"] for row in chosen), sum(row["softened_steps"] for row in chosen)


def page(rows, matrix):
    counted = [row for row in rows if row["status"] != "refused"]
    steps, soft = bounded_softening(rows)
    lines = [
        "# Does contact ever stop?", "",
        "Random piles and robots, run by `scripts/robustness.py build/release/bin/counterpoint --robots DIR --full --page",
        "docs/measurements/robustness.md`; that script says what is run and how it is judged. Processor times are of a busy",
        "machine.", "",
        f"* {len(rows)} of the {matrix} runs of the matrix were made, the hardest first:",
        f"  {sum(row['status'] == 'ok' for row in rows)} ended, {sum(row['status'] in BAD for row in rows)} failed, "
        f"{sum(row['status'] == 'stopped' for row in rows)} had not enough wall time, "
        f"{len(rows) - len(counted)} were refused as bad input.",
        f"* Softened steps of robots and of piles of equal masses that start apart, at 2 ms: {soft} of {steps}",
        f"  ({100 * soft / max(steps, 1):.3f} %).", "",
        "Newton steps a step: mean, 99 % and most of the worst run. Energy: what no input and no correction of overlaps gave,",
        "as a share of the highest energy. Ground: deepest point below it at the end. Inverse: largest error of the applied",
        "forces found, over the largest force at work. Time of a step: median, 99 %, largest.", "",
        "| what | | time step | ended | steps | Newton steps | softened | energy | ground | inverse | time of a step [ms] |",
        "|---|---|---|---|---|---|---|---|---|---|---|"]
    groups = {}
    for row in rows:
        groups.setdefault(group_of(row), []).append(row)
    lines += [table_line(group, groups[group]) for group in sorted(groups)]
    slow = sum(row["short_of"] == "newton" for row in rows)
    short = [row for row in rows if row["short_of"] not in ("", "newton")]
    lines += ["", f"{slow} runs fall short of Newton steps alone: more than {NEWTON_P99} in more than one step of 100, "
                  f"or more than {NEWTON_MAX}", "in any."]
    if short:
        lines += ["", "## What falls short of anything else", "",
                  "| what | of | Newton steps | energy excess J, highest | ground m | inverse | message |",
                  "|---|---|---|---|---|---|---|"]
    for row in short:
        words = (pathlib.PurePath(row["scene"]).name, row["base"], "torques" if row["inputs"] == "1" else "",
                 f"{1000 * row['time_step_s']:g} ms")
        name = " ".join(word for word in words if word)
        figures = [f"{row['newton_mean']:.3g} / {row['newton_p99']} / {row['newton_max']}",
                   f"{row['energy_excess_J']:.3g}, {row['energy_max_J']:.3g}"
                   if isinstance(row["energy_excess_J"], float) else "-",
                   f"{row['end_below_ground_m']:.2g}",
                   f"{row['inverse_error']:.2g}" if isinstance(row["inverse_error"], (int, float)) else
                   row["inverse_error"] or "-"] if row.get("steps") else ["-"] * 4
        message = row["message"].replace("|", "/")[:110]
        lines.append("| " + " | ".join([name, row["short_of"], *figures, message]) + " |")
    return "\n".join(lines) + "\n"


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
    parser.add_argument("--budget", type=float, metavar="S",
                        help="start no run after so many seconds; the next call goes on")
    parser.add_argument("--again", action="store_true", help="forget the rows in --out")
    parser.add_argument("--page", type=pathlib.Path, metavar="FILE", help="write the rows as a page (Markdown)")
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
    before = arguments.out / "robustness.csv"
    if before.exists() and (arguments.again or
                            before.stat().st_mtime < pathlib.Path(arguments.command).stat().st_mtime):
        before.unlink()  # rows of another build are not valid for this one
    piles = [] if arguments.only == "robots" else pile_runs(arguments)
    robots = [] if arguments.only == "piles" else robot_runs(arguments)
    if arguments.full:
        piles.sort(key=lambda r: hardness(r[0]))
        robots.sort(key=lambda r: hardness(r[0]))
    runs = interleaved(piles, robots)
    runs = [r for r in runs if arguments.match in r[0]["scene"]]
    start = time.monotonic()
    rows = run_all(arguments, runs, arguments.limit or (FULL_LIMIT if arguments.full else QUICK_LIMIT))
    found = summary(rows)
    print_summary(found, rows)
    print(f"\n{len(rows)} runs in {time.monotonic() - start:.0f} s; every figure in {arguments.out / 'robustness.csv'}")
    if arguments.page:
        arguments.page.write_text(page(rows, len(runs)), encoding="utf-8")
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    wrong = BAD | {"energy", "ground", "inverse"}
    return int(any(wrong & {row["status"], *row["short_of"].split()} for row in rows))


if __name__ == "__main__":
    sys.exit(main())
