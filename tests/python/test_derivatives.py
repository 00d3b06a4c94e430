"""Derivatives of steps against differences of steps computed in Python."""

import numpy as np
import pytest

import counterpoint as cp


@pytest.mark.parametrize("name", ["double_pendulum", "arm7"])
def test_forward_derivatives_are_those_of_the_steps(load, name):
    scene = load(name)
    model, rng = scene.model, np.random.default_rng(5)
    nv = model.nv
    q, v = scene.q + 0.1, 0.1 * rng.standard_normal(nv)
    workspace = cp.Workspace(model)

    def step(dq, dv, du):
        state = cp.State(model, cp.integrate_configuration(model, q, dq, 1.0), v + dv)
        end, report = cp.step_forward(model, scene.options, state, cp.Input(model, du), workspace=workspace)
        assert report
        return end.v

    zero = np.zeros(nv)
    found = cp.step_forward_derivatives(model, scene.options, q, v, step(zero, zero, zero), known=cp.Input(model))
    assert found.dv_dq.shape == (nv, nv)
    size = 1e-5  # central differences: truncation 1e-10 of the third derivative, round-off 1e-16 / 1e-5
    for i in range(nv):
        d = np.zeros(nv)
        d[i] = size
        for column, ends in (
            (found.dv_dq[:, i], (step(d, zero, zero), step(-d, zero, zero))),
            (found.dv_dv[:, i], (step(zero, d, zero), step(zero, -d, zero))),
            (found.dv_du[:, i], (step(zero, zero, d), step(zero, zero, -d))),
        ):
            wanted = (ends[0] - ends[1]) / (2 * size)
            assert np.abs(column - wanted).max() < 1e-6 * max(1.0, np.abs(wanted).max())


def test_inverse_derivatives_agree_with_differences(load):
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    sim.advance(20)  # in flight
    before = sim.state.copy()
    sim.step()
    given = (sim.model, scene.options, before.q, before.v, sim.v)
    inverse, exact = cp.step_inverse_derivatives(*given)
    _, near = cp.step_inverse_derivatives(*given, method="extrapolated")
    assert inverse.fault is None
    for name in ("dq", "dv", "dv_next"):
        a, b = getattr(exact, name), getattr(near, name)
        # Error of the differences; in flight, forces depend on q through round-off only.
        assert a.base is not None and np.abs(a - b).max() < 1e-5 * np.abs(b).max() + 1e-9
    with pytest.raises(ValueError, match="'analytic'"):
        cp.step_inverse_derivatives(*given, method="guess")


def moving(load, name, seed=11):
    """Returns a scene and a random q, v, a of its model."""
    scene = load(name)
    rng = np.random.default_rng(seed)
    nv = scene.model.nv
    q = cp.integrate_configuration(scene.model, scene.q, 0.3 * rng.standard_normal(nv), 1.0)
    return scene, q, rng.standard_normal(nv), rng.standard_normal(nv)


def columns(function, model, q, v, a, size=1e-6):
    """Central differences of function(q, v, a) by displacements of q, by v and by a; relative error about 1e-10."""
    out = []
    for which in range(3):
        found = []
        for i in range(model.nv):
            ends = []
            for sign in (1.0, -1.0):
                d = np.zeros(model.nv)
                d[i] = sign * size
                if which == 0:
                    ends.append(function(cp.integrate_configuration(model, q, d, 1.0), v, a))
                else:
                    ends.append(function(q, v + d * (which == 1), a + d * (which == 2)))
            found.append((ends[0] - ends[1]) / (2 * size))
        out.append(np.stack(found, axis=1))
    return out


@pytest.mark.parametrize("name", ["arm7", "humanoid_drop"])
def test_derivatives_of_dynamics_are_those_of_rnea_and_aba(load, name):
    scene, q, v, a = moving(load, name)
    model = scene.model
    found = cp.rnea_derivatives(model, q, v, a)
    wanted = columns(lambda *x: cp.rnea(model, *x), model, q, v, a)
    for one, other in zip((found.dq, found.dv, found.da), wanted):
        assert np.abs(one - other).max() < 1e-6 * np.abs(other).max()
    tau = cp.rnea(model, q, v, a)
    found = cp.aba_derivatives(model, q, v, tau, diagonal=model.armature)
    wanted = columns(lambda *x: cp.aba(model, *x, diagonal=model.armature), model, q, v, tau)
    for one, other in zip((found.dq, found.dv, found.dtau), wanted):
        assert np.abs(one - other).max() < 1e-6 * np.abs(other).max()


