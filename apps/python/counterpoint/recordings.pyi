from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Literal, TypedDict, final

import numpy as np
from numpy.typing import NDArray

from . import Model, Scene

class _Explanation(TypedDict):
    file: str
    time: NDArray[np.float64]
    force: NDArray[np.float64]
    figures: dict[str, float]

class _ContactForces(TypedDict):
    force: NDArray[np.float64]
    deviation: NDArray[np.float64]
    centre: NDArray[np.float64]

class _MotionEstimate(TypedDict):
    file: str
    time: NDArray[np.float64]
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    force: NDArray[np.float64]
    force_deviation: NDArray[np.float64]
    contact_forces: dict[str, _ContactForces]
    errors: Literal["none", "white", "slow"]
    cost_ratio: float
    unexplained_mean: float
    unexplained_max: float
    parameters: dict[str, tuple[float, float]]
    sensors: dict[str, tuple[float, float]]

@final
class ColumnMap:
    @property
    def names(self) -> list[str]: ...
    @property
    def compared(self) -> Literal["joints", "pose", "impacts"]: ...

@final
class Recording:
    @property
    def file(self) -> str: ...
    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def q(self) -> NDArray[np.float64]: ...
    @property
    def v(self) -> NDArray[np.float64]: ...
    @property
    def applied_force(self) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

@final
class Prediction:
    @property
    def file(self) -> str: ...
    @property
    def q(self) -> NDArray[np.float64]: ...
    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def deviations(self) -> NDArray[np.float64]: ...
    @property
    def steps(self) -> int: ...
    @property
    def succeeded(self) -> bool: ...
    def figures(self, columns: ColumnMap) -> dict[str, float]: ...

@final
class FoundParameter:
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def scene(self) -> float: ...
    @property
    def value(self) -> float: ...
    @property
    def interval(self) -> tuple[float, float] | None: ...
    @property
    def bootstrap(self) -> tuple[float, float] | None: ...
    @property
    def at_bound(self) -> bool: ...

@final
class Identification:
    @property
    def parameters(self) -> list[FoundParameter]: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def start_cost(self) -> float: ...
    @property
    def cost(self) -> float: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def linearizations(self) -> int: ...
    @property
    def correlation(self) -> NDArray[np.float64]: ...

def load_column_map(file: str | PathLike[str], model: Model) -> ColumnMap: ...
def read_recordings(
    files: Sequence[str | PathLike[str]],
    columns: ColumnMap,
    scene: Scene,
    *,
    sources: Mapping[str, str] = ...,
    missing_cells: bool = False,
) -> list[Recording]: ...
def predict(
    scene: Scene, columns: ColumnMap, recordings: Sequence[Recording], *, substeps: int | None = None, horizon: int = 0
) -> list[Prediction]: ...
def explain(
    scene: Scene,
    columns: ColumnMap,
    recordings: Sequence[Recording],
    *,
    reach: float | None = None,
) -> list[_Explanation]: ...
def estimate_motion(
    scene: Scene,
    columns: ColumnMap,
    recording: Recording,
    *,
    errors: Literal["white", "slow"] | None = None,
    threads: int = 0,
) -> _MotionEstimate: ...
@final
class MotionFollower:
    def __init__(
        self,
        scene: Scene,
        columns: ColumnMap,
        *,
        window: int = 30,
        lag: int = 10,
        errors: Literal["white", "slow"] | None = None,
        threads: int = 1,
    ) -> None: ...
    def push(self, time: float, q: Sequence[float]) -> _MotionEstimate: ...
    def finish(self) -> _MotionEstimate: ...

def with_settings(scene: Scene, settings: str) -> Scene: ...
def parameter_values(scene: Scene, parameters: str) -> dict[str, float]: ...
def identify(
    scene: Scene,
    columns: ColumnMap,
    recordings: Sequence[Recording],
    parameters: str,
    *,
    objective: Literal["score", "rows", "one-step", "force", "explain"] = "score",
    substeps: int | None = None,
    horizon: int = 0,
    robust: bool = True,
    samples: int = 64,
    refined: int = 3,
    bootstrap: int = 0,
    exact: bool = True,
    difference: float = 1e-3,
    progress: Callable[[int, int], object] | None = None,
) -> Identification: ...
