"""Sensors from Python: the same numbers as in the tables of the command line, and Newton's law."""

import numpy as np
import pytest

import counterpoint as cp

SCENE = """
gravity: [0, 0, -9.81]
time_step: 0.002
models:
  - {name: ball, sphere: 0.1, mass: 2, position: [0, 0, 0.3]}
ground: {friction: 0.5}
sensors:
  - {name: imu, kind: imu, link: ball/body, noise: [0.1, 0.01], rate: 100}
  - {name: force, kind: contact_force, link: ball/body}
  - {name: eye, kind: range, link: ball/body, axis: [0, 0, -1], limit: 5}
"""


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE)
    return cp.load_scene(file)


def test_model_lists_sensors(scene):
    imu = scene.model.sensors[0]
    assert (imu.name, imu.kinds, imu.rate) == ("imu", ["specific_force", "angular_velocity"], 100)
    columns = cp.SensorTable(scene.model, scene.options).columns
    assert [c.name for c in columns][:3] == ["imu.ax", "imu.ay", "imu.az"]
    assert (columns[0].unit, columns[0].frame, columns[6].frame) == ("m/s^2", "sensor", "world")


def test_values_in_steps_and_along_the_trajectory_are_the_same(scene, tmp_path):
    simulator = cp.Simulator(scene)
    table = cp.SensorTable(scene.model, scene.options)
    file = tmp_path / "motion.csv"
    writer = cp.TrajectoryWriter(file, scene.model)
    rows = []
    for _ in range(200):
        before = simulator.state.copy()
        assert simulator.step().succeeded
        rows.append(table.evaluate(before, simulator.state, simulator.input))
        writer.write_step(before, simulator.input, scene.options.time_step)
    writer.write_end(simulator.state)
    trajectory = cp.read_trajectory(file, scene)
    exact = cp.sensor_readings(scene, trajectory, errors=False)
    for i, column in enumerate(table.columns):
        np.testing.assert_array_equal(exact[column.name], [row[i] for row in rows])
    # Force over mass is the specific force of the ball's centre, which does not turn.
    np.testing.assert_allclose(exact["force.fz"] / 2, exact["imu.az"], atol=1e-7)
    assert exact["force.fz"].max() > 2 * 9.81
    np.testing.assert_allclose(exact["eye.range"], trajectory.q[:-1, 2], atol=1e-12)
    noisy = cp.sensor_readings(scene, trajectory, seed=3)
    np.testing.assert_array_equal(noisy["imu.ax"][:5], noisy["imu.ax"][0])  # held for 10 ms
    assert 0.03 < noisy["imu.ax"][::5].std() < 0.3
    again = cp.sensor_readings(scene, trajectory, seed=3)
    np.testing.assert_array_equal(noisy["imu.ax"], again["imu.ax"])


def test_another_model_is_refused(scene, tmp_path):
    other = cp.load_scene(tmp_path / "scene.yaml")
    state = cp.Simulator(scene).state
    with pytest.raises(ValueError, match="another model"):
        cp.SensorTable(scene.model).evaluate(state, state, cp.Input(other.model))
