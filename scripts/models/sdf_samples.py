#!/usr/bin/env python3
"""Loads and simulates SDF files, and writes the outcomes to docs/measurements/sdf.md.

    scripts/models/sdf_samples.py COUNTERPOINT NAME=FOLDER... [--output FILE]

FOLDER: checked out Gazebo models or worlds; NAME: its name in the table. Files such as model-1_4.sdf, older versions of
the same model.sdf, are left out.
"""
import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SECONDS = 2.0  # simulated time [s]
LIMIT = 60.0  # largest wall time of a run [s]


def run(command, file, folder):
    """Returns (outcome, detail); outcomes: simulated, failed, refused, slow, crash."""
    with tempfile.TemporaryDirectory() as scratch:
        report = pathlib.Path(scratch) / "r.json"
        arguments = [command, "simulate", str(file), "--duration", str(SECONDS), "--json", str(report)]
        try:
            done = subprocess.run(arguments, capture_output=True, text=True, timeout=LIMIT)
        except subprocess.TimeoutExpired:
            return "slow", f"not done in {LIMIT:.0f} s"
        if done.returncode < 0 or done.returncode > 100:
            return "crash", f"exit {done.returncode}"
        text = (done.stderr.strip() or done.stdout.strip()).replace(str(folder) + "/", "")
        if not report.exists() or done.returncode != 0:
            return ("refused" if not report.exists() or "simulat" not in text else "failed"), text.splitlines()[0]
        return "simulated", json.loads(report.read_text())


def reason(text):
    """Reason of a refusal, without names and line numbers."""
    text = re.sub(r"^error: ", "", text)
    text = re.sub(r"^[^ ]*:(\d+:)? ", "", text)
    text = re.sub(r"'[^']*'", "'...'", text)
    text = re.sub(r"= [-+.0-9e]+", "= ...", text)
    return text[:110]


def main():
    output = pathlib.Path("docs/measurements/sdf.md")
    arguments = sys.argv[1:]
    if "--output" in arguments:
        at = arguments.index("--output")
        output = pathlib.Path(arguments[at + 1])
        del arguments[at:at + 2]
    command, folders = arguments[0], [a.split("=", 1) for a in arguments[1:]]
    lines, total = [], collections.Counter()
    for name, folder in folders:
        counts, reasons = collections.Counter(), collections.Counter()
        files = sorted(f for f in pathlib.Path(folder).rglob("*") if f.suffix in (".sdf", ".world")
                       and not f.name.startswith("model-"))
        for file in files:
            outcome, detail = run(command, file, folder)
            counts[outcome] += 1
            if outcome != "simulated":
                reasons[outcome, reason(detail)] += 1
            print(name, file.relative_to(folder), outcome, detail if outcome != "simulated" else "", flush=True)
        total.update(counts)
        lines.append(f"\n## {name}\n\n{len(files)} files: " +
                     ", ".join(f"{n} {o}" for o, n in counts.most_common()) + ".\n")
        lines.append("\n| files | | why |\n|---|---|---|\n" if reasons else "")
        lines += [f"| {n} | {o} | {r.replace('|', '/').replace('<', chr(92) + '<')} |\n"
                  for (o, r), n in reasons.most_common()]
    head = f"""# Public SDF files

Written by scripts/models/sdf_samples.py. Every file is loaded and simulated for {SECONDS:g} s without inputs: plugins do not
run, so that what they drive stays limp. simulated: without a failed step. refused: by file, line and element, of which
the table leaves out names and lines. What is read is told in [SDF](../reference/sdf.md).

{sum(total.values())} files: """ + ", ".join(f"{n} {o}" for o, n in total.most_common()) + ".\n"
    output.write_text(head + "".join(lines))


if __name__ == "__main__":
    main()
