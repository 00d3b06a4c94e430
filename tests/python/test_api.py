"""Names, exceptions, and what people type first."""

import pathlib

import numpy as np
import pytest

import counterpoint as cp


def test_access_by_name(load):
    model = load("humanoid_drop").model
    names = [joint.name for joint in model.joints]
    for i, name in enumerate(names):
        assert model.joint(name).index == i == model.joint(i).index
    assert model.joint(-1).name == names[-1]
    assert model.body("world").index == 0 and model.body("world").parent is None
    assert [g.name for g in model.geometries] == [model.geometry(i).name for i in range(len(model.geometries))]
    assert model.joint(1).q.start >= model.joint(0).q.stop
    assert "lower" in dir(model.joint(0)) and "Joint" in repr(model.joint(0))


def test_names_that_are_none_say_what_there_is(load):
    scene = load("humanoid_drop")
    name = scene.model.joints[-1].name
    with pytest.raises(KeyError, match=f"did you mean '{name}'"):
        scene.model.joint(name + "x")
    with pytest.raises(IndexError, match="there are"):
        scene.model.joint(1000)
    with pytest.raises(KeyError, match="coordinate"):
        scene.state()["no such thing"]
    with pytest.raises(KeyError, match="input column"):
        cp.rollout(scene, [scene.state()], np.zeros((3, 1)), columns=["nobody.u"])
    with pytest.raises(TypeError):
        scene.model.joint(1.5)


def test_exceptions_have_the_messages_of_cpp(tmp_path, load):
    with pytest.raises(FileNotFoundError, match="nothing.yaml"):
        cp.load_scene(tmp_path / "nothing.yaml")
    with pytest.raises(FileNotFoundError, match="nothing.stl"):
        cp.Shape.convex_mesh(tmp_path / "nothing.stl")
    bad = tmp_path / "bad.yaml"
    bad.write_text("models: 3\n")
    with pytest.raises(cp.InputError, match="bad.yaml"):
        cp.load_scene(bad)
    assert issubclass(cp.InputError, ValueError) and issubclass(cp.StepError, RuntimeError)
    scene = load("cube_drop")
    with pytest.raises(ValueError, match=r"q: expected shape \(7,\), found \(3,\)"):
        cp.State(scene.model, [1, 2, 3])
    with pytest.raises(ValueError, match="'convex', 'lagged' or 'coulomb'"):
        scene.options.contact.friction_model = "sticky"
    with pytest.raises(TypeError, match="no attribute"):
        cp.SimulationOptions(timestep=1)
    with pytest.raises(ValueError, match="another model"):
        cp.step_forward(scene.model, scene.options, load("pendulum").state())
    scene.options.time_step = 0.0
    with pytest.raises(cp.InputError, match="time step"):
        cp.Simulator(scene).step()


def test_a_step_that_fails_says_so_and_changes_nothing(load):
    sim = cp.Simulator(load("cube_drop"))
    sim.input["cube.fx"] = float("nan")
    before = sim.state.copy()
    with pytest.raises(cp.StepError, match="cube.fx") as error:
        sim.step()
    report = error.value.report
    assert not report and report.fault.element == "cube.fx" and "nan" in report.message
    assert sim.state == before
    assert not sim.step(check=False).succeeded
    with pytest.raises(cp.StepError, match="cube.fx"):
        sim.run(steps=3)


def test_a_rollout_that_fails_is_nan_from_there_on(load):
    scene = load("cube_drop")
    inputs = np.zeros((2, 6, scene.model.nv))
    inputs[1, 3, 0] = np.nan
    result = cp.rollout(scene, [scene.state()] * 2, inputs)
    assert result.steps.tolist() == [6, 3] and result.succeeded.tolist() == [True, False]
    assert np.isfinite(result.states[1, :3]).all() and np.isnan(result.states[1, 3:]).all()
    assert "cube.fx" in result.report(1).message and result.end(1).time == 3 * scene.options.time_step


