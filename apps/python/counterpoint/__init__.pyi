from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import collision as collision
from . import contact as contact
from . import optimization as optimization
from . import recordings as recordings
from . import view as view

__version__: str
__all__: list[str]

_Path: TypeAlias = str | PathLike[str]
_Floats: TypeAlias = NDArray[np.float64]
_PoseLike: TypeAlias = Pose | ArrayLike | None
_Base: TypeAlias = Literal["fixed", "floating", "spherical"]
_FrictionModel: TypeAlias = Literal["convex", "lagged", "coulomb"]
_Integrator: TypeAlias = Literal["semi_implicit_euler", "implicit_midpoint", "runge_kutta_4"]
_MovingJoint: TypeAlias = Literal["revolute", "prismatic", "planar", "spherical", "floating"]

class InputError(ValueError): ...

class StepError(RuntimeError):
    report: StepReport
    partial: Trajectory | None

@final
class Pose:
    def __init__(
        self,
        rotation: ArrayLike | None = None,
        translation: ArrayLike = (0, 0, 0),
    ) -> None: ...
    @staticmethod
    def from_quaternion(quaternion: ArrayLike, translation: ArrayLike = (0, 0, 0)) -> Pose: ...
    @staticmethod
    def from_rpy(
        roll: float,
        pitch: float,
        yaw: float,
        translation: ArrayLike = (0, 0, 0),
    ) -> Pose: ...
    @staticmethod
    def from_matrix(matrix: ArrayLike) -> Pose: ...
    @property
    def rotation(self) -> _Floats: ...
    @property
    def translation(self) -> _Floats: ...
    @property
    def quaternion(self) -> _Floats: ...
    @property
    def matrix(self) -> _Floats: ...
    def inverse(self) -> Pose: ...
    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: ArrayLike) -> _Floats: ...

@final
class SpatialInertia:
    mass: float
    def __init__(
        self,
        mass: float = 0.0,
        center: ArrayLike = (0, 0, 0),
        rotational: ArrayLike = (0, 0, 0),
    ) -> None: ...
    @property
    def center(self) -> _Floats: ...
    @center.setter
    def center(self, value: ArrayLike) -> None: ...
    @property
    def rotational(self) -> _Floats: ...
    @rotational.setter
    def rotational(self, value: ArrayLike) -> None: ...
    @property
    def defect(self) -> str: ...

@final
class Material:
    friction: float
    restitution: float
    torsional_friction: float
    rolling_friction: float
    def __init__(
        self,
        friction: float = 0.8,
        restitution: float = 0.0,
        torsional_friction: float = 0.0,
        rolling_friction: float = 0.0,
    ) -> None: ...

@final
class Shape:
    @staticmethod
    def plane() -> Shape: ...
    @staticmethod
    def sphere(radius: float) -> Shape: ...
    @staticmethod
    def box(x: float, y: float, z: float) -> Shape: ...
    @staticmethod
    def capsule(radius: float, length: float) -> Shape: ...
    @staticmethod
    def cylinder(radius: float, length: float) -> Shape: ...
    @staticmethod
    def convex_hull(points: ArrayLike) -> Shape: ...
    @staticmethod
    def convex_mesh(file: _Path, scale: ArrayLike = (1, 1, 1)) -> Shape: ...
    @staticmethod
    def terrain(vertices: ArrayLike, triangles: ArrayLike) -> Shape: ...
    @staticmethod
    def triangle_mesh(file: _Path, scale: ArrayLike = (1, 1, 1)) -> Shape: ...
    @staticmethod
    def height_field(
        file: _Path,
        size: tuple[float, float],
        height: float | None = None,
    ) -> Shape: ...
    @property
    def type(
        self,
    ) -> Literal["plane", "sphere", "box", "capsule", "cylinder", "convex_mesh", "terrain"]: ...
    @property
    def size(self) -> _Floats: ...
    @property
    def vertices(self) -> _Floats: ...
    def inertia(self, mass: float) -> SpatialInertia: ...

@final
class ContactOptions:
    compliance: float
    smoothing: float
    stabilization: float
    max_recovery_speed: float
    margin: float
    reach_acceleration: float
    slip_time: float
    friction_model: _FrictionModel
    def __init__(
        self,
        *,
        friction_model: _FrictionModel = ...,
        compliance: float = ...,
        smoothing: float = ...,
        stabilization: float = ...,
        max_recovery_speed: float = ...,
        margin: float = ...,
        reach_acceleration: float = ...,
        slip_time: float = ...,
    ) -> None: ...
    def apply_preset(self, preset: Literal["fast", "default", "hard"]) -> None: ...

