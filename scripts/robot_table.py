#!/usr/bin/env python3
"""Simulates every URDF below a folder for 2 s, floating on the ground and fixed in the air, and prints a Markdown table.

    scripts/robot_table.py build/release/bin/counterpoint FOLDER [extra options of simulate]
    scripts/robot_table.py build/release/bin/counterpoint FOLDER --meshes

With --meshes it prints a table of the meshes and their hulls instead. Standard library only.
"""
import json
import pathlib
import subprocess
import sys
import tempfile


def run(command, urdf, base, options):
    """Returns (cell of the table, message of a refusal or failure)."""
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


def mesh_table(command, folder):
    print("| robot | meshes | concave | farthest that a hull stands off its mesh | largest hull volume / mesh volume (closed meshes) |")
    print("|---|---|---|---|---|")
    for urdf in sorted(folder.rglob("*.urdf")):
        with tempfile.TemporaryDirectory() as temporary:
            report = pathlib.Path(temporary) / "report.json"
            done = subprocess.run([command, "inspect", str(urdf), "--json", str(report)], capture_output=True)
            if done.returncode != 0:
                continue
            meshes = [g for g in json.loads(report.read_text())["geometries"] if "hull_standoff_m" in g]
        if not meshes:
            continue
        closed = [g["volume_m3"] / g["mesh_volume_m3"] for g in meshes if g["mesh_volume_m3"] > 0]
        ratio = f"{max(closed):.2f} ({len(closed)})" if closed else "none is closed"
        print(f"| {urdf.relative_to(folder).parts[0]} | {len(meshes)} | {sum(g['concave'] for g in meshes)} "
              f"| {1000 * max(g['hull_standoff_m'] for g in meshes):.1f} mm | {ratio} |")


def main():
    command, folder, *options = sys.argv[1:]
    folder = pathlib.Path(folder)
    if "--meshes" in options:
        mesh_table(command, folder)
        return
    print("| robot | floating, on the ground | fixed, no ground | message |\n|---|---|---|---|")
    for urdf in sorted(folder.rglob("*.urdf")):
        floating, message = run(command, urdf, "floating", options)
        fixed, message_fixed = run(command, urdf, "fixed", options)
        message = (message or message_fixed).replace(str(folder) + "/", "").replace("|", "\\|")
        print(f"| {urdf.relative_to(folder).parts[0]} | {floating} | {fixed} | {message} |", flush=True)


if __name__ == "__main__":
    main()