def test_rollouts_go_into_the_callers_array_to_the_bits_of_one_by_one(load):
    scene = load("humanoid_drop")
    rng = np.random.default_rng(0)
    nv = scene.model.nv
    starts = np.tile(np.concatenate([scene.q, scene.v]), (5, 1))
    starts[:, 2] += 0.1 * np.arange(5)
    inputs = rng.standard_normal((5, 40, nv))
    out = np.empty((5, 40, scene.model.nq + nv))
    result = cp.Batch(scene, num_threads=2).rollout(starts, inputs, out=out)
    assert result.states is out and np.shares_memory(result.v, out)
    sim = cp.Simulator(scene)
    for i in range(5):
        sim.state = cp.State(scene.model, starts[i, : scene.model.nq])
        for k in range(40):
            sim.input.applied_force = inputs[i, k]
            sim.step()
            assert np.array_equal(out[i, k], np.concatenate([sim.q, sim.v]))
        assert result.end(i) == sim.state
    for bad in (out[:, :, :3], out.astype(np.float32), np.asfortranarray(out)):
        with pytest.raises(ValueError, match="out"):
            cp.rollout(scene, starts, inputs, out=bad)
    frozen = out.copy()
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        cp.rollout(scene, starts, inputs, out=frozen)


def test_input_columns_are_forces_targets_and_wrenches(load):
    scene = load("arm7_servo")
    model = scene.model
    servo = model.servos[0].name
    link = model.frames[-1].name
    columns = [f"{servo}.target", f"{link}.fz", model.coordinates.force[0]]
    row = np.array([0.3, 5.0, 0.1])
    result = cp.rollout(scene, [scene.state()], np.tile(row, (20, 1)), columns=columns)
    sim = cp.Simulator(scene)
    sim.input[columns[0]], sim.input[columns[2]] = row[0], row[2]
    sim.input.add_wrench(link, force=(0, 0, row[1]))
    sim.advance(20)
    assert result.end(0) == sim.state
    sim.reset()
    sim.input.clear()
    assert sim.input.num_wrenches == 0
    motion = sim.run(inputs=np.tile(row, (20, 1)), columns=columns)
    assert np.array_equal(motion.q[-1], result.q[0, -1])
    inverse = cp.step_inverse(model, scene.options, motion.q[4], motion.v[4], motion.v[5], known=motion.input(4))
    # The share of the largest force to which an inverse recovers forces (docs/explanation/concepts.md).
    tolerance = 1e-9 * inverse.force_scale
    assert abs(inverse.applied_force[0] - row[2]) < tolerance


def test_batch_steps_states_in_place(load):
    scene = load("humanoid_drop")
    states = [scene.state() for _ in range(3)]
    batch = cp.Batch(scene, num_threads=2)
    for _ in range(5):
        assert all(batch.step(states))
    sim = cp.Simulator(scene)
    sim.advance(5)
    assert all(state == sim.state for state in states)


def test_a_scene_without_a_file():
    ball = cp.Shape.sphere(0.1)
    robot = cp.RobotSpec("ball", [cp.LinkSpec("ball", ball.inertia(2.0), [cp.CollisionSpec(ball)])])
    builder = cp.ModelBuilder()
    builder.add_environment("ground", cp.Shape.plane())
    builder.add_robot(robot, base="floating", pose=(0, 0, 0.5))
    scene = cp.Scene(builder.build(), options=cp.SimulationOptions(time_step=1e-3), name="ball")
    sim = cp.Simulator(scene)
    sim.advance(1000)
    # A resting body hovers about the smoothing length above the ground; its compliance gives as much again.
    assert abs(sim.state["ball.z"] - 0.1) < 1e-9
    before = sim.state.copy()
    sim.step()
    inverse = sim.inverse(before.q, before.v, sim.v)
    (contact,) = inverse.contacts
    assert contact.geometry_a == "ground"
    assert abs(contact.force[2] - 2.0 * 9.80665) < 1e-6 * 2.0 * 9.80665  # tolerance of the solver over h
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


