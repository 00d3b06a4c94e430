#!/usr/bin/env python3
"""accuracy_mujoco_doc.py COUNTERPOINT: runs a command that was built with MuJoCo on scenes without contacts and writes
the table of docs/measurements/accuracy-mujoco.md."""
import datetime
import json
import pathlib
import subprocess
import sys

import marked
from accuracy_doc import ROOT, SCENES, seconds

SCENE_NAMES = ("double_pendulum", "dzhanibekov")
ERRORS = (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10)


def report_of(name):
    done = subprocess.run([sys.argv[1], "accuracy", str(SCENES / f"{name}.yaml"), "--vary", "integrator,adaptive,mujoco",
                           "--pieces", "5", "--repeats", "5", "--json", "-"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def cells(report, error):
    """Returns the cheapest settings of both engines within an error, and the ratio of their times."""
    near = [c for c in report["comparisons"] if abs(c["error"] / error - 1) < 1e-6]
    sides = [near[0].get(side) if near else None for side in ("ours", "other")]
    said = [f"{s['setting']}: {seconds(s['cost_s_per_s'])}" if s else "none" for s in sides]
    ratio = f"{sides[0]['cost_s_per_s'] / sides[1]['cost_s_per_s']:.2g}" if all(sides) else ""
    return f" {said[0]} | {said[1]} | {ratio} |"


reports = {name: report_of(name) for name in SCENE_NAMES}
version = next(f["name"].split()[1] for f in reports[SCENE_NAMES[0]]["families"] if f.get("other_engine"))
lines = [f"MuJoCo {version}, {datetime.date.today().isoformat()}:", "",
         "| error |" + "".join(f" {name}: ours | MuJoCo | ratio |" for name in SCENE_NAMES),
         "|---|" + "---|" * 3 * len(SCENE_NAMES)]
lines += [f"| {error:.0e} |" + "".join(cells(r, error) for r in reports.values()) for error in ERRORS]
marked.write(ROOT / "docs/measurements/accuracy-mujoco.md", "without contacts", "\n".join(lines) + "\n")
