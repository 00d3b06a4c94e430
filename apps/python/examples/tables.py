"""Motions as tables and pictures: pandas and matplotlib."""

from __future__ import annotations

import importlib.util
import sys

import counterpoint as cp
from scenes import scene_file

missing = [name for name in ("pandas", "matplotlib") if importlib.util.find_spec(name) is None]
if missing:
    print(f"SKIPPED: {' and '.join(missing)} not installed")
    sys.exit(77)

import matplotlib  # noqa: E402
import pandas  # noqa: E402

matplotlib.use("Agg")

motion = cp.Simulator(cp.load_scene(scene_file("cube_drop"))).run(1.0)
table = pandas.DataFrame(motion.to_dict()).set_index("time")
print(table[["cube.z", "cube.vz"]].describe())
table[["cube.x", "cube.y", "cube.z"]].plot().figure.savefig("cube.png")