def test_dynamics_are_each_others_oracles(load):
    scene = load("humanoid_drop")
    model, rng = scene.model, np.random.default_rng(3)
    q = cp.integrate_configuration(model, scene.q, rng.standard_normal(model.nv), 0.3)
    v, a = rng.standard_normal((2, model.nv))
    data = cp.Data(model)
    tau = cp.rnea(model, q, v, a, data)
    # Rounding of sums over some 30 bodies, condition of M about 1e4.
    assert np.allclose(cp.aba(model, q, v, tau, data=data), a, rtol=0, atol=1e-9)
    M = cp.crba(model, q, data)
    still = cp.rnea(model, q, v, np.zeros(model.nv), data)
    assert np.allclose(M @ a + still, tau, rtol=1e-10, atol=1e-10 * np.abs(tau).max())
    armature = 0.5 * v @ (model.armature * v)
    assert np.isclose(cp.kinetic_energy(model, q, v), 0.5 * v @ M @ v + armature, rtol=1e-12)
    back = cp.integrate_configuration(model, scene.q, cp.configuration_difference(model, scene.q, q), 1.0)
    assert np.allclose(back, q, rtol=0, atol=1e-13)  # rounding of exponential and logarithm
    out = np.empty((model.nv, model.nv))
    assert cp.crba(model, q, out=out) is out and np.array_equal(out, M)
    cp.compute_kinematics(model, data, q, v)
    assert not {"rotation", "translation", "X_WB"} & set(dir(data))  # of bodies: pose and frame_motion are of links
    assert cp.total_mass(model) == pytest.approx(sum(body.mass for body in model.bodies), rel=1e-14)
    assert cp.total_momentum(model, q, v).shape == (6,) and np.isfinite(cp.potential_energy(model, q))


def test_poses():
    X = cp.Pose.from_rpy(0.1, 0.2, 0.3, (1, 2, 3))
    assert np.allclose((X @ X.inverse()).matrix, np.eye(4), atol=1e-15)
    points = np.random.default_rng(0).standard_normal((5, 3))
    assert np.allclose((X @ points)[2], X @ points[2], atol=1e-15)
    assert np.allclose(cp.Pose.from_quaternion(X.quaternion, X.translation).matrix, X.matrix, atol=1e-15)
    with pytest.raises(ValueError, match="rotation matrix"):
        cp.Pose(2 * np.eye(3))


def test_collision_queries(load):
    box, ball = cp.Shape.box(1, 1, 1), cp.Shape.sphere(0.25)
    d = cp.collision.distance(box, None, ball, (0, 0, 1))
    assert d.gap == pytest.approx(0.25, abs=1e-12) and d.normal.tolist() == [0, 0, 1]
    assert cp.collision.overlap(box, None, ball, (0, 0, 0.6))
    hit = cp.collision.cast_ray(box, None, (0, 0, 2), (0, 0, -3))
    assert hit.distance == pytest.approx(1.5, abs=1e-12)
    scene = load("cube_drop")
    query = cp.collision.SceneQuery(scene.model)
    query.set_configuration(scene.q)
    ground = next(g.name for g in scene.model.geometries if g.shape.type == "plane")
    distances, geometries = query.cast_rays((0, 5, 9), [[0, 0, -1], [0, 0, 1]])
    assert distances[0] == pytest.approx(9) and distances[1] == np.inf
    assert scene.model.geometry(int(geometries[0])).name == ground and geometries[1] == -1
    assert query.distance(ground, "cube/0" if "cube/0" in [g.name for g in scene.model.geometries] else 1).gap > 0
    assert query.contacts(10.0) and not query.overlapping_pairs()
    assert query.overlaps(cp.Shape.sphere(1), (0, 5, 0)) == [ground]


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
    assert sim.state["ball.z"] > 0.9  # on the top, 1 m above the plain


def test_the_forces_of_the_last_step(load):
    scene = load("cube_drop")
    sim = cp.Simulator(scene)
    with pytest.raises(cp.InputError, match="step"):
        sim.last_forces()
    sim.advance(1000)
    forces = sim.last_forces()
    weight = 9.80665 * cp.total_mass(scene.model)
    # At rest: to the tolerance of the solver over h.
    up = -1.0 if forces.contacts[0].geometry_b == "ground" else 1.0
    assert up * forces.contact_forces[:, 2].sum() == pytest.approx(weight, rel=1e-6)
    for contact in forces.contacts:
        assert np.allclose(contact.frame.T @ contact.frame, np.eye(3), atol=1e-15)
        assert np.array_equal(contact.frame[:, 0], contact.normal)
        along = contact.force @ contact.frame
        surfaces = [scene.model.geometry(g).material.friction for g in (contact.geometry_a, contact.geometry_b)]
        assert np.hypot(along[1], along[2]) <= np.sqrt(np.prod(surfaces)) * along[0] + 1e-9 * weight
    kept = forces.contact_forces.copy()
    sim.advance(10)
    assert np.array_equal(forces.contact_forces, kept)


