"""Scenes built in Python without a file."""

import numpy as np
import pytest

import counterpoint as cp


def test_a_scene_without_a_file():
    ball = cp.Shape.sphere(0.1)
    robot = cp.RobotSpec("ball", [cp.LinkSpec("ball", ball.inertia(2.0), [cp.CollisionSpec(ball)])])
    builder = cp.ModelBuilder()
    builder.add_environment("ground", cp.Shape.plane())
    builder.add_robot(robot, base="floating", pose=(0, 0, 0.5))
    scene = cp.Scene(builder.build(), options=cp.SimulationOptions(time_step=1e-3), name="ball")
    sim = cp.Simulator(scene)
    sim.advance(1000)
    # A resting body hovers about the smoothing length above the ground; the compliance adds as much again.
    assert abs(sim.state["ball.z"] - 0.1) < 1e-9
    before = sim.state.copy()
    sim.step()
    inverse = sim.inverse(before.q, before.v, sim.v)
    (contact,) = inverse.contacts
    assert contact.geometry_a == "ground"
    assert abs(contact.force[2] - 2.0 * 9.80665) < 1e-6 * 2.0 * 9.80665  # solver tolerance over h
    assert np.array_equal(inverse.contact_forces[0], contact.force)


def test_joints_closures_and_limits_without_a_file():
    rod = cp.Shape.box(0.02, 0.02, 1.0)
    links = [cp.LinkSpec("base")] + [cp.LinkSpec(name, rod.inertia(1.0)) for name in ("upper", "lower")]
    joints = [
        cp.JointSpec("shoulder", "revolute", "base", "upper", axis=(0, 1, 0), damping=0.1),
        cp.JointSpec("elbow", "revolute", "upper", "lower", pose=(0, 0, -1), axis=(0, 1, 0), lower=-2.0, upper=2.0),
    ]
    builder = cp.ModelBuilder(gravity=(0, 0, -9.81))
    builder.add_robot(cp.RobotSpec("arm", links, joints))
    builder.set_default_position("elbow", [0.5])
    model = builder.build()
    assert model.joint("elbow").upper == 2.0 and model.default_q[1] == 0.5 and model.damping[0] == 0.1
    assert cp.State(model)["elbow.q"] == 0.5
    with pytest.raises(cp.InputError):
        builder = cp.ModelBuilder()
        builder.add_robot(cp.RobotSpec("loop", links, [joints[0], joints[0]]))


def test_springs_ropes_and_axes_of_closures():
    def tied(mass, **closure):
        builder = cp.ModelBuilder(gravity=(0, 0, -10))
        builder.add_robot(cp.object_of("ball", cp.Shape.sphere(0.1), mass), "floating")
        builder.add_closure(cp.ClosureSpec("world", "body", **closure))
        return cp.Simulator(cp.Scene(builder.build()))

    sim = tied(2.0, type="weld", stiffness=500, damping=(60, 60, 63), rotational_stiffness=(1, 2, 3))
    sim.advance(3000)
    assert abs(sim.q[2] + 2.0 * 10 / 500) < 1e-9  # m g / k
    sim = tied(2.0, type="screw", axis=(0, 0, 1), pitch=0.5)
    sim.advance(1000)
    inertia = 0.4 * 2.0 * 0.1**2
    fall = 10 / (1 + (2 * np.pi / 0.5) ** 2 * inertia / 2.0)
    assert abs(sim.v[2] + fall * sim.time) < 1e-6 * fall * sim.time
    sim = tied(1.0, type="distance", anchor_a=(0, 0, 1), length=1.5, rope=True)
    sim.advance(3000)
    assert abs(sim.q[2] + 0.5) < 1e-6
    for wrong in ({"type": "ball", "axis": (0, 0, 1)}, {"type": "screw"}, {"type": "ball", "rope": True}):
        with pytest.raises(cp.InputError):
            tied(1.0, **wrong)


def test_terrain_from_files(scenes, tmp_path):
    table = tmp_path / "hill.csv"
    table.write_text("0,0,0\n0,1,0\n0,0,0\n")
    hill = cp.Shape.height_field(table, (4.0, 2.0))
    assert hill.type == "terrain" and hill.vertices[:, 2].max() == 1.0
    assert np.abs(hill.vertices[:, :2]).max(axis=0).tolist() == [2.0, 1.0]
    with pytest.raises(ValueError, match="leave it out"):
        cp.Shape.height_field(table, (4.0, 2.0), height=1.0)
    with pytest.raises(FileNotFoundError):
        cp.Shape.height_field(tmp_path / "none.csv", (1.0, 1.0))
    mesh = tmp_path / "slope.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n")
    slope = cp.Shape.triangle_mesh(mesh, scale=(2, 1, 1))
    assert slope.type == "terrain" and slope.vertices[:, 0].max() == 2.0
    builder = cp.ModelBuilder()
    builder.add_environment("hill", hill)
    ball = cp.Shape.sphere(0.1)
    builder.add_robot(cp.RobotSpec("ball", [cp.LinkSpec("ball", ball.inertia(1.0), [cp.CollisionSpec(ball)])]),
                      base="floating", pose=(0, 0, 2))
    scene = cp.Scene(builder.build())
    sim = cp.Simulator(scene)
    sim.run(0.6)
    assert sim.state["ball.z"] > 0.9  # on the hilltop, 1 m above the plain


def test_surfaces_of_pairs_and_filled_inertias(tmp_path):
    builder = cp.ModelBuilder()
    builder.add_environment("ground", cp.Shape.plane(), material=cp.Material(friction=0.0))
    ball = cp.object_of("ball", cp.Shape.sphere(0.1), 2.0, cp.Material(friction=0.0))
    builder.add_robot(ball, "floating", cp.Pose(translation=(0, 0, 0.3)))
    builder.set_pair_surface("ground", "body", restitution=0.5)
    model = builder.build()
    ball_shape = next(g.name for g in model.geometries if g.name != "ground")
    assert model.pair_material("ground", ball_shape).restitution == 0.5
    assert model.pair_material(ball_shape, "ground").friction == 0.0  # from the combined materials
    assert model.bodies[1].mass == 2.0
    with pytest.raises(KeyError, match="no geometry 'sky'"):
        model.pair_material("sky", "ground")
    sim = cp.Simulator(cp.Scene(model))
    rises = [sim.q[2] for _ in range(250) if sim.step() is None or True]
    after = rises[next(i for i in range(249) if rises[i + 1] > rises[i]):]
    # e^2 of the drop height; impacts within the step are accurate to 1 % at 2 ms.
    assert max(after[:150]) - 0.1 == pytest.approx(0.25 * 0.2, rel=0.01)

    urdf = tmp_path / "swapped.urdf"
    mass = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    urdf.write_text(f"""<robot name="r"><link name="a">{mass}</link><link name="b">{mass}</link><link name="tip"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="1" upper="-1" effort="9" velocity="9"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="tip"/></joint></robot>""")
    with pytest.raises(cp.InputError):
        cp.load_scene(urdf)
    with pytest.raises(cp.InputError):
        cp.load_scene(urdf, repair_joints=True)
    scene = cp.load_scene(urdf, repair_joints=True, fill_inertia=1e-3)
    assert scene.model.joint("j").lower == -1.0 and scene.model.bodies[-1].mass == 1e-3
    assert len(scene.model.notes) >= 2
    spec = cp.load_urdf(urdf, repair_joints=True)
    builder = cp.ModelBuilder()
    builder.add_robot(spec)
    builder.fill_inertia(1e-3)
    assert builder.build().bodies[-1].mass == 1e-3
