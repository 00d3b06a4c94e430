"""Paths of the scenes for the examples, in the repository or the installed data. Run as a program, it lists them."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def data_folder() -> Path:
    """Return the data folder: COUNTERPOINT_DATA, the repository's, or <prefix>/share/counterpoint."""
    here = Path(__file__).resolve()
    candidates = [here.parents[3] / "data", Path(sys.prefix) / "share" / "counterpoint"]
    given = os.environ.get("COUNTERPOINT_DATA")
    if given:
        candidates.insert(0, Path(given))
    for folder in candidates:
        if (folder / "scenes").is_dir():
            return folder
    raise SystemExit(f"no data/scenes in {', '.join(map(str, candidates))}: set COUNTERPOINT_DATA")


def scene_file(name: str) -> Path:
    return data_folder() / "scenes" / f"{name}.yaml"


if __name__ == "__main__":
    for file in sorted((data_folder() / "scenes").glob("*.yaml")):
        print(file.stem)
