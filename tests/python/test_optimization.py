"""Motions optimized from Python equal those of the command, and problems can be built without a file."""

import json
import os
import signal

import numpy as np
import pytest

import counterpoint as cp

opt = cp.optimization


@pytest.fixture
def acrobot(scenes):
    return opt.load_problem(scenes / "optimize" / "acrobot.yaml", steps=40)


def test_a_motion_is_that_of_the_command(command, scenes, tmp_path, acrobot):
    motion, report = tmp_path / "motion.csv", tmp_path / "report.json"
    file = scenes / "optimize" / "acrobot.yaml"
    command("optimize", file, "--frames", 40, "--output", motion, "--json", report, "--quiet")
    theirs = cp.read_trajectory(motion, acrobot.model)
    ours = opt.optimize(acrobot)
    assert ours.converged and ours.outcome == "converged"
    assert np.array_equal(ours.q, theirs.q) and np.array_equal(ours.applied_force, theirs.applied_force)
    said = json.loads(report.read_text())
    assert (ours.iterations, ours.cost) == (said["iterations"], said["cost"])
    found = opt.verify(ours)
    assert found.forward_check_max == said["forward_check_max"]
    assert found.unactuated_max == said["unactuated_force_relative_max"]
    ours.trajectory.write(tmp_path / "ours.csv")
    assert (tmp_path / "ours.csv").read_bytes() == motion.read_bytes()
    assert ours.trajectory.scene is not None and len(ours.history) == ours.iterations
    assert ours.cost_by_term["applied_force"] == pytest.approx(ours.cost, rel=1e-14)  # the only cost term


def test_seeds_give_the_same_start_twice(acrobot):
    assert np.array_equal(acrobot.seeded_guess(0), acrobot.guess)
    assert np.array_equal(acrobot.seeded_guess(3), acrobot.seeded_guess(3))
    assert not np.array_equal(acrobot.seeded_guess(3), acrobot.guess)


def test_a_problem_without_a_file_has_the_known_minimum(scenes):
    """One mass on a line from rest to rest: the force is linear in time, u_t = a + b t."""
    block = cp.LinkSpec("block", cp.Shape.box(0.1, 0.1, 0.1).inertia(2.0))
    slide = cp.JointSpec("slide", "prismatic", "base", "block", axis=(1, 0, 0))
    builder = cp.ModelBuilder(gravity=(0, 0, 0))
    builder.add_robot(cp.RobotSpec("slider", [cp.LinkSpec("base"), block], [slide]))
    h, steps = 0.05, 20
    scene = cp.Scene(builder.build(), options=cp.SimulationOptions(time_step=h), name="slider")
    problem = opt.Problem(scene, steps, goal_q=[1.0])
    problem.add_term("applied_force", weight=0.5)
    assert "applied_force" in problem.terms and problem.motors.tolist() == [True]
    result = opt.optimize(problem)
    assert result.converged and result.q[0, 0] == 0.0 and result.q[-1, 0] == 1.0
    u = result.applied_force[:, 0]
    # Expected forces: least squares under two linear conditions (distance, and speed at the end).
    t = np.arange(steps)
    speed = np.ones(steps) * h / 2.0  # effect of a unit force on the last velocity
    distance = (steps - t) * h * h / 2.0  # and on the last position, semi-implicit
    wanted = np.linalg.lstsq(np.vstack([speed, distance]), np.array([0.0, 1.0]), rcond=None)[0]
    # The problem is linear least squares; its end conditions hold to round-off, since the ends are fixed.
    assert np.abs(u - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert result.cost == pytest.approx(0.5 * 0.25 * (wanted @ wanted), rel=1e-9)


def test_terms_take_names_numbers_and_arrays(acrobot):
    nv = acrobot.model.nv
    before = len(acrobot.terms)
    acrobot.add_term("velocity", weight={"elbow.v": 2.0}, name="slow elbow")
    acrobot.add_term("velocity", weight=np.ones(nv), target=0.5, frames=(3, -2))
    link = acrobot.model.frames[-1].name
    acrobot.add_term("position", weight=0.1, target=[0, 0, 1], link=link, point=(0, 0, 0.1))
    assert len(acrobot.terms) == before + 3 and "slow elbow" in acrobot.terms
    with pytest.raises(KeyError, match="coordinate"):
        acrobot.add_term("velocity", weight={"nobody": 1.0})
    with pytest.raises(KeyError, match="frame"):
        acrobot.add_term("position", link="nobody")
    with pytest.raises(ValueError, match="applied_force"):
        acrobot.add_term("speed")
    with pytest.raises(ValueError, match=r"weight: expected shape"):
        acrobot.add_term("velocity", weight=np.ones(nv + 1))
    with pytest.raises(FileNotFoundError, match="nothing.yaml"):
        opt.load_problem("nothing.yaml")
    with pytest.raises(cp.InputError, match="steps"):
        opt.Problem(acrobot.scene, 1)


def test_a_run_stops_when_told_to(acrobot):
    seen = []

    def three(progress):
        seen.append((progress.iteration, progress.cost))
        return len(seen) < 3

    result = opt.optimize(acrobot, progress=three)
    assert result.outcome == "stopped" and len(seen) == 3 and result.q.shape == (41, acrobot.model.nq)
    more = opt.optimize(acrobot, result.q)
    assert more.outcome in ("converged", "infeasible", "iterations")


def test_interrupts_and_errors_keep_the_motion(acrobot):
    def interrupt(progress):
        if progress.iteration == 4:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as stopped:
        opt.optimize(acrobot, progress=interrupt)
    assert stopped.value.partial.outcome == "stopped" and len(stopped.value.partial.history) >= 4

    def broken(progress):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine") as error:
        opt.optimize(acrobot, progress=broken)
    assert error.value.partial.iterations == 1


def test_feedback_brings_back_what_was_pushed(scenes):
    """The acrobot's swing from a perturbed start: ends near the plan with feedback gains, not without."""
    problem = opt.load_problem(scenes / "optimize" / "acrobot.yaml")
    result = opt.optimize(problem)
    feedback = opt.compute_feedback(result)
    nv, steps = problem.model.nv, problem.steps
    assert feedback.gains.shape == (steps, nv, 2 * nv) and feedback.missing == 0
    once = opt.repeated(result, 1, feedback)
    assert np.array_equal(once.q, result.q) and np.array_equal(once.gains, feedback.gains)
    apart = []
    for gains in (feedback.gains, np.zeros_like(feedback.gains)):
        sim = cp.Simulator(problem.scene)
        sim.state = cp.State(problem.model, result.q[0] + 1e-3, result.v[0])
        for t in range(steps):
            plan = (result.q[t], result.v[t], result.applied_force[t])
            sim.input.applied_force = opt.following_force(problem.model, *plan, gains[t], sim.q, sim.v)
            sim.step()
        apart.append(np.abs(sim.q - result.q[-1]).max())
    # A double pendulum is stable when hanging and unstable when upright, where the deviation grows by hundreds. The
    # regulator has one second and one motor to reduce it.
    assert apart[0] < 0.1 * apart[1]