@final
class StepControlOptions:
    tolerance: float
    relative_tolerance: float
    event_tolerance: float
    min_step: float
    max_step: float
    interval: float
    strict: bool
    def __init__(
        self,
        *,
        tolerance: float = ...,
        relative_tolerance: float = ...,
        event_tolerance: float = ...,
        min_step: float = ...,
        max_step: float = ...,
        interval: float = ...,
        strict: bool = ...,
    ) -> None: ...

@final
class SimulationOptions:
    time_step: float
    duration: float
    max_speed: float
    closing_time: float
    contact: ContactOptions
    mean_velocity_forces: bool
    step_control: StepControlOptions | None
    integrator: _Integrator
    def __init__(
        self,
        *,
        time_step: float = ...,
        integrator: _Integrator = ...,
        duration: float = ...,
        max_speed: float = ...,
        closing_time: float = ...,
        contact: ContactOptions = ...,
        mean_velocity_forces: bool = ...,
        step_control: StepControlOptions | None = ...,
        effects: Iterable[str] = ...,
    ) -> None: ...
    @property
    def effects(self) -> frozenset[str]: ...
    @effects.setter
    def effects(self, names: Iterable[str]) -> None: ...
    def switch_effect(self, name: str, on: bool) -> None: ...
    def copy(self) -> SimulationOptions: ...
    def __copy__(self) -> SimulationOptions: ...

@final
class Coordinates:
    @property
    def q(self) -> list[str]: ...
    @property
    def v(self) -> list[str]: ...
    @property
    def force(self) -> list[str]: ...

@final
class State:
    time: float
    def __init__(
        self,
        model: Model | Coordinates,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        time: float = 0.0,
        memory: ArrayLike | None = None,
    ) -> None: ...
    @property
    def q(self) -> _Floats: ...
    @q.setter
    def q(self, value: ArrayLike) -> None: ...
    @property
    def v(self) -> _Floats: ...
    @v.setter
    def v(self, value: ArrayLike) -> None: ...
    @property
    def memory(self) -> _Floats: ...
    @memory.setter
    def memory(self, value: ArrayLike) -> None: ...
    @property
    def taut_links(self) -> list[tuple[int, float, float]]: ...
    @property
    def coordinates(self) -> Coordinates: ...
    @property
    def hash(self) -> int: ...
    def __getitem__(self, name: str) -> float: ...
    def __setitem__(self, name: str, value: float) -> None: ...
    def keys(self) -> list[str]: ...
    def copy(self) -> State: ...
    def assign(self, other: State) -> None: ...
    def __copy__(self) -> State: ...
    def __deepcopy__(self, memo: dict[int, Any]) -> State: ...

@final
class Input:
    def __init__(self, model: Model, applied_force: ArrayLike | None = None) -> None: ...
    @property
    def applied_force(self) -> _Floats: ...
    @applied_force.setter
    def applied_force(self, value: ArrayLike) -> None: ...
    @property
    def servo_position(self) -> _Floats: ...
    @servo_position.setter
    def servo_position(self, value: ArrayLike) -> None: ...
    @property
    def servo_velocity(self) -> _Floats: ...
    @servo_velocity.setter
    def servo_velocity(self, value: ArrayLike) -> None: ...
    softening: tuple[float, int]
    @property
    def taut_links(self) -> list[tuple[int, float, float]]: ...
    @taut_links.setter
    def taut_links(self, value: Sequence[tuple[int, float, float]]) -> None: ...
    @property
    def num_wrenches(self) -> int: ...
    def __getitem__(self, name: str) -> float: ...
    def __setitem__(self, name: str, value: float) -> None: ...
    def add_wrench(
        self,
        link: str | int,
        force: ArrayLike = (0, 0, 0),
        torque: ArrayLike = (0, 0, 0),
        point: ArrayLike = (0, 0, 0),
    ) -> None: ...
    def clear_wrenches(self) -> None: ...
    def clear(self) -> None: ...

