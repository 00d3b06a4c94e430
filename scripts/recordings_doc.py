#!/usr/bin/env python3
"""Writes what the engine finds in real recordings into docs/recordings.md, from runs of the command.

    scripts/recordings_doc.py --data FOLDER [--command build/release/bin/counterpoint] [--check]

FOLDER holds cube_toss, planar_square_drop, simple_pendulum; what is missing is said and left as it is.
--check compares instead of writing; exit code 1 if the text differs.
"""
import argparse
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs/recordings.md"


def run(options, words):
    """The report of a command, and the command as a reader would type it."""
    files = [f for word in words for f in expand(options, word)]
    done = subprocess.run([options.command, *files, "--json", "-"], capture_output=True, text=True, cwd=ROOT)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr}")
    return json.loads(done.stdout), "    counterpoint " + " ".join(words) + "\n"


def expand(options, word):
    if "*" not in word and not word.endswith(".csv"):
        return [word]
    folder, pattern = word.rsplit("/", 1)
    return sorted(str(f) for f in (options.data / folder).glob(pattern))


def toss_row(name, figures):
    return (f"| {name} | {1e3 * figures['position_error_mean_m']:.1f} / {figures['rotation_error_mean_deg']:.1f} "
            f"| {1e3 * figures['position_error_end_m']:.1f} / {figures['rotation_error_end_deg']:.1f} |\n")


def parameter_rows(report):
    text = "| | as in the scene | found | 95 % |\n|---|---|---|---|\n"
    for p in report["parameters"]:
        text += (f"| {p['name']} [{p['unit']}] | {p['scene']:.4g} | {p['value']:.4g} "
                 f"| {p['lower_95']:.4g} ... {p['upper_95']:.4g} |\n")
    return text


def cube_toss(options):
    words = ["data/scenes/cube_toss.yaml", "cube_toss/toss_*.csv", "--columns", "data/maps/cube_toss.yaml"]
    fit = ["--objective", "rows", "--horizon", "15", "--samples", "40", "--refined", "1", "--parameters",
           "friction=0.1..0.4,restitution=0..0.5,size=0.9..1.05,gravity=9.4..10,inertia=0.7..2"]
    text = ("Median over recordings, position [mm] / rotation [degrees]; whole rollouts. Half A is the first toss, the "
            "third and so on.\n\n")
    text += "| | mean | at the end |\n|---|---|---|\n"
    whole, command = run(options, ["compare", *words])
    text += toss_row("all 52, published figures", whole["median"])
    commands, tables = command, ""
    for name, more in (("half B, fitted on A", []), ("half A, fitted on B", ["--swap"])):
        report, command = run(options, ["identify", *words, *fit, *more])
        commands += command
        text += toss_row(f"{name}: published figures", report["test"]["scene"])
        text += toss_row(f"{name}: **found**", report["test"]["found"])
        tables += f"\n{name[0].upper() + name[1:]}:\n\n" + parameter_rows(report)
    inverse, command = run(options, ["compare", *words, "--mode", "inverse"])
    m = inverse["median"]
    tables += (f"\nForces: {100 * m['unexplained_force_median']:.1f} % of the weight is left unexplained (median over "
               f"rows and recordings), {100 * m['unexplained_force_mean']:.1f} % in the mean, "
               f"{m['unexplained_force_max']:.2f} weights at most; the ground carries {m['contact_force_mean']:.3f} weights "
               "in the mean.\n")
    return text + tables, commands + command


def square_drop(options):
    words = ["data/scenes/recordings/square_drop.yaml", "planar_square_drop/drop_*.csv", "--columns",
             "data/maps/square_drop.yaml"]
    report, command = run(options, ["identify", *words, "--objective", "rows", "--horizon", "10", "--samples", "30",
                                    "--refined", "1", "--parameters", "friction=0.02..0.6,restitution=0..0.8"])
    text = "Median of the mean of |x|, |z| [m] and |angle| [rad]; whole rollouts, 25 drops not fitted.\n\n"
    text += "| | mean | at the end |\n|---|---|---|\n"
    for name, key in (("guessed figures", "scene"), ("**found** on the other 25", "found")):
        f = report["test"][key]
        text += f"| {name} | {f['joint_error_mean']:.2f} | {f['joint_error_end']:.2f} |\n"
    short, second = run(options, ["compare", *words, "--horizon", "10", "--set", report["set"]])
    text += "\n" + parameter_rows(report)
    text += f"\nTen rows (40 ms) ahead with what was found: {short['median']['joint_error_mean']:.4f}.\n"
    return text, command + second


def pendulum(options):
    words = ["data/scenes/recordings/rod_pendulum.yaml", "simple_pendulum/pd_system_identification.csv", "--columns",
             "data/maps/rod_pendulum.yaml"]
    text, commands = "Mean error of the angle [rad], nominal figures.\n\n| start | error |\n|---|---|\n", ""
    for name, more in (("every row", ["--mode", "one-step"]), ("every 100 rows", ["--horizon", "100"]),
                       ("the first row only", [])):
        report, command = run(options, ["compare", *words, *more])
        text += f"| {name} | {report['median']['joint_error_mean']:.3g} |\n"
        commands += command
    return text, commands


SECTIONS = {"cube_toss": cube_toss, "planar_square_drop": square_drop, "simple_pendulum": pendulum}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--command", default=str(ROOT / "build/release/bin/counterpoint"))
    parser.add_argument("--only", choices=SECTIONS)
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    options.data = options.data.resolve()
    options.command = str(pathlib.Path(options.command).resolve())
    text = DOCUMENT.read_text()
    stale = False
    for name, section in SECTIONS.items():
        if options.only not in (None, name):
            continue
        if not (options.data / name).is_dir():
            print(f"{name}: not in {options.data}, left as it is")
            continue
        begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
        found, commands = section(options)
        before, rest = text.split(begin)
        old, after = rest.split(end)
        new = f"\n{commands}\n{found}\n"
        stale |= old != new
        text = before + begin + new + end + after
        print(f"{name}: {'differs' if old != new else 'as it is'}")
    if not options.check:
        DOCUMENT.write_text(text)
    return 1 if options.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
