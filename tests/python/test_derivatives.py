"""Derivatives of steps against differences of steps taken from Python."""

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
    size = 1e-5  # error of central differences about 1e-10 of the third derivative, rounding 1e-16 / 1e-5
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
        assert a.base is not None and np.abs(a - b).max() < 1e-5 * np.abs(b).max()  # of the differences
    with pytest.raises(ValueError, match="'analytic'"):
        cp.step_inverse_derivatives(*given, method="guess")
