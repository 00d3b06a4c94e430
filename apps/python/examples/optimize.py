"""Optimize motions: a double pendulum swings up with its elbow motor alone; a pendulum is lifted with least effort."""

from __future__ import annotations

import counterpoint as cp
from scenes import data_folder, scene_file

optimization = cp.optimization

# A problem from a file, which defines scene, start, goal and terms.
problem = optimization.load_problem(data_folder() / "scenes" / "optimize" / "acrobot.yaml")


def progress(step: optimization.Progress) -> None:
    if step.iteration % 50 == 1:
        print(f"  step {step.iteration}: cost {step.cost:.4g}, unactuated {step.unactuated[0]:.1e}")


result = optimization.optimize(problem, progress=progress)
print(result)
found = optimization.verify(result)
print(f"steps done forward land within {found.forward_check_max:.1e} rad of the motion")
result.trajectory.write("swing.csv")

# A problem without a file: least effort from hanging to rest at 90 degrees in one second.
pendulum = cp.load_scene(scene_file("pendulum"))
pendulum.options.time_step = 0.02
lift = optimization.Problem(pendulum, 50, start_q=[0.0], goal_q=[1.5707963267948966])
lift.add_term("applied_force", weight=1.0)
motion = optimization.optimize(lift)
torques = sorted(float(u) for u in motion.applied_force[:, 0])
print(f"{motion.outcome}: torques from {torques[0]:.3g} to {torques[-1]:.3g} N m")
