#!/usr/bin/env python3
"""skipped_tests.py LOG: lists the tests that ctest's log (Testing/Temporary/LastTest.log) reports as skipped, by
reason."""

import collections
import re
import sys


def reason(output):
    """The message of GTEST_SKIP, or the last line that the test wrote."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    for place, line in enumerate(lines):
        if re.search(r": Skipped$", line) and place + 1 < len(lines):
            return lines[place + 1]
    return next((line for line in reversed(lines) if not line.startswith(("<end", "[", "Test time"))), "no reason given")


def main():
    text = open(sys.argv[1], encoding="utf-8", errors="replace").read()
    skipped = collections.defaultdict(list)
    for block in re.split(r"^(?=\d+/\d+ Testing: )", text, flags=re.M):
        name = re.search(r"Testing: (\S+)", block)
        if name is None or not re.search(r"^Test Skipped|^\[  SKIPPED \]|return code 77", block, flags=re.M):
            continue
        output = block.split("Output:", 1)[-1].split("<end of output>")[0]
        skipped[reason(output)].append(name.group(1))
    if not skipped:
        print("No test was skipped.")
        return
    print("Skipped:")
    for why, names in sorted(skipped.items()):
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        print(f"  {why}\n    {', '.join(names[:3])}{more}")


if __name__ == "__main__":
    main()
