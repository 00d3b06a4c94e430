#!/usr/bin/env python3
"""help_test.py COMMAND: the help of every command fits one screen; for a mistyped name the nearest name is
suggested."""

import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

LINES, COLUMNS = 50, 100  # size of a terminal that fills a laptop's screen


def run(*words):
    done = subprocess.run([sys.argv[1], *words], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


def expect(holds, message):
    if not holds:
        sys.exit(message)


def scene_of_the_topic_runs():
    """Runs the sample that `help scenes` prints, with its indentation removed."""
    _, text, _ = run("help", "scenes")
    sample = re.search(r"scene file:\n((?:  .*\n)+)", text)
    expect(sample, f"no sample in help scenes: {text}")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "scene.yaml"
        file.write_text(textwrap.dedent(sample.group(1)))
        code, _, errors = run("simulate", str(file), "--duration", "0.1")
        expect(code == 0, f"the sample of help scenes fails: {errors}")


def main():
    code, text, _ = run("--help")
    expect(code == 0, "--help fails")
    names = re.findall(r"^  ([a-z][a-z-]*)  ", text.split("Topics")[0], flags=re.M)
    expect(len(names) >= 14, f"only {names} are listed")
    for words in [["--help"]] + [[name, "--help"] for name in names]:
        code, text, _ = run(*words)
        lines = text.split("\n")
        expect(code == 0 and len(lines) <= LINES, f"{words}: exit code {code}, {len(lines)} lines")
        for line in lines:
            # Only examples and single long words may exceed the width.
            expect(len(line) <= COLUMNS or "counterpoint " in line or " " not in line.strip(), f"{words}: {len(line)} columns: {line}")
    for words, near in ((["simulatee"], "'simulate'"), (["simulate", "arm7", "--durration", "1"], "'--duration'"),
                        (["simulate", "humanod_drop"], "'humanoid_drop'"), (["help", "colums"], "'columns'"),
                        (["simulate", "arm7", "--integrator", "midpoint"], "implicit_midpoint")):
        code, _, errors = run(*words)
        expect(code == 2 and errors.startswith("error: ") and near in errors, f"{words}: {code}, {errors}")
    scene_of_the_topic_runs()
    for topic in ("scenes", "columns", "integrators", "exit-codes", "simulate"):
        expect(run("help", topic)[0] == 0, f"help {topic} fails")
    code, text, _ = run("--version")
    expect(code == 0 and all(word in text for word in ("build:", "MuJoCo:", "runs on:")), text)
    _, text, errors = run("list", "scenes")
    expect("\033" not in text + errors and "humanoid_drop" in text, "colours, or no scenes")


if __name__ == "__main__":
    main()
