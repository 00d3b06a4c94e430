"""An M8 nut on a fixed bolt: meshes and models for hollow_scenes.py."""
import math

from scenes.files import num, vec
from scenes.hollow_meshes import Mesh
from scenes.robot_text import Robot, box, cylinder

PITCH, MAJOR, MINOR = 0.00125, 0.004, 0.003233  # pitch, radii of the bolt [m]
PITCH_RADIUS, CORE = 0.003594, 0.003  # the teeth of the bolt reach into it to CORE [m]
INNER, OUTER = 0.0033235, 0.00415  # radii of the nut's thread at the middle of a tooth [m]
PLAY = 0.0001  # along the axis, between the flanks [m]
GAP = 0.00002  # between the flanks that carry, at the start [m]
BOLT_TURNS, BOLT_SECTORS, NUT_TURNS, NUT_SECTORS = 6, 50, 2, 12


def half_width(r, side):
    """Half the height [m] of a tooth at the radius r: side 1 of the nut, which is wide outside, -1 of the bolt."""
    return PITCH / 4 + side * (r - PITCH_RADIUS) * math.tan(math.radians(30))


def tooth(name, radii, side, sectors):
    """A convex sector of a thread about the x axis. Its faces touch the thread in the middle of the sector if it is of
    the nut, at its ends if it is of the bolt."""
    mesh = Mesh(f"Tooth of {name} M8: {360 / sectors:g} degrees of its thread")
    half = math.pi / sectors
    stretch = 1 / math.cos(half) if side > 0 else 1
    play = PLAY / 2 if side > 0 else 0
    corners = [(radii[0], -1), (radii[1], -1), (radii[1], 1), (radii[0], 1)]
    near, far = ([mesh.point(stretch * r * math.cos(a), stretch * r * math.sin(a),
                             PITCH * a / (2 * math.pi) + sign * (half_width(r, side) - play)) for r, sign in corners]
                 for a in (-half, half))
    mesh.triangles += [(near[0], near[1], near[2]), (near[0], near[2], near[3])]
    mesh.triangles += [(far[0], far[2], far[1]), (far[0], far[3], far[2])]
    mesh.band([near[::-1], far[::-1]])
    return mesh


def thread(mesh, turns, sectors):
    """The teeth of some turns about z, with the middle of the thread at z = 0."""
    count = turns * sectors
    places = [(k - (count - 1) / 2) / sectors for k in range(count)]
    return [(("mesh", mesh), (0, 0, PITCH * t), (0, 0, 2 * math.pi * t)) for t in places]


def bolt():
    """A bolt about z, its thread in the middle."""
    robot = Robot("bolt", "A bolt M8: its core, and its thread of convex teeth.")
    core = cylinder(MINOR, (BOLT_TURNS + 1) * PITCH)
    robot.link("bolt", core, 0.01, collisions=[(core, (0, 0, 0), (0, 0, 0))]
               + thread("bolt_tooth.obj", BOLT_TURNS, BOLT_SECTORS))
    return robot.text()


def nut():
    """A nut about z; its sides are boxes."""
    sides = [k * math.pi / 3 for k in range(6)]
    robot = Robot("nut", "A nut M8: its thread of convex teeth, and six sides.")
    robot.link("nut", cylinder(0.0065, 0.004), 0.005, collisions=thread("nut_tooth.obj", NUT_TURNS, NUT_SECTORS)
               + [(box(0.0022, 0.0066, 0.004), (0.0053 * math.cos(a), 0.0053 * math.sin(a), 0), (0, 0, a))
                  for a in sides])
    return robot.text()


def nuts():
    """Models: a nut on each of two fixed bolts, with friction below and above that of its slope."""
    height = 0.5 * PITCH + (BOLT_TURNS - NUT_TURNS - 1) // 2 * PITCH - PLAY / 2 + GAP
    models = []
    for name, x, friction in (("turns", 0, 0.02), ("stays", 0.02, 0.15)):
        models.append(f"name: {name}_bolt, urdf: bolt.urdf, position: {vec(x, 0, 0)}, friction: {num(friction)}")
        models.append(f"name: {name}, urdf: nut.urdf, base: floating, position: {vec(x, 0, height)}, "
                      f"friction: {num(friction)}")
    return models


THREADS = {"nut_tooth": tooth("a nut", (INNER, OUTER), 1, NUT_SECTORS),
           "bolt_tooth": tooth("a bolt", (CORE, MAJOR), -1, BOLT_SECTORS)}
