#!/usr/bin/env python3
"""run_page.py PAGE.md COMMAND: runs the shell blocks of a page as a reader would, in order, in a temporary folder.

A block is ```sh ... ```; `counterpoint` in it is COMMAND. Files that the page shows first (```yaml file.yaml) are
written there. A failing block ends the run with its output and exit code 1. If COMMAND was built without the replay
page (no npm registry), replays are left out with a message."""

import pathlib
import re
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"^```(\w+)(?: ([\w./-]+))?\n(.*?)^```", re.M | re.S)
PAGE_SECONDS = 600  # a reader should be able to wait for a page


def without_replays(text):
    lines = [line for line in text.splitlines() if not line.startswith("counterpoint view ")]
    return re.sub(r" --view \S+", "", "\n".join(lines))


def main():
    page, command = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    version = subprocess.run([command, "--version"], capture_output=True, text=True, check=True).stdout
    no_replays = re.search(r"^replay pages: (no .*)$", version, re.M)
    if no_replays:
        print(f"without replays: {no_replays[1]}")
    ran = 0
    with tempfile.TemporaryDirectory() as folder:
        for language, file, text in blocks:
            if file:
                (pathlib.Path(folder) / file).write_text(text, encoding="utf-8")
            elif language == "sh":
                if no_replays:
                    text = without_replays(text)
                script = f'counterpoint() {{ "{command}" "$@"; }}\nset -e\n{text}'
                done = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True,
                                      timeout=PAGE_SECONDS)
                if done.returncode != 0:
                    print(f"{page}: exit code {done.returncode} of\n{text}\n{done.stdout}{done.stderr}")
                    sys.exit(1)
                ran += 1
    if ran == 0:
        sys.exit(f"{page}: no ```sh block to run")
    print(f"{page}: {ran} blocks ran")


if __name__ == "__main__":
    main()
