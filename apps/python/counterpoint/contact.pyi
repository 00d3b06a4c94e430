from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

@final
class Settings:
    tolerance: float
    max_iterations: int
    soften_after: int
    def __init__(
        self,
        tolerance: float = 1e-12,
        max_iterations: int = 10000,
        soften_after: int = 160,
    ) -> None: ...

@final
class ContactSpaceSolution:
    @property
    def f(self) -> NDArray[np.float64]: ...
    @property
    def v(self) -> NDArray[np.float64]: ...
    @property
    def status(self) -> str: ...
    @property
    def succeeded(self) -> bool: ...
    @property
    def iterations(self) -> int: ...
    @property
    def residual(self) -> float: ...
    @property
    def rank(self) -> int: ...
    @property
    def asymmetry(self) -> float: ...

def solve_contact_space(
    A: ArrayLike,
    c: ArrayLike,
    mu: ArrayLike,
    *,
    coulomb: bool = False,
    compliance: float = 1e-8,
    smoothing: float = 0.0,
    rank_tolerance: float = 1e-14,
    settings: Settings = ...,
) -> ContactSpaceSolution: ...
def invert_contact_space(
    A: ArrayLike,
    v: ArrayLike,
    mu: ArrayLike,
    *,
    coulomb: bool = False,
    compliance: float = 1e-8,
    smoothing: float = 0.0,
    rank_tolerance: float = 1e-14,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def contact_space_residuals(
    A: ArrayLike,
    c: ArrayLike,
    mu: ArrayLike,
    f: ArrayLike,
    coulomb: bool = False,
) -> tuple[float, float, float]: ...