@final
class Joint:
    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def link(self) -> str: ...
    @property
    def type(self) -> _MovingJoint: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def effort_limit(self) -> float: ...
    @property
    def velocity_limit(self) -> float: ...
    @property
    def actuated(self) -> bool: ...
    @property
    def body(self) -> Body: ...
    @property
    def q(self) -> slice: ...
    @property
    def v(self) -> slice: ...
    @property
    def default_q(self) -> _Floats: ...
    @property
    def damping(self) -> _Floats: ...
    @property
    def armature(self) -> _Floats: ...
    @property
    def dry_friction(self) -> _Floats: ...
    @property
    def has_servo(self) -> bool: ...

@final
class Body:
    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def parent(self) -> Body | None: ...
    @property
    def joint(self) -> Joint | None: ...
    @property
    def tree(self) -> int: ...
    @property
    def mass(self) -> float: ...
    @property
    def inertia(self) -> SpatialInertia: ...

@final
class Frame:
    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def body(self) -> Body: ...
    @property
    def pose(self) -> Pose: ...

@final
class Geometry:
    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def body(self) -> Body: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def shape(self) -> Shape: ...
    @property
    def material(self) -> Material: ...

@final
class Model:
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def num_bodies(self) -> int: ...
    @property
    def num_trees(self) -> int: ...
    @property
    def joints(self) -> list[Joint]: ...
    @property
    def bodies(self) -> list[Body]: ...
    @property
    def frames(self) -> list[Frame]: ...
    @property
    def geometries(self) -> list[Geometry]: ...
    @property
    def servos(self) -> list[Joint]: ...
    @property
    def closures(self) -> list[str]: ...
    def pair_material(self, geometry_a: str, geometry_b: str) -> Material: ...
    @property
    def coordinates(self) -> Coordinates: ...
    @property
    def gravity(self) -> _Floats: ...
    @property
    def default_q(self) -> _Floats: ...
    @property
    def damping(self) -> _Floats: ...
    @property
    def armature(self) -> _Floats: ...
    @property
    def dry_friction(self) -> _Floats: ...
    @property
    def notes(self) -> list[tuple[str, str]]: ...
    def joint(self, key: str | int) -> Joint: ...
    def body(self, key: str | int) -> Body: ...
    def frame(self, key: str | int) -> Frame: ...
    def geometry(self, key: str | int) -> Geometry: ...

@final
class Drag:
    linear: float
    quadratic: float
    angular: float
    angular_quadratic: float
    def __init__(
        self,
        linear: float = 0.0,
        quadratic: float = 0.0,
        angular: float = 0.0,
        angular_quadratic: float = 0.0,
    ) -> None: ...

@final
class CollisionSpec:
    name: str
    shape: Shape
    material: Material
    def __init__(
        self,
        shape: Shape,
        pose: _PoseLike = None,
        material: Material = ...,
        name: str = "",
    ) -> None: ...
    @property
    def pose(self) -> Pose: ...
    @pose.setter
    def pose(self, value: _PoseLike) -> None: ...

@final
class LinkSpec:
    name: str
    inertia: SpatialInertia
    collisions: list[CollisionSpec]
    drag: Drag
    gravity_compensation: float
    def __init__(
        self,
        name: str,
        inertia: SpatialInertia = ...,
        collisions: Sequence[CollisionSpec] = (),
        drag: Drag = ...,
    ) -> None: ...

@final
class ServoSpec:
    stiffness: float
    damping: float
    position: float | None
    velocity: float
    def __init__(
        self,
        stiffness: float = 0.0,
        damping: float = 0.0,
        position: float | None = None,
        velocity: float = 0.0,
    ) -> None: ...

@final
class JointSpec:
    name: str
    parent: str
    child: str
    lower: float
    upper: float
    effort_limit: float
    velocity_limit: float
    damping: float
    dry_friction: float
    armature: float
    stiffness: float
    reference: float
    servo: ServoSpec
    mimic_master: str
    mimic_multiplier: float
    mimic_offset: float
    def __init__(
        self,
        name: str,
        type: Literal["fixed", "revolute", "prismatic", "planar", "spherical", "floating"],
        parent: str,
        child: str,
        pose: _PoseLike = None,
        axis: ArrayLike = (1, 0, 0),
        *,
        lower: float = ...,
        upper: float = ...,
        effort_limit: float = ...,
        velocity_limit: float = ...,
        damping: float = 0.0,
        dry_friction: float = 0.0,
        armature: float = 0.0,
        stiffness: float = 0.0,
        reference: float = 0.0,
        servo: ServoSpec = ...,
        mimic_master: str = "",
        mimic_multiplier: float = 1.0,
        mimic_offset: float = 0.0,
    ) -> None: ...

