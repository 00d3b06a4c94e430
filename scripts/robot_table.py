#!/usr/bin/env python3
"""Simulates every URDF below a folder for 2 s, floating on the ground and fixed in the air, and prints a Markdown table.

    scripts/robot_table.py build/release/bin/counterpoint FOLDER [extra options of simulate]

Standard library only.
"""
import json
import pathlib
import subprocess
import sys
import tempfile


def run(command, urdf, base, options):
    """(cell of the table, message of a refusal or failure)"""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        arguments = [command, "simulate", str(urdf), "--base", base, "--duration", "2",
                     "--json", str(report), *options]
        if base == "floating":
            arguments.append("--ground")
        try:
            done = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
        except subprocess.TimeoutExpired:
            return "over 300 s", ""
        last = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else ""
        if done.returncode == 0:
            figures = json.loads(report.read_text())
            return (f"{figures['contacts_mean']:.3g} contacts, {figures['newton_iterations_mean']:.3g} Newton, "
                    f"{figures['realtime_factor']:.3g}x", "")
        return {1: "**failed**", 2: "refused"}.get(done.returncode, f"exit {done.returncode}"), last


def main():
    command, folder, *options = sys.argv[1:]
    folder = pathlib.Path(folder)
    print("| robot | floating, on the ground | fixed, no ground | message |\n|---|---|---|---|")
    for urdf in sorted(folder.rglob("*.urdf")):
        floating, message = run(command, urdf, "floating", options)
        fixed, message_fixed = run(command, urdf, "fixed", options)
        message = (message or message_fixed).replace(str(folder) + "/", "").replace("|", "\\|")
        print(f"| {urdf.relative_to(folder).parts[0]} | {floating} | {fixed} | {message} |", flush=True)


if __name__ == "__main__":
    main()
