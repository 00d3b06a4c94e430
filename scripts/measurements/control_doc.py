#!/usr/bin/env python3
"""control_doc.py [COMMAND]: measures `counterpoint control` and writes the table of docs/measurements/control.md.

COMMAND: the program, default build/release/bin/counterpoint. Takes about eight minutes."""
import json
import pathlib
import subprocess
import sys
import tempfile

from marked import replaced

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/measurements/control.md"
RUNS = 6
# Description, problem, options.
SERVOS = ["--world", str(ROOT / "data/scenes/control/scenes/quadruped_servos.yaml")]
WRONG = ["--mass-factor", "1.1", "--friction-factor", "0.9", "--position-noise", "0.001", "--delay", "0.005"]


def pushed(link, force):
    return ["--push-link", link, "--push", f"{force},1"]


CASES = [
    ("spinner turned by more than 1 rad/s, 6 s", "spinner", []),
    ("the same, another world", "spinner", WRONG),
    ("box pushed 0.3 m over a rough floor, within 5 mm", "push_box", []),
    ("box pushed 0.2 m and turned by 0.5 rad, within 2 cm and 3 degrees", "turn_box", []),
    ("box tipped over its edge", "tip_box", []),
    ("quadruped gets up from its belly", "quadruped_up", []),
    ("the same, another world", "quadruped_up", WRONG),
    ("quadruped walks, 0.4 m/s within 5 %, 20 s", "quadruped_walk", []),
    ("the same, another world", "quadruped_walk", WRONG),
    ("the same, trunk pushed by 200 N sideways", "quadruped_walk", pushed("trunk", "0,200,0")),
    ("the same, with servos", "quadruped_walk", SERVOS),
    ("quadruped walks three quarters of a circle", "quadruped_turn", []),
    ("quadruped climbs a step of 10 cm", "quadruped_step", []),
    ("the same, another world", "quadruped_step", WRONG),
    ("quadruped stands, trunk pushed by 200 N sideways", "quadruped_stand", []),
    ("300 N sideways", "quadruped_stand", pushed("trunk", "0,300,0")),
    ("300 N forward", "quadruped_stand", pushed("trunk", "300,0,0")),
    ("300 N back", "quadruped_stand", pushed("trunk", "-300,0,0")),
    ("200 N sideways, another world", "quadruped_stand", WRONG),
    ("humanoid walks, 0.4 m/s within 5 %, 20 s", "humanoid_walk", []),
    ("the same, pelvis pushed by 150 N sideways", "humanoid_walk", pushed("pelvis", "0,150,0")),
    ("the same, another world", "humanoid_walk", WRONG),
    ("humanoid walks over unknown ground, 2 cm up and down, 10 s", "humanoid_uneven", []),
    ("humanoid stands, pelvis pushed by 100 N forward", "humanoid_stand", pushed("pelvis", "100,0,0")),
    ("200 N forward", "humanoid_stand", []),
    ("300 N forward", "humanoid_stand", pushed("pelvis", "300,0,0")),
    ("200 N to the left", "humanoid_stand", pushed("pelvis", "0,200,0")),
    ("200 N back", "humanoid_stand", pushed("pelvis", "-200,0,0")),
    ("200 N forward, another world", "humanoid_stand", WRONG),
]


def measured(command, problem, options, folder):
    report = pathlib.Path(folder) / "control.json"
    words = [command, "control", str(ROOT / f"data/scenes/control/{problem}.yaml"), "--runs", str(RUNS)]
    subprocess.run([*words, "--json", str(report), *options], stdout=subprocess.DEVNULL, check=False)
    return json.loads(report.read_text(encoding="utf-8"))


def row(name, report):
    def median(key):
        return sorted(run[key] for run in report["runs"])[RUNS // 2]

    return (f"| {name} | {report['succeeded_runs']}/{RUNS} | {median('planner_share'):.3f} | "
            f"{median('replan_ms_median'):.2f} | {median('replan_ms_p99'):.2f} | {median('violation_mean'):.1e} |\n")


def main():
    command = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/release/bin/counterpoint")
    table = "| task | succeeds | planner's share | replan, median [ms] | 99 % [ms] | violation |\n|---|---|---|---|---|---|\n"
    with tempfile.TemporaryDirectory() as folder:
        for name, problem, options in CASES:
            table += row(name, measured(command, problem, options, folder))
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), "control", table)[0], encoding="utf-8")


if __name__ == "__main__":
    main()