@final
class RobotSpec:
    name: str
    links: list[LinkSpec]
    joints: list[JointSpec]
    def __init__(
        self,
        name: str,
        links: Sequence[LinkSpec],
        joints: Sequence[JointSpec] = (),
    ) -> None: ...

@final
class ClosureSpec:
    def __init__(
        self,
        link_a: str,
        link_b: str,
        type: Literal["ball", "weld", "distance"] = "ball",
        anchor_a: ArrayLike | None = None,
        anchor_b: ArrayLike | None = None,
        length: float | None = None,
        name: str = "",
        collide: bool = False,
    ) -> None: ...

@final
class ModelBuilder:
    def __init__(self, gravity: ArrayLike = (0.0, 0.0, -9.80665)) -> None: ...
    def add_robot(
        self,
        robot: RobotSpec,
        base: _Base = "fixed",
        pose: _PoseLike = None,
        prefix: str = "",
    ) -> int: ...
    def add_environment(
        self,
        name: str,
        shape: Shape,
        pose: _PoseLike = None,
        material: Material = ...,
    ) -> int: ...
    def set_default_position(self, joint: str, q: ArrayLike) -> None: ...
    def exclude_pair(
        self,
        geometry_or_link_a: str,
        geometry_or_link_b: str,
        reason: str = "",
    ) -> None: ...
    def include_pair(self, geometry_or_link_a: str, geometry_or_link_b: str) -> None: ...
    def set_pair_surface(
        self,
        geometry_or_link_a: str,
        geometry_or_link_b: str,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        torsional_friction: float | None = None,
        rolling_friction: float | None = None,
    ) -> None: ...
    def fill_inertia(self, mass: float) -> None: ...
    def add_closure(self, closure: ClosureSpec) -> None: ...
    def build(self) -> Model: ...

def load_urdf(
    file: _Path,
    *,
    packages: Mapping[str, _Path] = ...,
    repair_inertias: bool = False,
    repair_joints: bool = False,
) -> RobotSpec: ...
def object_of(
    name: str,
    shape: Shape,
    mass: float,
    material: Material = ...,
) -> RobotSpec: ...

@final
class Scene:
    name: str
    options: SimulationOptions
    def __init__(
        self,
        model: Model,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        options: SimulationOptions = ...,
        name: str = "",
    ) -> None: ...
    @property
    def model(self) -> Model: ...
    @property
    def q(self) -> _Floats: ...
    @q.setter
    def q(self, value: ArrayLike) -> None: ...
    @property
    def v(self) -> _Floats: ...
    @v.setter
    def v(self, value: ArrayLike) -> None: ...
    def state(self) -> State: ...
    def copy(self) -> Scene: ...

def load_scene(
    file: _Path,
    *,
    packages: Mapping[str, _Path] = ...,
    base: _Base | None = None,
    ground: bool = False,
    ground_friction: float | None = None,
    repair_inertias: bool = False,
    repair_joints: bool = False,
    fill_inertia: float = 0.0,
    srdf: _Path | None = None,
    hull_vertices: int = 0,
) -> Scene: ...

