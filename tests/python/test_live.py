"""Live views of Python: a page gets the states that a program shows."""
import base64
import os
import socket
import struct

import counterpoint as cp
import pytest

pytestmark = pytest.mark.skipif(not cp.view.can_make_pages(), reason=cp.view.why_no_pages())


def connect(address):
    """Opens the WebSocket of a view; returns a stream of its frames."""
    host = address.split("/")[2]
    connection = socket.create_connection(tuple(host.split(":")), timeout=10)
    key = base64.b64encode(os.urandom(16)).decode()
    connection.sendall(
        f"GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
    )
    stream = connection.makefile("rb")
    while stream.readline() != b"\r\n":
        pass
    return stream


def frame(stream):
    """Reads a frame; returns its time [s] and numbers of bodies and contacts."""
    size = stream.read(2)[1]
    if size == 126:
        size = struct.unpack(">H", stream.read(2))[0]
    data = stream.read(size)
    time, bodies, _, contacts = struct.unpack_from("<dIII", data, 8)
    return time, bodies, contacts


def test_a_simulator_is_shown_with_its_forces(load):
    sim = cp.Simulator(load("stack_5"))
    with sim.live() as view:
        assert not view.show(), "nobody looks"
        stream = connect(view.address)
        assert view.wait(10) and view.pages == 1
        view.show(always=True)
        assert frame(stream) == (0.0, 6, 0), "no step yet, no force"
        sim.run(0.5)
        sim.step()
        assert view.show(always=True)
        assert frame(stream) == (sim.time, 6, 20), "five cubes at rest, four points each"
        assert view.address in view._repr_html_()
    with pytest.raises(ValueError, match="closed"):
        view.show()


def test_states_of_a_scene_are_shown(load):
    scene = load("stack_5")
    sim = cp.Simulator(scene)
    with cp.live(scene) as view:
        stream = connect(view.address)
        assert view.wait(10)
        for _ in range(3):
            sim.step()
        view.show(sim.state, always=True)
        assert frame(stream)[0] == sim.time
        with pytest.raises(TypeError, match="State or a Simulator"):
            view.show(3)
        with pytest.raises(TypeError, match="State or a Simulator"):
            view.show()
        assert not view.wait(0) or view.pages == 1


def test_wrong_arguments_are_refused(load):
    scene = load("stack_5")
    with pytest.raises(ValueError, match="port"):
        cp.live(scene, port=70000)
    with pytest.raises(cp.InputError, match="host nowhere"):
        cp.live(scene, host="nowhere")