def test_friction_takes_energy_and_limits_hold(load):
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    limits = 0
    for _ in range(20):
        sim.advance(50)
        forces = sim.last_forces()
        for contact in forces.contacts:
            # Across the normal, against the force; 1e-9: of the solver's tolerance, over h.
            assert abs(contact.slip @ contact.normal) <= 1e-12
            assert contact.slip @ contact.force <= 1e-9 * forces.force_scale
        for effect, index, force in forces.joint_forces:
            assert effect == "limits" and 0 <= index < scene.model.nv and np.isfinite(force)
            limits += force != 0.0
    assert limits > 0  # knees and elbows come against their stops


def test_frames_by_name(load):
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    sim.advance(20)
    data = cp.Data(scene.model)
    cp.compute_kinematics(scene.model, data, sim.q, sim.v)
    step = 1e-6
    ahead, behind = (cp.integrate_configuration(scene.model, sim.q, sim.v, h) for h in (step, -step))
    later, earlier = cp.Data(scene.model), cp.Data(scene.model)
    cp.compute_kinematics(scene.model, later, ahead)
    cp.compute_kinematics(scene.model, earlier, behind)
    for frame in scene.model.frames:
        found = sim.frame(frame.name)
        assert np.allclose(found.pose.matrix, data.pose(frame.name).matrix, atol=1e-15)
        rate = (later.pose(frame.name).matrix - earlier.pose(frame.name).matrix) / (2 * step)
        spin = rate[:3, :3] @ found.pose.rotation.T
        # Differences: rounding 1e-16 / step, and step^2 of speeds of some m/s.
        assert np.allclose(found.angular_velocity, [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)
        assert np.allclose(found.velocity, rate[:3, 3], atol=1e-8)
    other = cp.frame_motion(scene.model, sim.state, frame.name)
    assert np.array_equal(other.velocity, found.velocity)
    with pytest.raises(KeyError, match=f"did you mean '{frame.name}'"):
        sim.frame(frame.name + "x")


def test_surfaces_of_pairs_and_filled_inertias(tmp_path):
    builder = cp.ModelBuilder()
    builder.add_environment("ground", cp.Shape.plane(), material=cp.Material(friction=0.0))
    ball = cp.object_of("ball", cp.Shape.sphere(0.1), 2.0, cp.Material(friction=0.0))
    builder.add_robot(ball, "floating", cp.Pose(translation=(0, 0, 0.3)))
    builder.set_pair_surface("ground", "body", restitution=0.5)
    model = builder.build()
    ball_shape = next(g.name for g in model.geometries if g.name != "ground")
    assert model.pair_material("ground", ball_shape).restitution == 0.5
    assert model.pair_material(ball_shape, "ground").friction == 0.0  # as the materials combine
    assert model.bodies[1].mass == 2.0
    with pytest.raises(KeyError, match="no geometry 'sky'"):
        model.pair_material("sky", "ground")
    sim = cp.Simulator(cp.Scene(model))
    rises = [sim.q[2] for _ in range(250) if sim.step() is None or True]
    after = rises[next(i for i in range(249) if rises[i + 1] > rises[i]):]
    # e^2 of the height that it fell through; 1 % is what impacts within the step promise at 2 ms.
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


def test_contact_problems_there_and_back():
    rng = np.random.default_rng(7)
    half = rng.standard_normal((6, 6))
    A, c, mu = half @ half.T, rng.standard_normal(6), [0.5, 0.9]
    for coulomb in (False, True):
        s = cp.contact.solve_contact_space(A, c, mu, coulomb=coulomb)
        f, back = cp.contact.invert_contact_space(A, s.v, mu, coulomb=coulomb)
        assert s.succeeded and np.array_equal(f, s.f)
        # f is the law's of v, whose rounding, 1e-16, it divides by the compliance, 1e-8; ten times that.
        assert np.abs(back - c).max() < 1e-7 * (np.abs(c) + np.abs(A) @ np.abs(f)).max()


def test_trajectories_are_read_as_written(load, tmp_path):
    scene = load("arm7_servo")
    motion = cp.Simulator(scene).run(steps=10)
    file = tmp_path / "motion.csv"
    motion.write(file)
    again = cp.read_trajectory(file, scene)
    for name in ("time", "q", "v", "applied_force", "time_step"):
        assert np.array_equal(getattr(again, name), getattr(motion, name))
    assert len(again) == 11 and again.altered_rows == 0 and again.q.flags.c_contiguous
    table = again.to_dict()
    assert np.array_equal(table[scene.model.coordinates.q[0]], again.q[:, 0])
    assert again.state(-1).time == again.time[-1] and isinstance(file, pathlib.Path)


def test_replays_show_themselves(load):
    motion = cp.Simulator(load("cube_drop")).run(steps=5)
    html = motion._repr_html_()
    if cp.view.can_make_pages():
        page = cp.view.Replay(motion, title="a <title>").html()
        assert html.startswith("<iframe") and page.lower().startswith("<!doctype html>")
    else:
        assert cp.view.why_no_pages().split("\n")[0][:20] in html


def test_identification_finds_what_made_a_motion(load, tmp_path):
    """A recording made by friction of 0.3 is best explained by it."""
    scene = load("cube_toss")
    made = cp.recordings.with_settings(scene, "friction=0.3")
    motion = cp.Simulator(made).run(0.5)
    model = scene.model
    every = slice(None, None, 5)
    table = {"time": motion.time[every]}
    names = model.coordinates.q + model.coordinates.v
    values = np.hstack([motion.q[every], motion.v[every]])
    table.update({name: values[:, i] for i, name in enumerate(names)})
    file = tmp_path / "toss.csv"
    rows = [",".join(table)] + [",".join(repr(float(x)) for x in row) for row in zip(*table.values())]
    file.write_text("\n".join(rows) + "\n")
    mapped = tmp_path / "map.yaml"
    mapped.write_text("time: time\ncolumns:\n" + "".join(f"  {n}: {n}\n" for n in names))
    columns = cp.recordings.load_column_map(mapped, model)
    recorded = cp.recordings.read_recordings([file], columns, scene)
    calls = []
    found = cp.recordings.identify(scene, columns, recorded, "friction=0.1..0.6", samples=8, refined=1,
                                   progress=lambda done, total: calls.append((done, total)))
    assert calls and found.cost <= found.start_cost
    assert found.parameters[0].value == pytest.approx(0.3, rel=0.05)  # one bounce, a kinked objective
    assert cp.recordings.parameter_values(found.scene, "friction")["friction"] == pytest.approx(found.parameters[0].value)


def test_the_fast_calls_are_methods_and_properties_like_others(load):
    class Mine(cp.Simulator):
        def __init__(self, scene):
            super().__init__(scene)
            self.extra = 1

    sim = Mine(load("pendulum"))
    kept, other = sim.step(), sim.step(check=False)
    assert kept is not other and kept and sim.step(True) and sim.extra == 1
    assert "StepReport" in cp.Simulator.step.__doc__ and sim.state is sim.state
    for wrong in (lambda: sim.step(1, 2), lambda: sim.step(chek=True), lambda: cp.Simulator.step(3)):
        with pytest.raises(TypeError):
            wrong()
    with pytest.raises(AttributeError):
        sim.q = [1.0]
    with pytest.raises(AttributeError):
        del sim.state
    with pytest.raises(TypeError, match="__init__"):
        cp.Simulator.__new__(cp.Simulator).step()
    with pytest.raises(TypeError, match="__init__"):
        cp.State.__new__(cp.State).q


def test_what_is_no_array_says_so_and_nothing_is_a_batch(load):
    scene = load("pendulum")
    for wrong in (lambda: cp.rollout(scene, "x", steps=1), lambda: cp.rollout(scene, [scene.state()], "x"),
                  lambda: cp.State(scene.model, "x"), lambda: cp.collision.overlap(cp.Shape.sphere(1), "x", cp.Shape.plane(), None)):
        with pytest.raises(ValueError, match="could not convert string"):
            wrong()
    assert len(cp.rollout(scene, [], steps=3)) == 0
    with pytest.raises(IndexError, match="there are 1"):
        cp.rollout(scene, [scene.state()], steps=1).end(4)
