"""Compare simulations of different friction with a recording, which is simulated here first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import counterpoint as cp
from scenes import scene_file


def record(scene: cp.Scene, file: Path, every: int = 5) -> None:
    """Write a motion as a table of q and v, like one from motion capture."""
    motion = cp.Simulator(scene).run(0.5)
    names = ["time", *scene.model.coordinates.q, *scene.model.coordinates.v]
    table = np.column_stack([motion.time, motion.q, motion.v])[::every]
    np.savetxt(file, table, delimiter=",", header=",".join(names), comments="", fmt="%.17g")


def column_map(scene: cp.Scene, file: Path) -> cp.recordings.ColumnMap:
    """Map columns to coordinates: here the columns have the names used in trajectories."""
    names = [*scene.model.coordinates.q, *scene.model.coordinates.v]
    file.write_text("time: time\ncolumns:\n" + "".join(f"  {name}: {name}\n" for name in names))
    return cp.recordings.load_column_map(file, scene.model)


if __name__ == "__main__":
    scene = cp.load_scene(scene_file("cube_toss"))
    record(cp.recordings.with_settings(scene, "friction=0.1"), Path("toss.csv"))
    columns = column_map(scene, Path("toss.yaml"))
    recorded = cp.recordings.read_recordings(["toss.csv"], columns, scene)
    for friction in (0.05, 0.1, 0.2):
        tried = cp.recordings.with_settings(scene, f"friction={friction}")
        (prediction,) = cp.recordings.predict(tried, columns, recorded)
        figures = ", ".join(f"{name} {value:.3g}" for name, value in prediction.figures(columns).items())
        print(f"friction {friction}: {figures}")
