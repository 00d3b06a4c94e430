"""Types that users rely on, for pyright (../pyright.sh) to find in the generated stubs.

A line with `pyright: ignore` is a wrong use. Were it accepted, pyright would call the comment unnecessary.
"""

from typing import Literal, assert_type

import numpy as np
from numpy.typing import NDArray

import counterpoint as cp

Floats = NDArray[np.float64]


def building(shape: cp.Shape, pose: cp.Pose) -> None:
    servo = cp.ServoSpec(position=None)
    spec = cp.JointSpec("hip", "revolute", "body", "leg", np.eye(4), (0, 1, 0), damping=0.1, servo=servo)
    link = cp.LinkSpec("leg", collisions=[cp.CollisionSpec(shape, pose=(0, 0, 1))])
    builder = cp.ModelBuilder()
    assert_type(builder.add_robot(cp.RobotSpec("r", [link], [spec]), "floating", None), int)
    assert_type(builder.build(), cp.Model)
    assert_type(shape.type, Literal["plane", "sphere", "box", "capsule", "cylinder", "convex_mesh", "terrain"])
    assert_type(pose @ pose, cp.Pose)
    assert_type(pose @ [1.0, 2.0, 3.0], Floats)
    cp.JointSpec("hip", "hinge", "body", "leg")  # pyright: ignore[reportArgumentType]
    cp.JointSpec("hip", "revolute", "body", "leg", dampng=0.1)  # pyright: ignore[reportCallIssue]


def models(model: cp.Model, state: cp.State, options: cp.SimulationOptions) -> None:
    assert_type(model.joints, list[cp.Joint])
    assert_type(model.notes, list[tuple[str, str]])
    assert_type(model.body("leg").parent, cp.Body | None)
    assert_type(model.joint(0).type, Literal["revolute", "prismatic", "planar", "spherical", "floating"])
    assert_type(state.time, float)
    assert_type(state.q, Floats)
    assert_type(state.taut_links, list[tuple[int, float, float]])
    state.q = [0.0] * model.nq
    options.effects = options.effects | {"gravity"}
    options.step_control = None
    options.integrator = "euler"  # pyright: ignore[reportAttributeAccessIssue]
    model.nq = 3  # pyright: ignore[reportAttributeAccessIssue]
    model.joint(1.5)  # pyright: ignore[reportArgumentType]


def steps(model: cp.Model, state: cp.State, options: cp.SimulationOptions) -> None:
    assert_type(cp.step_forward(model, options, state, workspace=None), tuple[cp.State, cp.StepReport])
    inverse, derivatives = cp.step_inverse_derivatives(model, options, state.q, state.v, state.v, method="extrapolated")
    assert_type(inverse.contacts, list[cp.ContactForce])
    assert_type(inverse.joint_forces, list[tuple[str, int, float]])
    assert_type(inverse.fault, cp.Fault | None)
    assert_type(derivatives.dv_next, Floats)
    assert_type(cp.rnea(model, state.q, state.v, state.v, out=None), Floats)
    cp.step_forward(model, options, state, None, cp.contact.Settings())  # pyright: ignore[reportCallIssue]
    cp.rnea(model, state.q, state.v)  # pyright: ignore[reportCallIssue]


def motions(scene: cp.Scene, state: cp.State) -> None:
    simulator = cp.Simulator(scene)
    assert_type(simulator.state, cp.State)
    assert_type(simulator.step(check=False), cp.StepReport)
    assert_type(simulator.run(1.0, columns=["hip.u"]).to_dict(), dict[str, Floats])
    result = cp.rollout(scene, [state, state], steps=10, num_threads=2)
    assert_type(result.succeeded, NDArray[np.bool_])
    inverse, forward = cp.Batch(scene).forward_derivatives([state], np.zeros((1, 6)))
    assert_type(inverse, cp.InverseDerivativesBatch | None)
    assert_type(forward.dq_du, Floats)
    assert_type(cp.view.Replay(simulator.run(1.0), ghost=None).html(), str)
    simulator.time = 1.0  # pyright: ignore[reportAttributeAccessIssue]


def studies(scene: cp.Scene, columns: cp.recordings.ColumnMap) -> None:
    query = cp.collision.SceneQuery(scene.model)
    assert_type(query.cast_rays((0, 0, 1), np.eye(3)), tuple[Floats, NDArray[np.int32]])
    assert_type(query.distance("leg/0", 1), cp.collision.Distance | None)
    assert_type(query.overlapping_pairs(), list[tuple[str, str]])
    (recording,) = cp.recordings.read_recordings(["a.csv"], columns, scene, sources={"force": "b.csv"})
    estimate = cp.recordings.estimate_motion(scene, columns, recording, errors="slow")
    assert_type(estimate["contact_forces"]["foot"]["centre"], Floats)
    estimate["forces"]  # pyright: ignore[reportGeneralTypeIssues]
    problem = cp.optimization.Problem(scene, 10, mirror=("left", "right"))
    problem.add_term("applied_force", weight={"hip.u": 2.0})
    problem.add_term("applied_forces")  # pyright: ignore[reportArgumentType]
    result = cp.optimization.optimize(problem, progress=lambda step: step.cost > 1.0)
    assert_type(result.unactuated, tuple[float, float])
    cp.optimization.optimize(problem, progress=lambda a, b: None)  # pyright: ignore
