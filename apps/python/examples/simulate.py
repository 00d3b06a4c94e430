"""Simulate a scene, write its trajectory and a replay; then simulate many motions in parallel."""

from __future__ import annotations

import numpy as np

import counterpoint as cp
from scenes import scene_file

scene = cp.load_scene(scene_file("humanoid_drop"))
sim = cp.Simulator(scene)
motion = sim.run(1.0)
print(f"{motion.num_steps} steps; the pelvis ends at z = {sim.q[2]:.3f} m")
motion.write("fall.csv")

# One self-contained HTML page; in a notebook, `motion` at the end of a cell displays it.
if cp.view.can_make_pages():
    cp.view.Replay(motion, title="A fall").save("fall.html")

# Sixteen starts in parallel on all cores, each with its own random forces.
rng = np.random.default_rng(0)
starts = np.tile(np.concatenate([scene.q, scene.v]), (16, 1))
starts[:, 2] += rng.uniform(0.0, 0.3, 16)
forces = np.zeros((16, 200, scene.model.nv))
forces[:, :, 6:] = rng.uniform(-1.0, 1.0, (16, 1, scene.model.nv - 6))
result = cp.rollout(scene, starts, forces)
heights = sorted(result.q[:, -1, 2])
print(result, f"pelvis at z = {heights[0]:.3f} ... {heights[-1]:.3f} m")
