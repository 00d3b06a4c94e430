#!/usr/bin/env python3
"""Writes the results of the engine on real recordings into docs/measurements/recordings.md, from runs of the command.

    scripts/measurements/recordings_doc.py --data FOLDER [--command build/release/bin/counterpoint] [--check]

FOLDER contains cube_toss, planar_square_drop, simple_pendulum, arms, planar_ellipse_impacts, cassie_impact, human_walk,
icub_walk and robots; sections without data are reported and left unchanged.
--check compares instead of writing; exit code 1 if the text differs.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import marked

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/measurements/recordings.md"


def run(options, words):
    """Runs a command; returns its report, and the command as a reader would type it."""
    files = [f.replace("'", "") for word in words for f in expand(options, word)]
    done = subprocess.run([options.command, *files, "--json", "-"], capture_output=True, text=True, cwd=ROOT)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr}")
    return json.loads(done.stdout), "    counterpoint " + " ".join(words) + "\n"


def expand(options, word):
    if "=robots/" in word:  # NAME=FOLDER for --package
        name, folder = word.split("=", 1)
        return [f"{name}={options.data / folder}"]
    if word.startswith("'") or "*" not in word and not word.endswith(".csv"):
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
           "friction=0.1..0.4,restitution=0..0.5,size=0.9..1.05,inertia=0.7..2,com_x=-0.015..0.015,"
           "com_y=-0.015..0.015,com_z=-0.015..0.015"]
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


def found_row(p):
    """One parameter found, with its interval."""
    interval = "-" if p["lower_95"] is None else f"{p['lower_95']:.3g} ... {p['upper_95']:.3g}"
    return f"{p['value'] if abs(p['value']) > 1e-6 else 0:.3g} ({interval})"


def ur10(options):
    words = ["data/scenes/recordings/ur10.yaml", "arms/ur10_exciting.csv", "--columns", "data/maps/ur10_torques.yaml"]
    joints = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    kinds = {"damping": "=0..80", "dry_friction": "=0..40", "armature": "=0..8", "force_offset": ""}
    report, command = run(options, ["identify", *words, "--objective", "torque", "--rest-speed", "0.05", "--parameters",
                                    ",".join(f"'{kind}:*{bounds}'" for kind, bounds in kinds.items())])
    bare = {c["name"]: c for c in report["test"]["coordinates"]["scene"]}
    test = {c["name"]: c for c in report["test"]["coordinates"]["found"]}
    found = {p["name"]: p for p in report["parameters"]}
    text = ("Torque of the motion against the effort logged, both below 10 Hz, in the ten pieces of 1.4 s that were not fitted;\n"
            "rms of the difference [N m] / R2.\n\n| joint | effort, standard deviation [N m] | links alone | "
            "**with what was found** |\n|---|---|---|---|\n")
    for joint in joints:
        b, t = bare[joint + ".u"], test[joint + ".u"]
        text += (f"| {joint} | {b['recorded_deviation']:.2f} | {b['rms']:.2f} / {b['r2']:.3f} "
                 f"| {t['rms']:.2f} / {t['r2']:.3f} |\n")
    text += ("\nFound on the other ten (95 %):\n\n| joint | damping [N m s/rad] | dry friction [N m] | rotor inertia [kg m²] "
             "| offset of the effort [N m] |\n|---|---|---|---|---|\n")
    for joint in joints:
        text += f"| {joint} | " + " | ".join(found_row(found[f"{kind}:{joint}"]) for kind in kinds) + " |\n"
    return text, command


def impacts(options):
    words = ["data/scenes/recordings/ellipse_impacts.yaml", "planar_ellipse_impacts/impacts_a.csv", "--columns",
             "data/maps/ellipse_impacts.yaml"]
    text = ("Velocities after the impact. Error: median over impacts of sqrt(d' M d / m), d predicted less recorded; then root mean squares by "
            "coordinate.\n\n| | error [m/s] | x [m/s] | z [m/s] | angle [rad/s] | energy after / before, median |\n|---|---|---|---|---|---|\n")
    commands, tables, scene_done = "", "", False
    for name, more in (("half B, fitted on A", []), ("half A, fitted on B", ["--swap"])):
        report, command = run(options, ["identify", *words, "--objective", "rows", "--samples", "40", "--refined", "1", "--parameters",
                                        "friction=0.01..1,restitution=0..0.9", *more])
        commands += command
        for which, title in (("scene", "guessed"), ("found", "**found**")):
            f = report["test"][which]
            c = {x["name"]: x["rms"] for x in report["test"]["coordinates"][which]}
            text += (f"| {name}: {title} | {f['velocity_error_m_s']:.3f} | {c['x.v']:.3f} | {c['z.v']:.3f} | {c['turn.v']:.2f} "
                     f"| {f['energy_ratio']:.3f} |\n")
        text += f"| {name}: recorded | | | | | {report['test']['found']['recorded_energy_ratio']:.3f} |\n"
        tables += f"\n{name[0].upper() + name[1:]}:\n\n" + parameter_rows(report)
        if name.startswith("half B"):
            deviations = {x["name"]: x for x in report["test"]["coordinates"]["found"]}
            tables += ("\nShare of the variance of the velocities after that is explained (R2): x {:.3f}, z {:.3f}, angle {:.3f}.\n"
                       .format(*(deviations[n]["r2"] for n in ("x.v", "z.v", "turn.v"))))
    return text + tables, commands


def cassie(options):
    words = ["data/scenes/recordings/cassie.yaml", "cassie_impact/jump_*.csv", "--columns", "data/maps/cassie.yaml", "--package",
             "cassie_v2=robots/cassie_v2/Cassie"]
    text = ("Medians over six landings; velocities: root mean square over landings and, of joints, over joints of a kind, at the end of each "
            "prediction.\n\n| predicted from | base position, mean / end [mm] | base rotation, mean / end [degrees] | base velocity, z / all "
            "[m/s] | motor joints [rad/s] | spring and ankle joints [rad/s] |\n|---|---|---|---|---|---|\n")
    commands, spread = "", {}
    for name, more in (("the first row, 50 ms", []), ("every 10 rows, 5 ms", ["--horizon", "10"]), ("every row", ["--mode", "one-step"])):
        report, command = run(options, ["compare", *words, *more])
        commands += command
        m, c = report["median"], {x["name"]: x for x in report["coordinates"]}

        def rms(names, key="rms"):
            return math.sqrt(sum(c[n][key] ** 2 for n in names) / len(names))

        base = [f"pelvis.v{a}" for a in "xyz"]
        motors = [f"{j}_{s}.v" for j in ("hip_roll", "hip_yaw", "hip_pitch", "knee", "toe") for s in ("left", "right")]
        passive = [f"{j}_{s}.v" for j in ("knee_joint", "ankle_joint") for s in ("left", "right")]
        text += (f"| {name} | {1e3 * m['position_error_mean_m']:.3g} / {1e3 * m['position_error_end_m']:.3g} "
                 f"| {m['rotation_error_mean_deg']:.3g} / {m['rotation_error_end_deg']:.3g} "
                 f"| {c['pelvis.vz']['rms']:.3g} / {math.sqrt(3) * rms(base):.3g} | {rms(motors):.3g} | {rms(passive):.3g} |\n")
        if not spread:
            spread = {"base": math.sqrt(3) * rms(base, "recorded_deviation"), "motors": rms(motors, "recorded_deviation"),
                      "passive": rms(passive, "recorded_deviation")}
    text += ("\nTo compare with: at the end of the landings these velocities scatter from one to the other by "
             f"{spread['base']:.3g} m/s, {spread['motors']:.3g} rad/s and {spread['passive']:.3g} rad/s.\n")
    inverse, command = run(options, ["compare", *words, "--mode", "inverse"])
    m = inverse["median"]
    c = {x["name"]: x for x in inverse["coordinates"]}
    motors = [f"{j}_{s}.u" for j in ("hip_roll", "hip_yaw", "hip_pitch", "knee", "toe") for s in ("left", "right")]
    text += (f"\nForces: {m['unexplained_force_median']:.2g} weights on the base are left unexplained (median over rows and landings), "
             f"{m['unexplained_force_mean']:.2g} in the mean, {m['unexplained_force_max']:.2g} at most; of motor joints "
             f"{math.sqrt(sum(c[n]['rms'] ** 2 for n in motors) / len(motors)):.3g} N m (root mean square); the ground carries "
             f"{m['contact_force_mean']:.2g} weights in the mean.\n")
    return text, commands + command


def walk(options, folder, feet, pieces):
    """Runs `counterpoint explain` on a recording with measured forces of the feet."""
    measured = "".join(f"  {name}: {{links: [{', '.join(links)}], {', '.join(f'{a}: {c}' for a, c in columns.items())}}}\n"
                       for name, (links, columns) in feet.items())
    text = ("Found from the positions alone, with the command's defaults: root mean square of found less measured, % of\nthe "
            "weight; in brackets the share of rows inside the 95 % interval.\n\n| rows | " +
            " | ".join(f"{name}, {a}" for name, (_, columns) in feet.items() for a in columns) +
            " | unexplained, mean | Newton steps |\n|" + "---|" * (3 + sum(len(c) for _, c in feet.values())) + "\n")
    commands = ""
    with tempfile.TemporaryDirectory() as scratch:
        columns = pathlib.Path(scratch) / "map.yaml"
        columns.write_text((options.data / folder / "map.yaml").read_text() + "contact_forces:\n" + measured)
        for recording, start, end in pieces:
            words = ["explain", f"{folder}/scene.yaml", f"{folder}/{recording}", "--columns", f"{folder}/map.yaml",
                     "--from", f"{start:g}", "--to", f"{end:g}"]
            files = [str(columns) if w.endswith("map.yaml") else str(options.data / w) if w.startswith(folder) else w
                     for w in words]
            done = subprocess.run([options.command, *files, "--json", "-"], capture_output=True, text=True, cwd=ROOT)
            if done.returncode not in (0, 1) or not done.stdout:
                sys.exit(f"{' '.join(words)}: {done.stderr}")
            report = json.loads(done.stdout)["recordings"][0]
            figures = [f"{100 * f['rms_weights']:.1f} ({100 * f['inside_95']:.0f} %)" for f in report["contact_forces"]]
            text += (f"| {recording}, {start:g} ... {end:g} s | " + " | ".join(figures) +
                     f" | {100 * report['unexplained_mean']:.1f} % | {report['newton_steps']} |\n")
            commands += "    counterpoint " + " ".join(words) + "\n"
    return text + "\nThe map also has:\n\n    contact_forces:\n" + "".join(
        "    " + line + "\n" for line in measured.splitlines()), commands


def human_walk(options):
    plate = {"x": "{0}.fx", "y": "{0}.fy", "z": "{0}.fz"}
    feet = {side: ([f"talus_{side[0]}", f"toes_{side[0]}"], {a: c.format(side[0].upper()) for a, c in plate.items()})
            for side in ("right", "left")}
    return walk(options, "human_walk", feet, [("recording_raw.csv", 0.45, 1.98)])


def icub_walk(options):
    feet = {side: ([f"{side[0]}_sole"], {"z": f"{side[0].upper()}.fz"}) for side in ("right", "left")}
    return walk(options, "icub_walk", feet, [("recording_raw.csv", 0, 11.99), ("recording_balance_raw.csv", 0, 6)])


SECTIONS = {"cube_toss": cube_toss, "planar_square_drop": square_drop, "simple_pendulum": pendulum, "arms": ur10,
            "planar_ellipse_impacts": impacts, "cassie_impact": cassie,
            "human_walk": human_walk, "icub_walk": icub_walk}


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
        found, commands = section(options)
        new = f"\n{commands}\n{found}\n"
        text, old = marked.replaced(text, name, new)
        stale |= old != new
        print(f"{name}: {'differs' if old != new else 'as it is'}")
    if not options.check:
        DOCUMENT.write_text(text)
    return 1 if options.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
