#!/usr/bin/env python3
"""Writes the results of problems that others published into docs/measurements/published.md.

    scripts/measurements/published_doc.py [--command build/release/bin/counterpoint] [--peers]

--peers: MuJoCo's results beside ours, if the command was built with it.
"""
import argparse
import json
import pathlib
import subprocess

import marked

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/measurements/published.md"

# Processor time [s] that others report for the whole problem: OpenSim 3.2, Intel Core i5-4570
# (github.com/RehabEngGroup/MBSbenchmarksInOpenSim, help/benchmarks; A03 is 50 ms there).
OPENSIM = {"iftomm_a01": 0.637, "iftomm_a02": 0.455, "iftomm_a03": 0.384, "iftomm_a04": 0.258, "iftomm_a05": 0.233}

# Errors at 1 ms without error reduction (ERP), rolling with 1000 iterations: github.com/leggedrobotics/SimBenchmark,
# data/*/sample.csv. MuJoCo: the best of its solvers and integrators there; it has no elastic impacts.
OTHERS = ("RaiSim", "ODE", "Bullet", "DART", "MuJoCo 1.5")
REPORTED = {"simbenchmark_rolling": (4.08935e-07, 3.14497, 3.85251e-27, None, 0.00209911),
            "simbenchmark_bouncing": (0.0186204, 185.027, 75245.4, 72274.4, None),
            "simbenchmark_666": (0.00013534, 0.000154633, 0.38247, 0.000282356, 0.0950087),
            "simbenchmark_elastic_666": (8.36835, 112.318, 41498.1, 346280, None)}


def number(x, digits=3):
    return "-" if x is None else f"{x:.{digits}g}"


def run(options):
    names = [*OPENSIM, "iftomm_a02_40", *REPORTED]
    words = [options.command, "hard-cases", "--threads", "1", "--json", "-"]
    for name in sorted(names):
        words += ["--only", name]
    done = subprocess.run(words + ([] if options.peers else ["--no-peers"]), capture_output=True, text=True, cwd=ROOT)
    return json.loads(done.stdout)["cases"]


def peer_cells(case, index):
    return "".join(f" {number(peer['checks'][index]['measured']) if peer['checks'] else 'not run'} |"
                   for peer in case.get("peers", []))


def peer_names(cases):
    return "".join(f" {peer['name']} {peer['version']} |" for peer in cases[0].get("peers", []))


def iftomm(cases):
    peers = peer_names(cases)
    text = f"| problem | error | unit | Counterpoint | bound |{peers} steps | wall s | OpenSim 3.2 s |\n"
    text += "|---|---|---|---|---|" + "---|" * peers.count("|") + "---|---|---|\n"
    for case in cases:
        if not case["name"].startswith("iftomm"):
            continue
        for i, check in enumerate(case["checks"]):
            first = i == 0
            text += (f"| {case['name'] if first else ''} | {check['quantity']} | {check['unit']} "
                     f"| {number(check['measured'])} | {number(check['upper'])} |{peer_cells(case, i)} "
                     f"{case['steps'] if first else ''} | {number(case['wall_seconds'], 2) if first else ''} "
                     f"| {number(OPENSIM.get(case['name'])) if first else ''} |\n")
    return text


def simbenchmark(cases):
    peers = peer_names(cases)
    text = f"| problem | error | Counterpoint |{peers} " + " | ".join(OTHERS) + " | wall s |\n"
    text += "|---|---|---|" + "---|" * (peers.count("|") + len(OTHERS)) + "---|\n"
    for case in cases:
        if case["name"] not in REPORTED:
            continue
        check = case["checks"][0]
        text += (f"| {case['name']} | {check['quantity']} [{check['unit']}] | {number(check['measured'])} "
                 f"|{peer_cells(case, 0)} " + " | ".join(number(x) for x in REPORTED[case["name"]])
                 + f" | {number(case['wall_seconds'], 2)} |\n")
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--command", default="build/release/bin/counterpoint")
    parser.add_argument("--peers", action="store_true")
    cases = run(parser.parse_args())
    marked.write(DOCUMENT, "iftomm", iftomm(cases))
    marked.write(DOCUMENT, "simbenchmark", simbenchmark(cases))


if __name__ == "__main__":
    main()
