from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Model, Pose, Scene, SimulationOptions, Trajectory

_Path: TypeAlias = str | PathLike[str]
_Floats: TypeAlias = NDArray[np.float64]
_ByRow: TypeAlias = float | ArrayLike | Mapping[str, float]
_Quantity: TypeAlias = Literal[
    "configuration",
    "velocity",
    "joint_limits",
    "acceleration",
    "applied_force",
    "unactuated_force",
    "position",
    "orientation",
    "point_velocity",
    "clearance",
    "sliding",
    "tilt",
    "center_of_mass",
    "momentum",
    "angular_momentum",
    "contact_force",
]

@final
class Continuation:
    start: float
    end: float | None
    resume_at: float | None
    factor: float
    max_factor: float
    hard_factor: float
    compliance_per_metre: float
    margin_per_smoothing: float
    quick_recovery_above: float
    extrapolate: bool
    limits_below: float
    penalty_start: float
    penalty_end: float
    rounds: int
    multiplier_limit: float

@final
class Settings:
    threads: int
    max_iterations: int
    stage_iterations: int
    tolerance: float
    violation_tolerance: float
    continuation: Continuation
    def __init__(self) -> None: ...

@final
class Problem:
    settings: Settings
    noise: float
    def __init__(
        self,
        scene: Scene,
        steps: int,
        *,
        start_q: ArrayLike | None = None,
        start_v: ArrayLike | None = None,
        goal_q: ArrayLike | None = None,
        goal_v: ArrayLike | None = None,
        settle: bool = False,
        periodic: bool = False,
        displacement: ArrayLike = (0, 0, 0),
        mirror: tuple[str, str] | None = None,
        passive: Sequence[str] = (),
    ) -> None: ...
    def add_term(
        self,
        quantity: _Quantity,
        *,
        weight: _ByRow | None = None,
        target: _ByRow | None = None,
        link: str = "",
        point: ArrayLike = (0, 0, 0),
        orientation: Pose | ArrayLike | None = None,
        axis: ArrayLike = (0, 0, 1),
        radius: float = 0.0,
        length: float = 0.05,
        frames: tuple[int, int] = (0, -1),
        condition: bool | None = None,
        late_weight: float = 1.0,
        name: str = "",
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def model(self) -> Model: ...
    @property
    def steps(self) -> int: ...
    @property
    def time_step(self) -> float: ...
    @property
    def periodic(self) -> bool: ...
    @property
    def terms(self) -> list[str]: ...
    @property
    def motors(self) -> NDArray[np.bool_]: ...
    @property
    def guess(self) -> _Floats: ...
    def seeded_guess(self, seed: int) -> _Floats: ...

@final
class Progress:
    @property
    def iteration(self) -> int: ...
    @property
    def stage(self) -> int: ...
    @property
    def smoothing(self) -> float: ...
    @property
    def penalty(self) -> float: ...
    @property
    def cost(self) -> float: ...
    @property
    def seconds(self) -> float: ...
    @property
    def unactuated(self) -> tuple[float, float]: ...
    @property
    def violation(self) -> tuple[float, float]: ...
    @property
    def accepted(self) -> bool: ...
    @property
    def decrease(self) -> float: ...
    @property
    def step(self) -> float: ...
    @property
    def damping(self) -> float: ...
    @property
    def trials(self) -> int: ...

@final
class Result:
    @property
    def outcome(self) -> Literal["converged", "infeasible", "iterations", "stopped"]: ...
    @property
    def converged(self) -> bool: ...
    @property
    def problem(self) -> Problem: ...
    @property
    def q(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    @property
    def applied_force(self) -> _Floats: ...
    @property
    def trajectory(self) -> Trajectory: ...
    @property
    def cost(self) -> float: ...
    @property
    def cost_by_term(self) -> dict[str, float]: ...
    @property
    def unactuated(self) -> tuple[float, float]: ...
    @property
    def violation(self) -> tuple[float, float]: ...
    @property
    def smoothing(self) -> float: ...
    @property
    def options(self) -> SimulationOptions: ...
    @property
    def iterations(self) -> int: ...
    @property
    def stages(self) -> int: ...
    @property
    def refused_stages(self) -> int: ...
    @property
    def history(self) -> list[Progress]: ...
    @property
    def seconds(self) -> float: ...

@final
class Verification:
    @property
    def forward_check_max(self) -> float: ...
    @property
    def forward_failures(self) -> int: ...
    @property
    def unactuated_max(self) -> float: ...
    @property
    def unactuated_mean(self) -> float: ...
    @property
    def overlap_max(self) -> float: ...
    @property
    def cone_violation_max(self) -> float: ...
    @property
    def stance_slip_max(self) -> float: ...
    @property
    def landing_slip_max(self) -> float: ...
    @property
    def effort_max(self) -> float: ...
    @property
    def contact_force_max(self) -> float: ...

@final
class FeedbackSettings:
    position_weight: float
    velocity_weight: float
    effort_weight: float
    smoothing: float
    cycles: int
    def __init__(self) -> None: ...

@final
class Feedback:
    @property
    def gains(self) -> _Floats: ...
    @property
    def missing(self) -> int: ...
    def write(self, file: _Path) -> None: ...

@final
class RepeatedMotion:
    @property
    def q(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    @property
    def applied_force(self) -> _Floats: ...
    @property
    def gains(self) -> _Floats: ...

def load_problem(file: _Path, steps: int | None = None) -> Problem: ...
def optimize(
    problem: Problem,
    start: ArrayLike | None = None,
    *,
    settings: Settings | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Result: ...
def verify(result: Result) -> Verification: ...
def compute_feedback(result: Result, settings: FeedbackSettings = ...) -> Feedback: ...
def repeated(result: Result, cycles: int, feedback: Feedback | None = None) -> RepeatedMotion: ...
def following_force(
    model: Model,
    q_plan: ArrayLike,
    v_plan: ArrayLike,
    u_plan: ArrayLike,
    gain: ArrayLike,
    q: ArrayLike,
    v: ArrayLike,
) -> _Floats: ...
