#!/usr/bin/env python3
"""Times single steps with and without a budget of Newton steps: the table of docs/measurements/bounded-steps.md.

    scripts/measurements/bounded_steps_doc.py [SCENE ...]    default: the scenes of the page, which is written

Runs build/release/bin/counterpoint three times for each scene and budget and takes the medians. With scenes the table
is only printed.
"""
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import marked

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs/measurements/bounded-steps.md"
PROGRAM = ROOT / "build/release/bin/counterpoint"
SCENES = ["piles/pile_200", "piles/dominoes_50", "piles/brick_wall", "piles/pile_64_masses", "piles/chain_into_pile",
          "humanoid_drop"]
BUDGETS, ROUNDS, DURATION = (0, 40, 16, 8), 3, 3
HEADER = ("| scene | budget | mean [ms] | largest [ms] | largest / mean | Newton steps: mean (largest) | unfinished "
          "[%] | residual | penetration [mm] | energy gained [J] |\n|---|---|---|---|---|---|---|---|---|---|\n")


def run(scene, budget):
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "run.json"
        subprocess.run([PROGRAM, "simulate", scene, "--step-budget", str(budget), "--duration", str(DURATION), "--json",
                        report], check=True, stdout=subprocess.DEVNULL)
        return json.loads(report.read_text())


def row(scene, budget):
    runs = [run(scene, budget) for _ in range(ROUNDS)]
    last = runs[-1]
    mean = statistics.median(r["wall_seconds"] / r["steps"] for r in runs) * 1e3
    largest = statistics.median(r["step_time_max_us"] for r in runs) * 1e-3
    gain = last["energy_gain_max_J"]
    return (f"| {scene.stem} | {budget or 'none'} | {mean:.3g} | {largest:.3g} | {largest / mean:.3g} "
            f"| {last['newton_iterations_mean']:.3g} ({last['newton_iterations_max']}) "
            f"| {100 * last['unfinished_steps'] / last['steps']:.3g} | {last['unfinished_residual_max']:.2g} "
            f"| {1e3 * last['max_penetration_m']:.2g} | {'-' if gain is None else f'{gain:.2g}'} |\n")


def main():
    scenes = [pathlib.Path(name) for name in sys.argv[1:]]
    own = scenes or [ROOT / f"data/scenes/{name}.yaml" for name in SCENES]
    table = HEADER + "".join(row(scene, budget) for scene in own for budget in BUDGETS)
    if scenes:
        print(table)
    else:
        marked.write(PAGE, "table", table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
