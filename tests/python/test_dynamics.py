"""Dynamics, collision, frames and the forces of a step, against each other and against known answers."""

import numpy as np
import pytest

import counterpoint as cp


def test_dynamics_are_each_others_oracles(load):
    scene = load("humanoid_drop")
    model, rng = scene.model, np.random.default_rng(3)
    q = cp.integrate_configuration(model, scene.q, rng.standard_normal(model.nv), 0.3)
    v, a = rng.standard_normal((2, model.nv))
    data = cp.Data(model)
    tau = cp.rnea(model, q, v, a, data)
    # Round-off of sums over some 30 bodies; the condition number of M is about 1e4.
    assert np.allclose(cp.aba(model, q, v, tau, data=data), a, rtol=0, atol=1e-9)
    M = cp.crba(model, q, data)
    still = cp.rnea(model, q, v, np.zeros(model.nv), data)
    assert np.allclose(M @ a + still, tau, rtol=1e-10, atol=1e-10 * np.abs(tau).max())
    armature = 0.5 * v @ (model.armature * v)
    assert np.isclose(cp.kinetic_energy(model, q, v), 0.5 * v @ M @ v + armature, rtol=1e-12)
    back = cp.integrate_configuration(model, scene.q, cp.configuration_difference(model, scene.q, q), 1.0)
    assert np.allclose(back, q, rtol=0, atol=1e-13)  # round-off of exponential and logarithm
    out = np.empty((model.nv, model.nv))
    assert cp.crba(model, q, out=out) is out and np.array_equal(out, M)
    cp.compute_kinematics(model, data, q, v)
    assert not {"rotation", "translation", "X_WB"} & set(dir(data))  # links have pose, frame_motion
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


def test_the_forces_of_the_last_step(load):
    scene = load("cube_drop")
    sim = cp.Simulator(scene)
    with pytest.raises(cp.InputError, match="step"):
        sim.last_forces()
    sim.advance(1000)
    forces = sim.last_forces()
    weight = 9.80665 * cp.total_mass(scene.model)
    # At rest, to the solver tolerance over h.
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
            # The slip is tangential and opposes the force; 1e-9 is the solver tolerance over h.
            assert abs(contact.slip @ contact.normal) <= 1e-12
            assert contact.slip @ contact.force <= 1e-9 * forces.force_scale
        for effect, index, force in forces.joint_forces:
            assert effect == "limits" and 0 <= index < scene.model.nv and np.isfinite(force)
            limits += force != 0.0
    assert limits > 0  # knees and elbows reach their limits


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
        # Differences: round-off 1e-16 / step, plus step^2 at speeds of some m/s.
        assert np.allclose(found.angular_velocity, [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)
        assert np.allclose(found.velocity, rate[:3, 3], atol=1e-8)
        motion = data.jacobian(frame.name) @ sim.v  # sums over some ten joints
        assert np.allclose(motion, np.r_[found.angular_velocity, found.velocity], rtol=0, atol=1e-13)
    other = cp.frame_motion(scene.model, sim.state, frame.name)
    assert np.array_equal(other.velocity, found.velocity)
    with pytest.raises(KeyError, match=f"did you mean '{frame.name}'"):
        sim.frame(frame.name + "x")


def test_contact_problems_there_and_back():
    rng = np.random.default_rng(7)
    half = rng.standard_normal((6, 6))
    A, c, mu = half @ half.T, rng.standard_normal(6), [0.5, 0.9]
    for coulomb in (False, True):
        s = cp.contact.solve_contact_space(A, c, mu, coulomb=coulomb)
        f, back = cp.contact.invert_contact_space(A, s.v, mu, coulomb=coulomb)
        assert s.succeeded and np.array_equal(f, s.f)
        # f depends on v through the law, which divides the round-off 1e-16 of v by the compliance 1e-8; times ten.
        assert np.abs(back - c).max() < 1e-7 * (np.abs(c) + np.abs(A) @ np.abs(f)).max()
