"""Plans made anew from Python drive a robot as the command does."""

import numpy as np
import pytest

import counterpoint as cp

opt = cp.optimization


@pytest.fixture
def control(scenes):
    return opt.load_control(scenes / "control" / "quadruped_walk.yaml")


def walk(control, planner, steps):
    sim = cp.Simulator(control.world)
    every = round(control.interval / control.world.options.time_step)
    for step in range(steps):
        if step % every == 0:
            planner.replan(sim.time, sim.q, sim.v)
        sim.input.applied_force[:] = planner.force(sim.time, control.gains, sim.q, sim.v)
        sim.step()
    return sim


def test_the_loop_is_that_of_the_command(command, control, scenes, tmp_path):
    """The same calls of the same library: equal to the bit."""
    motion = tmp_path / "walk.csv"
    file = scenes / "control" / "quadruped_walk.yaml"
    command("control", file, "--duration", 0.1, "--output", motion, exit_code=1)  # its success tests ask for 20 s
    theirs = cp.read_trajectory(motion, control.world.model)
    sim = walk(control, opt.Planner(control.problem, control.settings), 100)
    assert np.array_equal(sim.q, theirs.q[-1]) and np.array_equal(sim.v, theirs.v[-1])


def test_a_plan_can_be_read(control):
    planner = opt.Planner(control.problem, control.settings)
    world = control.world
    report = planner.replan(1.0, world.q, world.v)
    assert report.iterations > 0 and report.cost > 0.0 and not report.restarted
    frames = planner.frames
    assert frames.shape == (control.problem.steps + 1, world.model.nq) and planner.time == 1.0
    np.testing.assert_allclose(frames[0], world.q, atol=1e-15)  # lifted into the plan and back
    q, v, force = planner.sample(1.0 + 2 * control.problem.time_step)
    np.testing.assert_allclose(q, frames[2], atol=1e-12)  # the time between frames is rounded
    assert v.shape == force.shape == (world.model.nv,)
    q, v, _ = planner.sample(100.0)
    assert np.array_equal(q, frames[-1]) and not v.any()
    planner.forget()
    again = planner.replan(1.0, world.q, world.v)
    assert again.iterations == report.iterations


def test_a_target_is_a_command(control):
    """In a second a robot told to walk goes at least 0.15 m (0.4 m at full speed), one told to stand stays."""
    ways = []
    for target in ({"trunk.vx": 0.415}, 0.0):
        planner = opt.Planner(control.problem, control.settings)
        planner.set_target("speed", target)
        ways.append(walk(control, planner, 1000).state["trunk.x"])
    assert ways[0] > 0.15 and abs(ways[1]) < 0.05


def test_wrong_arguments_say_what_was_expected(control, scenes):
    planner = opt.Planner(control.problem)
    q, v = control.world.q, control.world.v
    with pytest.raises(ValueError, match=r"q: expected shape \(19,\), found \(3,\)"):
        planner.replan(0.0, [0.0, 0.0, 0.0], v)
    with pytest.raises(ValueError, match="v: expected finite numbers"):
        planner.replan(0.0, q, np.full(18, np.nan))
    with pytest.raises(ValueError, match=r"gains: expected stiffness and damping of shape \(18,\)"):
        planner.force(0.0, opt.FeedbackGains([1.0], [1.0]), q, v)
    with pytest.raises(KeyError, match="did you mean 'speed'"):
        planner.set_target("sped", 0.0)
    with pytest.raises(cp.InputError, match="the key 'control' is missing"):
        opt.load_control(scenes / "optimize" / "acrobot.yaml")
    with pytest.raises(FileNotFoundError):
        opt.load_control("nowhere.yaml")
