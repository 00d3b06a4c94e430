"""A million calls leak no memory."""

import resource

import pytest

import counterpoint as cp

CALLS = 1_000_000
# The arenas of malloc and of Python's allocator settle within this; a leak of 16 bytes per call would be 16 MB.
BOUND = 8 * 1024  # [KiB]


def resident():
    """Current resident memory [KiB]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 1024


@pytest.mark.parametrize("what", ["step", "array", "name", "state", "report", "error", "forces", "derivatives", "rollout", "failure"])
def test_nothing_leaks(load, what):
    scene = load("pendulum")
    sim, model, state = cp.Simulator(scene), scene.model, scene.state()
    name = state.coordinates.q[0]
    sim.input.applied_force[0] = 0.1

    def missing():
        try:
            state["nothing"]
        except KeyError:
            pass

    def failing():
        try:
            broken.run(steps=2)
        except cp.StepError:
            pass

    broken = cp.Simulator(scene)
    broken.input.applied_force[0] = float("nan")
    sim.step()
    batch, states = cp.Batch(scene, num_threads=1), [state]
    call, count = {
        "step": (lambda: sim.step(), CALLS),
        "array": (lambda: sim.state.q, CALLS),
        "name": (lambda: model.joint(0).name, CALLS),
        "state": (lambda: state.copy().q, CALLS // 4),
        "report": (lambda: cp.step_forward(model, scene.options, state, next=state, workspace=workspace), CALLS // 4),
        "error": (missing, CALLS // 10),
        "forces": (lambda: sim.last_forces().contacts, CALLS // 10),
        "derivatives": (lambda: cp.rnea_derivatives(model, [0.1], [0.2], [0.3]).dq, CALLS // 10),
        "rollout": (lambda: batch.rollout(states, steps=1).q, CALLS // 100),
        "failure": (failing, CALLS // 20),
    }[what]
    workspace = cp.Workspace(model)
    for _ in range(count // 10):
        call()
    before = resident()
    for _ in range(count):
        call()
    assert resident() - before < BOUND, name
