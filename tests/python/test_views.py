"""Arrays are views: they see changes, keep their owner alive, and are writable where C++ allows it."""

import copy
import gc
import pickle

import numpy as np
import pytest

import counterpoint as cp


def test_a_simulators_arrays_show_every_step(load):
    sim = cp.Simulator(load("cube_drop"))
    q, z = sim.state.q, sim.q[2:3]
    before = q.copy()
    for _ in range(3):  # odd and even: no swapped buffer
        sim.step()
        assert np.shares_memory(q, sim.state.q) and q[2] == z[0] == sim.state["cube.z"]
    assert q[2] < before[2]
    sim.reset()
    assert np.array_equal(q, before)


def test_a_simulators_state_is_set_as_a_whole(load):
    sim = cp.Simulator(load("cube_drop"))
    with pytest.raises(ValueError, match="read-only"):
        sim.state.q[2] = 3.0
    with pytest.raises(ValueError, match="copy"):
        sim.state["cube.z"] = 3.0
    with pytest.raises(ValueError):
        sim.q.flags.writeable = True
    state = sim.state.copy()
    state["cube.z"] = 3.0
    sim.state = state
    assert sim.q[2] == 3.0 and sim.state["cube.z"] == 3.0


def test_states_and_inputs_are_written_through_their_arrays(load):
    scene = load("pendulum")
    state = scene.state()
    state.q[0] = 0.25
    name = state.coordinates.q[0]
    assert state[name] == 0.25
    state[name] = 0.5
    assert state.q[0] == 0.5
    q = state.q
    state.q = [0.75]  # writes into the same memory
    assert q[0] == 0.75
    sim = cp.Simulator(scene)
    sim.input.applied_force[0] = 1.0
    force = sim.model.coordinates.force[0]
    assert sim.input[force] == 1.0
    still = cp.Simulator(scene)
    sim.step()
    still.step()
    assert sim.v[0] != still.v[0]


def test_closures_switch_by_their_input(load):
    scene = load("suction_gripper")
    sim = cp.Simulator(scene)
    switch = scene.model.closures.index("grip light")
    assert np.isnan(sim.input.attach).all() and len(sim.input.attach) == 2
    sim.input["grip light.attach"] = 1.0
    assert sim.input.attach[switch] == 1.0
    sim.step()
    assert np.linalg.norm(sim.last_forces().closure_forces[switch]) > 1.0
    sim.input.attach[switch] = 0.0
    sim.step()
    assert not sim.last_forces().closure_forces[switch].any()


def test_prescribed_joints_follow_their_input(tmp_path):
    file = tmp_path / "moved.yaml"
    file.write_text("models:\n  - {box: [1, 1, 1], mass: 1, prescribed: true}\n")
    sim = cp.Simulator(cp.load_scene(file))
    assert np.isnan(sim.input.prescribed).all()
    sim.step()
    assert not sim.v.any()
    sim.input.prescribed = [0.1, 0, 0, 1, 0, 0, 0]
    sim.step()
    assert sim.q[0] == 0.1


def owners():
    """Arrays whose owners have no other references, and copies of their values."""
    scene = cp.load_scene("data/scenes/humanoid_drop.yaml")
    sim = cp.Simulator(scene)
    sim.advance(400)  # on the ground
    trajectory = sim.run(steps=5)
    inverse = sim.inverse(trajectory.q[3], trajectory.v[3], trajectory.v[4])
    mesh = cp.Shape.convex_hull(np.eye(3).tolist() + [[0, 0, 0]])
    arrays = [
        scene.q, scene.state().q, sim.state.q, sim.q, sim.input.applied_force, trajectory.q, trajectory.time,
        scene.model.default_q, scene.model.damping, scene.model.joint(0).default_q, scene.model.gravity,
        inverse.applied_force, inverse.contact_forces, mesh.vertices,
        cp.rollout(scene, [scene.state()], steps=2).q,
    ]
    return arrays, [a.copy() for a in arrays]


def test_arrays_outlive_their_owners(monkeypatch, scenes):
    monkeypatch.chdir(scenes.parents[1])
    arrays, copies = owners()
    gc.collect()
    for _ in range(20):  # would overwrite freed memory
        owners()
    for array, kept in zip(arrays, copies):
        assert array.base is not None and np.array_equal(array, kept)


def test_parts_outlive_their_model(load):
    joint = load("humanoid_drop").model.joints[-1]
    gc.collect()
    assert joint.body.joint.name == joint.name and joint.lower <= joint.upper


def test_what_is_the_models_is_read_only(load):
    model = load("humanoid_drop").model
    for array in (model.default_q, model.damping, model.gravity, model.joint(0).default_q):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_options_are_live(load):
    scene = load("cube_drop")
    scene.options.contact.compliance = 0.25
    options = scene.options
    del scene
    gc.collect()
    assert options.contact.compliance == 0.25
    options.step_control = cp.StepControlOptions(tolerance=1e-4)
    control = options.step_control
    control.tolerance = 1e-5
    assert options.step_control.tolerance == 1e-5
    sim = cp.Simulator(cp.load_scene(SCENE))
    sim.options.time_step = 1e-3
    sim.step()
    assert sim.time == 1e-3


SCENE = __file__.replace("tests/python/test_views.py", "data/scenes/cube_drop.yaml")


def test_states_are_pickled_to_the_bit(load):
    sim = cp.Simulator(load("humanoid_drop"))
    sim.advance(200)
    assert len(sim.state.memory) > 0
    twin = pickle.loads(pickle.dumps(sim.state))
    assert twin == sim.state and twin.q.flags.writeable and twin.keys() == sim.state.keys()
    assert copy.deepcopy(sim.state) == sim.state
    other = cp.Simulator(load("humanoid_drop"))
    other.state = twin
    sim.advance(50)
    other.advance(50)
    assert other.state == sim.state


@pytest.mark.parametrize("name", ["humanoid_drop", "terrain", "closures", "everything", "arm7_servo"])
def test_scenes_are_pickled_to_the_bit(load, name):
    scene = load(name)
    twin = pickle.loads(pickle.dumps(scene))
    assert twin.options == scene.options and twin.name == scene.name
    one, other = cp.Simulator(scene), cp.Simulator(twin)
    one.advance(30)
    other.advance(30)
    assert one.state == other.state


def test_damaged_scenes_are_refused(load):
    import counterpoint._core as core

    scene = load("cube_drop")
    (data,) = scene.__getstate__()
    for damaged in (data[:-1], b"", data[:100] + b"x" + data[101:]):
        with pytest.raises(cp.InputError, match="scene archive"):
            core.Scene.__new__(core.Scene).__setstate__((damaged,))
