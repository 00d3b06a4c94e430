"""Measure the cost of accuracy: the error of a double pendulum over the computing time of its steps."""

from __future__ import annotations

import time
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import counterpoint as cp
from scenes import scene_file

DURATION = 1.0  # [s]
Integrator = Literal["semi_implicit_euler", "implicit_midpoint", "runge_kutta_4"]
INTEGRATORS: tuple[Integrator, ...] = ("semi_implicit_euler", "implicit_midpoint", "runge_kutta_4")


def end_of(integrator: Integrator, time_step: float) -> tuple[NDArray[np.float64], float]:
    scene = cp.load_scene(scene_file("double_pendulum"))
    scene.options.time_step = time_step
    scene.options.integrator = integrator
    scene.options.switch_effect("effort_limits", False)  # no motor drives it; runge_kutta_4 accepts smooth effects only
    sim = cp.Simulator(scene)
    start = time.perf_counter()
    sim.advance(round(DURATION / time_step))
    return sim.q.copy(), time.perf_counter() - start


reference, _ = end_of("runge_kutta_4", 1e-5)
print(f"{'integrator':<22}{'step [s]':>10}{'error [rad]':>14}{'time [ms]':>12}")
for integrator in INTEGRATORS:
    for time_step in (1e-2, 1e-3, 1e-4):
        q, seconds = end_of(integrator, time_step)
        print(f"{integrator:<22}{time_step:>10g}{np.linalg.norm(q - reference):>14.2e}{1e3 * seconds:>12.2f}")
