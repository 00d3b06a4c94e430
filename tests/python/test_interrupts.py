"""A call that fails or is interrupted keeps the results so far."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import counterpoint as cp


@pytest.fixture
def ctrl_c():
    """Sends SIGINT to this process after a while; Python's own handler raises KeyboardInterrupt in the main
    thread."""
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    timers = []

    def later(seconds):
        timers.append(threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)))
        timers[-1].start()

    yield later
    for timer in timers:
        timer.join()


def test_a_run_that_fails_keeps_its_motion(load):
    scene = load("cube_drop")
    forces = np.zeros((6, scene.model.nv))
    forces[4, 0] = np.nan
    sim = cp.Simulator(scene)
    with pytest.raises(cp.StepError, match="cube.fx") as error:
        sim.run(inputs=forces)
    partial = error.value.partial
    assert partial.num_steps == 4 and np.array_equal(partial.q[-1], sim.q) and sim.time == partial.time[-1]
    assert cp.Simulator(scene).run(inputs=forces[:4]).q.tobytes() == partial.q.tobytes()
    sim.reset()
    assert np.array_equal(sim.run(inputs=forces, check=False).q, partial.q)
    with pytest.raises(cp.StepError) as error:
        sim.input.applied_force[0] = np.nan
        sim.step()
    assert error.value.partial is None


def test_ctrl_c_ends_a_run_with_its_motion(load, ctrl_c):
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    ctrl_c(0.5)
    with pytest.raises(KeyboardInterrupt) as stopped:
        sim.run(1e5)
    motion = stopped.value.partial
    assert 0 < motion.num_steps < 1e7 and np.array_equal(motion.q[-1], sim.q)
    again = cp.Simulator(scene)
    again.advance(min(motion.num_steps, 200))
    assert np.array_equal(again.q, motion.q[min(motion.num_steps, 200)])
    sim.step()  # can continue


def test_ctrl_c_ends_controlled_steps_and_advance(load, ctrl_c):
    scene = load("humanoid_drop")
    sim = cp.Simulator(scene)
    ctrl_c(0.3)
    with pytest.raises(KeyboardInterrupt):
        sim.advance(10**9)
    assert sim.time > 0
    scene.options.step_control = cp.StepControlOptions(tolerance=1e-3)
    controlled = cp.Simulator(scene)
    ctrl_c(0.3)
    with pytest.raises(KeyboardInterrupt) as stopped:
        controlled.run(1e5)
    assert stopped.value.partial.time[-1] == controlled.time > 0


def test_ctrl_c_ends_a_rollout_with_its_states(load, ctrl_c):
    scene = load("humanoid_drop")
    count, steps = 4, 50_000
    out = np.empty((count, steps, scene.model.nq + scene.model.nv))
    ctrl_c(0.5)
    with pytest.raises(KeyboardInterrupt) as stopped:
        cp.rollout(scene, [scene.state()] * count, steps=steps, out=out, num_threads=2)
    partial = stopped.value.partial
    assert partial.states is out and partial.steps.sum() > 0
    for i in range(count):
        done = partial.steps[i]
        assert done < steps and np.isfinite(out[i, :done]).all() and np.isnan(out[i, done:]).all()
        assert partial.succeeded[i] and partial.end(i).time == pytest.approx(done * scene.options.time_step)
    short = cp.rollout(scene, [scene.state()], steps=min(100, int(partial.steps.max())))
    assert np.array_equal(short.states[0], out[int(partial.steps.argmax()), : short.states.shape[1]])


def test_ctrl_c_is_seen_soon(load, ctrl_c):
    """Reacts within a tenth of a second, plus a step, plus delays of a busy machine."""
    sim = cp.Simulator(load("pendulum"))
    start = time.monotonic()
    ctrl_c(0.3)
    with pytest.raises(KeyboardInterrupt):
        sim.advance(10**12)
    assert time.monotonic() - start < 10.0  # 1e12 steps take days


def test_signals_are_left_to_the_main_thread(load):
    """A call in another thread continues; the main thread, waiting in Python, receives the interrupt."""
    sim = cp.Simulator(load("humanoid_drop"))
    thread = threading.Thread(target=lambda: sim.advance(20_000))
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
        while thread.is_alive():
            thread.join(0.05)
    thread.join()
    assert sim.time == pytest.approx(20_000 * sim.options.time_step)


def test_own_signal_handlers_go_on_if_they_raise_nothing(load):
    sim = cp.Simulator(load("humanoid_drop"))
    seen = []
    before = signal.signal(signal.SIGALRM, lambda *_: seen.append(sim.time))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        steps = 0
        while not seen and steps < 10**6:
            sim.run(steps=20_000)
            steps += 20_000
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert seen
