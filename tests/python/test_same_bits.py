"""The module gives the same bits as the C++ command."""

import json

import numpy as np
import pytest

import counterpoint as cp


def report(command, tmp_path, *arguments):
    file = tmp_path / "report.json"
    command(*arguments, "--json", file)
    return json.loads(file.read_text())


@pytest.mark.parametrize("name", ["pendulum", "cube_drop", "humanoid_drop", "arm7_servo", "closures"])
def test_a_run_is_that_of_simulate(command, scenes, load, tmp_path, name):
    theirs, ours = tmp_path / "theirs.csv", tmp_path / "ours.csv"
    command("simulate", scenes / f"{name}.yaml", "--duration", 0.4, "--output", theirs)
    sim = cp.Simulator(load(name))
    sim.run(0.4).write(ours)
    assert ours.read_bytes() == theirs.read_bytes()


def test_a_written_step_by_step_trajectory_is_that_of_simulate(command, scenes, load, tmp_path):
    theirs, ours = tmp_path / "theirs.csv", tmp_path / "ours.csv"
    command("simulate", scenes / "cube_drop.yaml", "--duration", 0.2, "--output", theirs)
    scene = load("cube_drop")
    sim = cp.Simulator(scene)
    writer = cp.TrajectoryWriter(ours, scene.model)
    for _ in range(round(0.2 / scene.options.time_step)):
        before = sim.state.copy()
        step = sim.step()
        writer.write_step(before, sim.input, scene.options.time_step, step.softening)
    writer.write_end(sim.state)
    assert ours.read_bytes() == theirs.read_bytes()


def test_controlled_steps_are_those_of_simulate(command, scenes, load, tmp_path):
    theirs, ours = tmp_path / "theirs.csv", tmp_path / "ours.csv"
    command("simulate", scenes / "cube_drop.yaml", "--duration", 0.3, "--adaptive", 1e-2, "--output", theirs)
    scene = load("cube_drop")
    scene.options.step_control = cp.StepControlOptions(tolerance=1e-2)
    cp.Simulator(scene).run(0.3).write(ours)
    assert ours.read_bytes() == theirs.read_bytes()


def test_steps_one_by_one_are_advance_and_step_forward(load):
    scene = load("humanoid_drop")
    one, many = cp.Simulator(scene), cp.Simulator(scene)
    workspace, state = cp.Workspace(scene.model), scene.state()
    for _ in range(100):
        one.step()
        _, step = cp.step_forward(scene.model, scene.options, state, workspace=workspace, next=state)
        assert step
    many.advance(100)
    assert one.state == many.state
    assert one.state.hash == state.hash


def test_rollouts_are_those_of_the_command_and_one_by_one(command, scenes, load, tmp_path):
    theirs = report(command, tmp_path, "rollout", scenes / "humanoid_drop.yaml", "--count", 2, "--duration", 0.2)
    scene = load("humanoid_drop")
    steps = round(0.2 / scene.options.time_step)
    result = cp.rollout(scene, [scene.state(), scene.state()], steps=steps)
    for i, their in enumerate(theirs["results"]):
        assert str(result.end(i).hash) == their["state_hash"]


def test_an_inverse_is_that_of_the_command(command, scenes, load, tmp_path):
    motion, forces = tmp_path / "motion.csv", tmp_path / "forces.csv"
    path = scenes / "arm7.yaml"
    command("simulate", path, "--duration", 0.2, "--random-inputs", 0.5, "--output", motion)
    command("inverse", path, motion, "--output", forces)
    theirs = np.genfromtxt(forces, delimiter=",", names=True, deletechars="")
    scene = load("arm7")
    trajectory = cp.read_trajectory(motion, scene)
    workspace = cp.Workspace(scene.model)
    for k in range(trajectory.num_steps):
        inverse = cp.step_inverse(
            scene.model,
            scene.options,
            trajectory.q[k],
            trajectory.v[k],
            trajectory.v[k + 1],
            q_next=trajectory.q[k + 1],
            known=trajectory.input(k),
            workspace=workspace,
        )
        for i, name in enumerate(scene.model.coordinates.force):
            assert inverse.applied_force[i] == theirs[name][k]


def test_states_go_on_to_the_same_bits(command, scenes, load, tmp_path):
    """States are saved by the command, read and stepped here, and the other way round."""
    path, saved = scenes / "humanoid_drop.yaml", tmp_path / "state.csv"
    command("simulate", path, "--duration", 0.3, "--save-state", saved)
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    sim.run(0.3)
    assert cp.read_state(saved, scene) == sim.state
    ours = tmp_path / "ours.csv"
    cp.write_state(ours, scene, sim.state)
    assert ours.read_bytes() == saved.read_bytes()


