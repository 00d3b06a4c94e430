"""Find the friction of a cube from a recorded toss."""

from __future__ import annotations

from pathlib import Path

import counterpoint as cp
from compare import column_map, record
from scenes import scene_file

scene = cp.load_scene(scene_file("cube_toss"))
record(cp.recordings.with_settings(scene, "friction=0.3"), Path("toss.csv"))
columns = column_map(scene, Path("toss.yaml"))
recorded = cp.recordings.read_recordings(["toss.csv"], columns, scene)

found = cp.recordings.identify(scene, columns, recorded, "friction=0.05..0.6", samples=16, refined=1)
for parameter in found.parameters:
    print(f"{parameter.name}: {parameter.value:.4g} (made with 0.3, the scene has {parameter.scene:.4g})")
print(f"cost {found.start_cost:.3g} -> {found.cost:.3g} in {found.evaluations} evaluations")
