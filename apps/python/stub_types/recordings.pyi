class _Explanation(TypedDict):
    file: str
    time: _Floats
    force: _Floats
    figures: dict[str, float]

class _ContactForces(TypedDict):
    force: _Floats
    deviation: _Floats
    centre: _Floats

class _MotionEstimate(TypedDict):
    file: str
    time: _Floats
    q: _Floats
    v: _Floats
    force: _Floats
    force_deviation: _Floats
    contact_forces: dict[str, _ContactForces]
    errors: Literal["none", "white", "slow"]
    cost_ratio: float
    unexplained_mean: float
    unexplained_max: float
    parameters: dict[str, tuple[float, float]]
    sensors: dict[str, tuple[float, float]]

