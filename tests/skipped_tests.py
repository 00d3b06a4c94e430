#!/usr/bin/env python3
"""skipped_tests.py LOG: counts the GoogleTest tests that passed in ctest's log (Testing/Temporary/LastTest.log), and
lists the skipped ones by reason."""

import collections
import re
import sys


def skips(name, output):
    """Yields (test, reason) of every skipped test: those of GoogleTest in a suite, or the whole ctest test."""
    found = re.findall(r": Skipped\n+(.*?)\n+\[  SKIPPED \] (\S+)", output)
    yield from ((test, reason) for reason, test in found)
    if not found and re.search(r"^Test Skipped|return code 77", output, flags=re.M):
        lines = [line.strip() for line in output.split("<end of output>")[0].splitlines() if line.strip()]
        yield name, lines[-1] if lines else "no reason given"


def main():
    text = open(sys.argv[1], encoding="utf-8", errors="replace").read()
    print(sum(map(int, re.findall(r"^\[  PASSED  \] (\d+) test", text, flags=re.M))), "tests of C++ suites passed.")
    skipped = collections.defaultdict(list)
    for block in re.split(r"^(?=\d+/\d+ Testing: )", text, flags=re.M):
        name = re.search(r"Testing: (\S+)", block)
        if name is None:
            continue
        for test, reason in skips(name.group(1), block.split("Output:", 1)[-1]):
            skipped[reason].append(test)
    if not skipped:
        print("No test was skipped.")
        return
    print("Skipped:")
    for why, names in sorted(skipped.items()):
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        print(f"  {why}\n    {', '.join(names[:3])}{more}")


if __name__ == "__main__":
    main()
