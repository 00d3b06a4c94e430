"""Names, exceptions, and typical first calls."""

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
    # An inverse recovers forces to this share of the largest force (docs/explanation/concepts.md).
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
    """Identification recovers the friction of 0.3 with which the recording was simulated."""
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
    assert found.parameters[0].value == pytest.approx(0.3, rel=0.05)  # one bounce, objective with kinks
    assert cp.recordings.parameter_values(found.scene, "friction")["friction"] == pytest.approx(found.parameters[0].value)

    explained = cp.recordings.identify(scene, columns, recorded, "friction=0.1..0.6", objective="explain")
    assert explained.parameters[0].value == pytest.approx(0.3, rel=0.05)
    with pytest.raises(ValueError, match="'explain'"):
        cp.recordings.identify(scene, columns, recorded, "friction", objective="explained")


def test_joint_forces_tell_a_damping_and_a_sum_of_masses(load, tmp_path):
    """A slow straight pendulum, of which only the shoulder's torque is known, tells upper + 3 lower."""
    scene = load("double_pendulum")
    made = cp.recordings.with_settings(scene, "damping:shoulder=0.5")
    model, h = made.model, 0.01
    options = made.options
    options.time_step = h
    rows = []
    for k in range(1000):
        turn = 0.1 * h * k
        u = cp.step_inverse(model, options, [turn, 0.0], [0.1, 0.0], [0.1, 0.0]).applied_force
        rows.append((h * k, turn, 0.0, u[0] + 0.01 * np.sin(37.0 * k)))
    file = tmp_path / "slow.csv"
    file.write_text("t,a,b,u\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows))
    mapped = tmp_path / "map.yaml"
    mapped.write_text("time: t\ncolumns: {shoulder.q: a, elbow.q: b, shoulder.u: u}\n")
    columns = cp.recordings.load_column_map(mapped, model)
    recorded = cp.recordings.read_recordings([file], columns, scene)
    found = cp.recordings.identify(scene, columns, recorded, "damping:shoulder,mass:upper,mass:lower", objective="torque")
    assert found.parameters[0].value == pytest.approx(0.5, abs=0.05)
    assert len(found.untold) == 1 and "is told: 4 kg" in found.untold[0] or "is told: 1.33" in found.untold[0]
    assert len(found.spectrum) == 3 and found.spectrum[0] > found.spectrum[2]



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


def test_effects_are_taken_from_any_iterable(load):
    options = load("cube_drop").options
    options.effects = options.effects - {"gravity"}
    assert "gravity" not in options.effects and "contacts" in options.effects
    options.effects = (name for name in ("gravity", "contacts"))
    assert options.effects == {"gravity", "contacts"}
    with pytest.raises(ValueError, match="gravitation"):
        options.effects = ["gravitation"]


def test_what_is_no_array_says_so_and_nothing_is_a_batch(load):
    scene = load("pendulum")
    for wrong in (lambda: cp.rollout(scene, "x", steps=1), lambda: cp.rollout(scene, [scene.state()], "x"),
                  lambda: cp.State(scene.model, "x"), lambda: cp.collision.overlap(cp.Shape.sphere(1), "x", cp.Shape.plane(), None)):
        with pytest.raises(ValueError, match="could not convert string"):
            wrong()
    assert len(cp.rollout(scene, [], steps=3)) == 0
    with pytest.raises(IndexError, match="there are 1"):
        cp.rollout(scene, [scene.state()], steps=1).end(4)
