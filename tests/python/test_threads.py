"""Concurrent threads, and objects that they must not share."""

import threading

import numpy as np
import pytest

import counterpoint as cp


def test_two_threads_step_two_simulators_to_the_bits_of_one(load):
    scene = load("humanoid_drop")
    alone = cp.Simulator(scene)
    alone.advance(300)
    sims = [cp.Simulator(scene) for _ in range(2)]
    threads = [threading.Thread(target=lambda s=s: [s.step() for _ in range(300)]) for s in sims]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(sim.state == alone.state for sim in sims)


def test_the_gil_is_free_while_a_step_computes(load):
    """Another thread runs during one long call; with the GIL held it could not before the call ends."""
    sim = cp.Simulator(load("humanoid_drop"))
    done, seen = threading.Event(), []

    def compute():
        sim.advance(400)
        done.set()

    thread = threading.Thread(target=compute)
    thread.start()
    while not done.is_set():
        seen.append(sim.time)  # the start time: the state is published at the end of the call
    thread.join()
    assert len(seen) > 10 and seen[1] == 0.0


def test_a_second_thread_in_one_simulator_is_refused(load):
    sim = cp.Simulator(load("humanoid_drop"))
    thread = threading.Thread(target=lambda: sim.advance(3000))
    thread.start()
    refused = 0
    while thread.is_alive():
        try:
            sim.step()
        except RuntimeError as error:
            assert "another thread" in str(error)
            refused += 1
    thread.join()
    assert refused > 0


def test_readers_of_a_running_simulator_are_safe(load):
    """Arrays, copies and resets of inputs during steps: no crash, and values read are finite."""
    sim = cp.Simulator(load("humanoid_drop"))
    thread = threading.Thread(target=lambda: [sim.step() for _ in range(500)])
    thread.start()
    while thread.is_alive():
        assert np.isfinite(sim.q).all() and len(sim.state.copy().q) == sim.model.nq
        sim.input.clear()
    thread.join()


def test_errors_of_tasks_come_out_of_a_rollout(load):
    scene = load("cube_drop")
    scene.options.time_step = -1.0
    with pytest.raises(cp.InputError, match="time step"):
        cp.rollout(scene, [scene.state()] * 4, steps=3, num_threads=2)
