"""Recover the forces that moved a robot from its motion alone."""

from __future__ import annotations

import numpy as np

import counterpoint as cp
from scenes import scene_file

scene = cp.load_scene(scene_file("humanoid_drop"))
model = scene.model
rng = np.random.default_rng(1)
torques = np.zeros((300, model.nv))
torques[:, 6:] = rng.uniform(-5.0, 5.0, (300, model.nv - 6))
motion = cp.Simulator(scene).run(inputs=torques)

workspace = cp.Workspace(model)
worst = scale = 0.0
ground: list[float] = []  # vertical force of the ground [N]
for k in range(motion.num_steps):
    found = cp.step_inverse(
        model, scene.options, motion.q[k], motion.v[k], motion.v[k + 1], known=motion.input(k), workspace=workspace
    )
    worst = max(worst, float(np.linalg.norm(found.applied_force - motion.applied_force[k])))
    scale = max(scale, found.force_scale)
    # Forces act on geometry B.
    ground.append(float(sum(-c.force[2] for c in found.contacts if c.geometry_b == "ground")))

print(f"torques recovered to {worst / scale:.1e} of the largest force, {scale:.3g} N or N m")
print(f"the ground pushes with up to {max(ground):.0f} N; the humanoid weighs {9.80665 * cp.total_mass(model):.0f} N")