def test_forces_are_linear_in_inertial_parameters(load):
    scene, q, v, a = moving(load, "humanoid_drop")
    model = scene.model
    parameters = cp.inertial_parameters(model)
    assert parameters.shape == (10 * (model.num_bodies - 1),) and parameters[::10].sum() == pytest.approx(cp.total_mass(model))
    Y = cp.inertia_regressor(model, q, v, a)
    tau = cp.rnea(model, q, v, a)
    assert np.abs(Y @ parameters - tau).max() < 1e-12 * np.abs(tau).max()  # sums of 300 numbers
    out = np.empty_like(Y)
    assert cp.inertia_regressor(model, q, v, a, out=out) is out and np.array_equal(out, Y)


def test_batches_of_derivatives_have_the_bits_of_single_ones(load):
    scene = load("humanoid_drop")
    motion = cp.Simulator(scene).run(steps=300)
    rows = [10, 280, 290, 299]  # in flight, and on the ground
    states = np.hstack([motion.q[rows], motion.v[rows]])
    v_next = motion.v[[k + 1 for k in rows]]
    batch = cp.Batch(scene, num_threads=2)
    many = batch.inverse_derivatives(states, v_next)
    inverse, forward = batch.forward_derivatives([motion.state(k) for k in rows], v_next)
    assert len(many) == len(forward) == 4 and inverse is not None and not many.by_differences.any()
    for i, k in enumerate(rows):
        given = (scene.model, scene.options, motion.q[k], motion.v[k], motion.v[k + 1])
        one, derivatives = cp.step_inverse_derivatives(*given)
        assert np.array_equal(many.applied_force[i], one.applied_force)
        for name in ("dq", "dv", "dv_next"):
            assert np.array_equal(getattr(many, name)[i], getattr(derivatives, name))
            assert np.array_equal(getattr(inverse, name)[i], getattr(derivatives, name))
        ahead = cp.step_forward_derivatives(*given)
        for name in ("dv_dq", "dv_dv", "dv_du", "dq_dq", "dq_dv", "dq_du"):
            assert np.array_equal(getattr(forward, name)[i], getattr(ahead, name))
    with pytest.raises(ValueError, match="v_next: expected shape"):
        batch.inverse_derivatives(states, v_next[:2])


def test_derivatives_by_parameters_are_those_of_other_models(load):
    """Derivatives by a joint's damping and a link's mass, against models with other values."""

    def arm(damping, mass):
        links = [cp.LinkSpec("base")]
        links += [cp.LinkSpec(n, cp.Shape.box(0.1, 0.1, 1).inertia(m)) for n, m in (("upper", 2.0), ("lower", mass))]
        joints = [
            cp.JointSpec("shoulder", "revolute", "base", "upper", axis=(0, 1, 0)),
            cp.JointSpec("elbow", "revolute", "upper", "lower", pose=(0, 0, -1), axis=(0, 1, 0), damping=damping),
        ]
        builder = cp.ModelBuilder()
        builder.add_robot(cp.RobotSpec("arm", links, joints))
        return builder.build()

    options = cp.SimulationOptions(time_step=1e-3)
    q, v, v_next = [0.3, -0.7], [0.5, 1.5], [0.52, 1.4]
    model = arm(0.2, 1.0)
    parameters = [cp.StepParameter(model, "damping", ["elbow.v"]), cp.mass_parameter(model, "lower"),
                  cp.StepParameter(model, "gravity")]
    assert parameters[0].kind == "damping" and parameters[0].targets == [1]
    derivator = cp.ParameterDerivator(model, parameters)
    inverse, found = derivator.inverse(options, q, v, v_next)
    assert found.du.shape == (2, 3) and found.by_differences == [False] * 3

    def force(damping, mass):
        return cp.step_inverse(arm(damping, mass), options, q, v, v_next).applied_force.copy()

    size = 1e-4  # forces are linear in both, so only round-off remains: 1e-15 * 1e3 / 1e-4
    assert np.array_equal(inverse.applied_force, force(0.2, 1.0))
    by_damping = (force(0.2 + size, 1.0) - force(0.2 - size, 1.0)) / (2 * size)
    by_mass = (force(0.2, 1.0 + size) - force(0.2, 1.0 - size)) / (2 * size)
    assert np.abs(found.du[:, 0] - by_damping).max() < 1e-8
    assert np.abs(found.du[:, 1] - by_mass).max() < 1e-8 * np.abs(by_mass).max()
    forward = cp.step_forward_derivatives(model, options, q, v, v_next)
    dv, dq = cp.forward_parameter_derivatives(forward, found.du)
    assert np.allclose(dv, -forward.dv_du @ found.du, rtol=1e-14) and dq.shape == (2, 3)
    assert len(cp.inertial_step_parameters(model)) == 20
    with pytest.raises(KeyError, match="elbow"):
        cp.StepParameter(model, "damping", ["elbo.v"])
    with pytest.raises(ValueError, match="no targets"):
        cp.StepParameter(model, "gravity", [0])
    with pytest.raises(ValueError, match="'inertia'"):
        cp.StepParameter(model, "weight")
    with pytest.raises(ValueError, match="another model"):
        cp.ParameterDerivator(arm(0.2, 1.0), parameters)