@final
class Fault:
    @property
    def kind(self) -> str: ...
    @property
    def element(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def advice(self) -> str: ...
    @property
    def value(self) -> float: ...
    @property
    def bound(self) -> float: ...
    @property
    def coordinate(self) -> int: ...

@final
class StepReport:
    @property
    def status(self) -> str: ...
    @property
    def succeeded(self) -> bool: ...
    @property
    def contacts(self) -> int: ...
    @property
    def constraint_rows(self) -> int: ...
    @property
    def newton_iterations(self) -> int: ...
    @property
    def residual(self) -> float: ...
    @property
    def max_penetration(self) -> float: ...
    @property
    def sleeping_bodies(self) -> int: ...
    @property
    def softening(self) -> tuple[float, int]: ...
    @property
    def taut_links(self) -> int: ...
    @property
    def largest_inertia(self) -> float: ...
    @property
    def fault(self) -> Fault | None: ...
    @property
    def message(self) -> str: ...
    def check(self) -> None: ...
    def __bool__(self) -> bool: ...

@final
class ControlledReport:
    @property
    def first(self) -> StepReport: ...
    @property
    def second(self) -> StepReport: ...
    @property
    def succeeded(self) -> bool: ...
    @property
    def step(self) -> float: ...
    @property
    def error(self) -> float: ...
    @property
    def rejected(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def impact(self) -> bool: ...
    @property
    def missed(self) -> bool: ...

@final
class ContactForce:
    @property
    def geometry_a(self) -> str: ...
    @property
    def geometry_b(self) -> str: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def normal(self) -> _Floats: ...
    @property
    def frame(self) -> _Floats: ...
    @property
    def gap(self) -> float: ...
    @property
    def force(self) -> _Floats: ...
    @property
    def slip(self) -> _Floats: ...

@final
class Inverse:
    @property
    def applied_force(self) -> _Floats: ...
    @property
    def contact_force(self) -> _Floats: ...
    @property
    def servo_force(self) -> _Floats: ...
    @property
    def force_scale(self) -> float: ...
    @property
    def contacts(self) -> list[ContactForce]: ...
    @property
    def contact_forces(self) -> _Floats: ...
    @property
    def joint_forces(self) -> list[tuple[str, int, float]]: ...
    @property
    def closure_forces(self) -> _Floats: ...
    @property
    def fault(self) -> Fault | None: ...

@final
class Workspace:
    def __init__(self, model: Model) -> None: ...

def step_forward(
    model: Model,
    options: SimulationOptions,
    state: State,
    input: Input | None = None,
    *,
    settings: contact.Settings = ...,
    workspace: Workspace | None = None,
    next: State | None = None,
) -> tuple[State, StepReport]: ...
def step_inverse(
    model: Model,
    options: SimulationOptions,
    q: ArrayLike,
    v: ArrayLike,
    v_next: ArrayLike,
    *,
    q_next: ArrayLike | None = None,
    known: Input | None = None,
    workspace: Workspace | None = None,
) -> Inverse: ...

_Method: TypeAlias = Literal["analytic", "central_differences", "extrapolated"]

@final
class InverseDerivatives:
    @property
    def dq(self) -> _Floats: ...
    @property
    def dv(self) -> _Floats: ...
    @property
    def dv_next(self) -> _Floats: ...
    @property
    def by_differences(self) -> bool: ...

@final
class ForwardDerivatives:
    @property
    def dv_dq(self) -> _Floats: ...
    @property
    def dv_dv(self) -> _Floats: ...
    @property
    def dv_du(self) -> _Floats: ...
    @property
    def dq_dq(self) -> _Floats: ...
    @property
    def dq_dv(self) -> _Floats: ...
    @property
    def dq_du(self) -> _Floats: ...

def step_inverse_derivatives(
    model: Model,
    options: SimulationOptions,
    q: ArrayLike,
    v: ArrayLike,
    v_next: ArrayLike,
    *,
    q_next: ArrayLike | None = None,
    known: Input | None = None,
    workspace: Workspace | None = None,
    method: _Method = "analytic",
    difference_step: float = 0.0,
) -> tuple[Inverse, InverseDerivatives]: ...
def step_forward_derivatives(
    model: Model,
    options: SimulationOptions,
    q: ArrayLike,
    v: ArrayLike,
    v_next: ArrayLike,
    *,
    q_next: ArrayLike | None = None,
    known: Input | None = None,
    workspace: Workspace | None = None,
    method: _Method = "analytic",
) -> ForwardDerivatives: ...

_ParameterKind: TypeAlias = Literal[
    "inertia",
    "friction",
    "restitution",
    "torsional_friction",
    "rolling_friction",
    "height",
    "damping",
    "dry_friction",
    "armature",
    "gravity",
    "compliance",
    "smoothing",
    "stabilization",
    "max_recovery_speed",
]

@final
class StepParameter:
    def __init__(
        self,
        model: Model,
        kind: _ParameterKind,
        targets: Iterable[str | int] = (),
        changes: ArrayLike | None = None,
    ) -> None: ...
    @property
    def kind(self) -> _ParameterKind: ...
    @property
    def targets(self) -> list[int]: ...

def mass_parameter(model: Model, body: str | int) -> StepParameter: ...
def inertia_scale_parameter(model: Model, body: str | int) -> StepParameter: ...
def inertial_step_parameters(model: Model) -> list[StepParameter]: ...

@final
class InverseParameterDerivatives:
    @property
    def du(self) -> _Floats: ...
    @property
    def by_differences(self) -> list[bool]: ...

@final
class ParameterDerivator:
    def __init__(self, model: Model, parameters: Sequence[StepParameter]) -> None: ...
    def inverse(
        self,
        options: SimulationOptions,
        q: ArrayLike,
        v: ArrayLike,
        v_next: ArrayLike,
        *,
        known: Input | None = None,
        workspace: Workspace | None = None,
        method: _Method = "analytic",
    ) -> tuple[Inverse, InverseParameterDerivatives]: ...

def forward_parameter_derivatives(
    derivatives: ForwardDerivatives,
    du: ArrayLike,
) -> tuple[_Floats, _Floats]: ...

@final
class FrameMotion:
    @property
    def pose(self) -> Pose: ...
    @property
    def velocity(self) -> _Floats: ...
    @property
    def angular_velocity(self) -> _Floats: ...

def frame_motion(model: Model, state: State, name: str) -> FrameMotion: ...

@final
class Trajectory:
    @property
    def model(self) -> Model: ...
    @property
    def scene(self) -> Scene | None: ...
    @property
    def time(self) -> _Floats: ...
    @property
    def time_step(self) -> _Floats: ...
    @property
    def q(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    @property
    def applied_force(self) -> _Floats: ...
    @property
    def altered_rows(self) -> int: ...
    @property
    def num_steps(self) -> int: ...
    def __len__(self) -> int: ...
    def state(self, row: int) -> State: ...
    def input(self, step: int) -> Input: ...
    def write(self, file: _Path) -> None: ...
    def to_dict(self) -> dict[str, _Floats]: ...

def read_trajectory(file: _Path, of: Scene | Model) -> Trajectory: ...

@final
class TrajectoryWriter:
    def __init__(self, file: _Path, model: Model, links: Sequence[str] = ()) -> None: ...
    def write_step(
        self,
        state: State,
        input: Input,
        time_step: float,
        softening: tuple[float, int] = (1.0, -1),
        taut_links: Sequence[tuple[int, float, float]] = [],
    ) -> None: ...
    def write_end(self, state: State) -> None: ...

def write_state(
    file: _Path,
    scene: Scene,
    state: State,
    next_step: float | None = None,
) -> None: ...
def read_state(file: _Path, scene: Scene, *, changed_scene: bool = False) -> State: ...

@final
class Simulator:
    next_step: float
    def __init__(self, scene: Scene) -> None: ...
    @property
    def model(self) -> Model: ...
    @property
    def options(self) -> SimulationOptions: ...
    @property
    def settings(self) -> contact.Settings: ...
    state: State
    input: Input
    @property
    def time(self) -> float: ...
    @property
    def q(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    def reset(self) -> None: ...
    def step(self, check: bool = True) -> StepReport: ...
    def step_controlled(self, until: float, check: bool = True) -> ControlledReport: ...
    def advance(self, steps: int, check: bool = True) -> StepReport: ...
    def run(
        self,
        duration: float | None = None,
        *,
        steps: int | None = None,
        inputs: ArrayLike | None = None,
        columns: Sequence[str] = (),
        check: bool = True,
    ) -> Trajectory: ...
    def inverse(
        self,
        q: ArrayLike,
        v: ArrayLike,
        v_next: ArrayLike,
        q_next: ArrayLike | None = None,
    ) -> Inverse: ...
    def last_forces(self) -> Inverse: ...
    def frame(self, name: str) -> FrameMotion: ...
    def effect_counts(self) -> dict[str, int]: ...

@final
class Rollout:
    @property
    def states(self) -> _Floats: ...
    @property
    def q(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    @property
    def steps(self) -> NDArray[np.int64]: ...
    @property
    def succeeded(self) -> NDArray[np.bool_]: ...
    def report(self, motion: int) -> StepReport: ...
    def end(self, motion: int) -> State: ...
    def __len__(self) -> int: ...

@final
class InverseDerivativesBatch:
    @property
    def applied_force(self) -> _Floats: ...
    @property
    def dq(self) -> _Floats: ...
    @property
    def dv(self) -> _Floats: ...
    @property
    def dv_next(self) -> _Floats: ...
    @property
    def by_differences(self) -> NDArray[np.bool_]: ...
    def __len__(self) -> int: ...

@final
class ForwardDerivativesBatch:
    @property
    def dv_dq(self) -> _Floats: ...
    @property
    def dv_dv(self) -> _Floats: ...
    @property
    def dv_du(self) -> _Floats: ...
    @property
    def dq_dq(self) -> _Floats: ...
    @property
    def dq_dv(self) -> _Floats: ...
    @property
    def dq_du(self) -> _Floats: ...
    def __len__(self) -> int: ...

@final
class Batch:
    options: SimulationOptions
    def __init__(self, scene: Scene, num_threads: int = 0) -> None: ...
    @property
    def num_threads(self) -> int: ...
    @property
    def model(self) -> Model: ...
    def set_settings(self, settings: contact.Settings) -> None: ...
    def rollout(
        self,
        states: ArrayLike | Sequence[State],
        inputs: ArrayLike | None = None,
        *,
        steps: int | None = None,
        columns: Sequence[str] = (),
        out: _Floats | None = None,
    ) -> Rollout: ...
    def step(self, states: Sequence[State], inputs: Sequence[Input] = ()) -> list[StepReport]: ...
    def inverse_derivatives(
        self,
        states: ArrayLike | Sequence[State],
        v_next: ArrayLike,
        *,
        known: Sequence[Input] = (),
        method: _Method = "analytic",
    ) -> InverseDerivativesBatch: ...
    def forward_derivatives(
        self,
        states: ArrayLike | Sequence[State],
        v_next: ArrayLike,
        *,
        known: Sequence[Input] = (),
        method: _Method = "analytic",
    ) -> tuple[InverseDerivativesBatch | None, ForwardDerivativesBatch]: ...

def rollout(
    scene: Scene,
    states: ArrayLike | Sequence[State],
    inputs: ArrayLike | None = None,
    *,
    steps: int | None = None,
    columns: Sequence[str] = (),
    out: _Floats | None = None,
    num_threads: int = 0,
) -> Rollout: ...

@final
class Data:
    def __init__(self, model: Model) -> None: ...
    def pose(self, frame: str) -> Pose: ...
    def jacobian(self, frame: str) -> _Floats: ...

def compute_kinematics(
    model: Model,
    data: Data,
    q: ArrayLike,
    v: ArrayLike | None = None,
) -> None: ...
def rnea(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    data: Data | None = None,
    *,
    out: _Floats | None = None,
) -> _Floats: ...
def aba(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    tau: ArrayLike,
    *,
    diagonal: ArrayLike | None = None,
    data: Data | None = None,
    out: _Floats | None = None,
) -> _Floats: ...
def crba(
    model: Model,
    q: ArrayLike,
    data: Data | None = None,
    *,
    out: _Floats | None = None,
) -> _Floats: ...
def total_mass(model: Model) -> float: ...
def kinetic_energy(model: Model, q: ArrayLike, v: ArrayLike, data: Data | None = None) -> float: ...
def potential_energy(model: Model, q: ArrayLike, data: Data | None = None) -> float: ...
def total_momentum(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    data: Data | None = None,
) -> _Floats: ...
def integrate_configuration(model: Model, q: ArrayLike, v: ArrayLike, h: float) -> _Floats: ...
def configuration_difference(model: Model, q_from: ArrayLike, q_to: ArrayLike) -> _Floats: ...

@final
class RneaDerivatives:
    @property
    def dq(self) -> _Floats: ...
    @property
    def dv(self) -> _Floats: ...
    @property
    def da(self) -> _Floats: ...

@final
class AbaDerivatives:
    @property
    def dq(self) -> _Floats: ...
    @property
    def dv(self) -> _Floats: ...
    @property
    def dtau(self) -> _Floats: ...

def rnea_derivatives(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    data: Data | None = None,
) -> RneaDerivatives: ...
def aba_derivatives(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    tau: ArrayLike,
    *,
    diagonal: ArrayLike | None = None,
    data: Data | None = None,
) -> AbaDerivatives: ...
def inertial_parameters(model: Model) -> _Floats: ...
def inertia_regressor(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    data: Data | None = None,
    *,
    out: _Floats | None = None,
) -> _Floats: ...
