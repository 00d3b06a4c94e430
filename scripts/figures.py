#!/usr/bin/env python3
"""Prints the figures that tests record: scripts/figures.py build/release/bin/collision_test [FILTER]

One line per test and property; for parametrized tests the largest value over all parameters."""
import json
import pathlib
import subprocess
import sys
import tempfile

KNOWN = {"name", "file", "line", "status", "result", "timestamp", "time", "classname", "value_param",
         "type_param", "failures", "skipped"}


def larger(a, b):
    """The larger of two numbers given as texts; a text that is no number, such as "nan", is the larger."""
    try:
        return a if not float(a) <= float(b) and float(b) == float(b) else b
    except ValueError:
        return a


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        run = subprocess.run([sys.argv[1], f"--gtest_output=json:{report}", "--gtest_brief=1",
                              "--gtest_filter=" + (sys.argv[2] if len(sys.argv) > 2 else "*")],
                             stdout=subprocess.DEVNULL)
        suites = json.loads(report.read_text())["testsuites"]
    most, count = {}, {}
    for suite in suites:
        for test in suite["testsuite"]:
            name = suite["name"].split("/")[-1] + "." + test["name"].split("/")[0]
            for key, value in test.items():
                if key in KNOWN:
                    continue
                at = (name, key)
                count[at] = count.get(at, 0) + 1
                most[at] = larger(value, most.get(at, value))
    for (name, key), value in most.items():
        print(f"{name}: {key} {value}" + (f" (of {count[name, key]})" if count[name, key] > 1 else ""))
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
