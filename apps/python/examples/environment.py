"""An environment with the reset() and step() of gymnasium, without depending on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import counterpoint as cp
from scenes import scene_file

Observation = NDArray[np.float64]


class Pendulum:
    """Swing a pendulum up with a weak motor.

    Observations are (cos, sin, rate) [-, -, rad/s]; an action is a torque in [-1, 1] times `limit`.
    """

    def __init__(self, limit: float = 2.0, frame_skip: int = 10, max_steps: int = 200) -> None:
        self.scene = cp.load_scene(scene_file("pendulum"))
        self.sim = cp.Simulator(self.scene)
        self.limit, self.frame_skip, self.max_steps = limit, frame_skip, max_steps
        self.steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        rng = np.random.default_rng(seed)
        self.sim.state = cp.State(self.sim.model, q=rng.uniform(-0.1, 0.1, 1))
        self.steps = 0
        return self._observe(), {}

    def step(self, action: float) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        self.sim.input.applied_force[0] = self.limit * float(np.clip(action, -1.0, 1.0))
        report = self.sim.advance(self.frame_skip, check=False)
        self.steps += 1
        height = -float(np.cos(self.sim.q[0]))
        reward = height - 1e-3 * action**2
        return self._observe(), reward, not report.succeeded, self.steps >= self.max_steps, {"report": report}

    def _observe(self) -> Observation:
        angle, rate = self.sim.q[0], self.sim.v[0]
        return np.array([np.cos(angle), np.sin(angle), rate])


if __name__ == "__main__":
    env = Pendulum()
    observation, _ = env.reset(seed=0)
    total, done = 0.0, False
    while not done:
        # Pump energy: push in the direction of motion.
        observation, reward, failed, timeout, _ = env.step(float(np.sign(observation[2])))
        total += reward
        done = failed or timeout
    print(f"{env.steps} steps, return {total:.1f}, energy "
          f"{cp.kinetic_energy(env.sim.model, env.sim.q, env.sim.v):.2f} J")
