#!/usr/bin/env python3
"""Writes data/robots/*.urdf, the generated scenes of data/scenes and their meshes and heights. Standard library only.

Inertias follow from the mass and the uniform density of each link's primitive shape, so the files are
physical by construction. Usage: scripts/make_data.py [--check]   (--check: compare, write nothing)
"""
import pathlib
import sys

sys.dont_write_bytecode = True  # tests run this script in the source tree
from pile_scenes import bundled_pile_files  # noqa: E402
from scenes.box_scenes import SCENES, box_scene, ellipse, hollow  # noqa: E402
from scenes.hard_scenes import hard_files  # noqa: E402
from scenes.hollow_scenes import hollow_files  # noqa: E402
from scenes.mechanism_scenes import mechanism_files  # noqa: E402
from scenes.motions import turning_jump, turning_jump_bvh  # noqa: E402
from scenes.published_scenes import published_files  # noqa: E402
from scenes.robots import ROBOTS, toss_cube  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent / "data"


def main():
    files = {f"robots/{robot.name}.urdf": robot.text() for robot in ROBOTS}
    files["robots/toss_cube.urdf"] = toss_cube()
    for kind, n, about in SCENES:
        name = "box_stack" if (kind, n) == ("stack", 10) else f"{kind}_{n}"
        files[f"scenes/{name}.yaml"] = box_scene(kind, n, about)
    files["scenes/hollow.csv"] = hollow()
    files["robots/ellipse.obj"] = ellipse()
    files["scenes/retarget/turning_jump.csv"] = turning_jump(files["robots/humanoid.urdf"])
    files["scenes/retarget/jump_bvh.bvh"] = turning_jump_bvh(files["robots/humanoid.urdf"])
    files.update(hard_files())
    files.update(hollow_files())
    files.update(mechanism_files())
    files.update(published_files())
    files.update(bundled_pile_files())
    stale = 0
    for name, text in files.items():
        path = ROOT / name
        if "--check" in sys.argv[1:]:
            if not path.exists() or path.read_text() != text:
                print(f"{path} differs from what scripts/make_data.py writes")
                stale += 1
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    for robot in ROBOTS:
        print(f"{robot.name}: {robot.mass:.3f} kg")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