def test_contact_problems_are_those_of_the_command(command, tmp_path):
    rng = np.random.default_rng(1)
    half = rng.standard_normal((9, 9))
    A, c, mu = half @ half.T, rng.standard_normal(9), np.array([0.3, 0.7, 1.2])
    rows = [f"{i},{j},{float(A[i, j])!r}" for i in range(9) for j in range(9)]
    (tmp_path / "W.csv").write_text("row,col,value\n" + "\n".join(rows) + "\n")
    rows = [f"{float(a)!r},{float(b)!r},{float(d)!r},{float(m)!r}" for (a, b, d), m in zip(c.reshape(3, 3), mu)]
    (tmp_path / "q_mu.csv").write_text("q_n,q_t1,q_t2,mu\n" + "\n".join(rows) + "\n")
    for their in report(command, tmp_path, "contact-problem", tmp_path)["problems"]:
        coulomb = their["friction_model"] == "coulomb"
        ours = cp.contact.solve_contact_space(A, c, mu, coulomb=coulomb)
        assert ours.iterations == their["iterations"] and ours.rank == their["rank"]
        symmetric = 0.5 * (A + A.T)
        found = cp.contact.contact_space_residuals(symmetric, c, mu, ours.f, coulomb)
        assert found == (their["primal"], their["dual"], their["complementarity"])


def test_predictions_are_those_of_compare(command, load, scenes, tmp_path):
    shared = scenes.parents[1] / ".." / "shared" / "data" / "cube_toss"
    files = sorted(shared.resolve().glob("*.csv"))[:2] if shared.exists() else []
    if not files:
        pytest.skip("no recordings: ../shared/data/cube_toss is missing")
    maps = scenes.parent / "maps" / "cube_toss.yaml"
    theirs = report(command, tmp_path, "compare", scenes / "cube_toss.yaml", *files, "--columns", maps)
    scene = load("cube_toss")
    columns = cp.recordings.load_column_map(maps, scene.model)
    found = cp.recordings.predict(scene, columns, cp.recordings.read_recordings(files, columns, scene))
    for their, our in zip(theirs["recordings"], found):
        for name, value in our.figures(columns).items():
            assert their[name] == value


def test_motion_estimates_are_those_of_explain(command, load, scenes, tmp_path):
    scene = load("cube_drop")
    motion = tmp_path / "motion.csv"
    report(command, tmp_path, "simulate", scenes / "cube_drop.yaml", "--duration", "0.4", "--timestep", "0.01",
           "--output", motion)
    rows = motion.read_text().splitlines()
    names = rows[0].split(",")
    height = names.index("cube.z")
    noisy = [rows[0]]
    for k, row in enumerate(rows[1:]):  # alternates by a millimetre
        cells = row.split(",")
        cells[height] = repr(float(cells[height]) + (1e-3 if k * 7 % 3 == 0 else -5e-4))
        noisy.append(",".join(cells))
    recording = tmp_path / "noisy.csv"
    recording.write_text("\n".join(noisy) + "\n")
    columns = tmp_path / "map.yaml"
    columns.write_text("time: time\ncolumns:\n" + "".join(
        f"  cube.{c}: cube.{c}\n" for c in ("x", "y", "z", "qw", "qx", "qy", "qz"))
        + "deviations: {cube.x: 0.02, cube.y: 0.02, cube.z: 0.02, cube.qw: 0.1}\n")
    theirs = report(command, tmp_path, "explain", scenes / "cube_drop.yaml", recording, "--columns", columns,
                    "--errors", "white")["recordings"][0]
    read = cp.recordings.load_column_map(columns, scene.model)
    ours = cp.recordings.estimate_motion(scene, read, cp.recordings.read_recordings([recording], read, scene)[0],
                                         errors="white")
    assert ours["errors"] == theirs["errors"] == "white"
    assert ours["cost_ratio"] == theirs["cost_ratio"]
    assert ours["unexplained_mean"] == theirs["unexplained_mean"]
    assert ours["force"].shape == (len(rows) - 1, scene.model.nv)
    assert np.isnan(ours["force"][0]).all() and np.isfinite(ours["force"][1:-1]).all()
    with pytest.raises(ValueError, match="white"):
        cp.recordings.estimate_motion(scene, read, cp.recordings.read_recordings([recording], read, scene)[0],
                                      errors="pink")
