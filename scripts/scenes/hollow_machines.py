"""Pegs in holes, a hand at a handle and a pair of gears: models for hollow_scenes.py."""
import math

from scenes.files import num, vec
from scenes.hollow_meshes import CLEARANCE, DEPTH, PEG
from scenes.robot_text import Robot, box, capsule, cylinder

PEG_LENGTH, PEG_FRICTION, INSERTED = 0.08, 0.3, 0.015  # m, 1, m
GAP = 1e-7  # between peg and hole at the start [m]
TEETH = (12, 24)
AXES = 0.005 * sum(TEETH) / 2  # distance of the gears' axes [m]


def jamming_tangent():
    """Tangent of a peg's tilt from which on friction holds it in a tilted hole against its weight, without clearance:
    l / (mu (2 h - l - mu d)) with the inserted length l, the height h of its centre of mass above its lower end and
    its diameter d. The mouth pushes with N + m g sin on one side, the wall with N on the other; both contacts slip."""
    return INSERTED / (PEG_FRICTION * (PEG_LENGTH - INSERTED - PEG_FRICTION * 2 * PEG))


def lean():
    """Angle [rad] of a peg to the hole that it leans in: its lower edge is GAP off the wall at -x, its side GAP off
    the mouth at +x."""
    low, high = 0, 0.1
    for _ in range(60):
        a = (low + high) / 2
        room = 2 * PEG + CLEARANCE - GAP - PEG * math.cos(a)
        room = room * math.cos(a) - (INSERTED + PEG * math.sin(a)) * math.sin(a) - PEG - GAP
        low, high = (a, high) if room > 0 else (low, a)
    return low


def tilted_peg(name, x, share):
    """A hole at (x, 0, 0) and a peg in it that is tilted by `share` of jamming_tangent."""
    a = lean()
    tilt = math.atan(share * jamming_tangent()) - a
    across = -PEG - CLEARANCE / 2 + GAP + PEG * math.cos(a) + PEG_LENGTH / 2 * math.sin(a)
    along = DEPTH - INSERTED - PEG * math.sin(a) + PEG_LENGTH / 2 * math.cos(a)
    place = vec(x + math.cos(tilt) * across + math.sin(tilt) * along, 0,
                math.cos(tilt) * along - math.sin(tilt) * across)
    return [f"name: {name}_hole, mesh: block.obj, position: {vec(x, 0, 0)}, rpy: {vec(0, tilt, 0)}, "
            f"friction: {num(PEG_FRICTION)}"], [entry(name, place, tilt + a)]


def entry(name, place, tilt):
    return (f"name: {name}, cylinder: {vec(PEG, PEG_LENGTH)}, mass: 0.05, position: {place}, rpy: {vec(0, tilt, 0)}, "
            f"friction: {num(PEG_FRICTION)}")


def pegs():
    """Environment and models: a peg above an upright hole, off its middle and not quite upright, and two in tilted
    holes below and above the angle of jamming."""
    holes = [f"name: upright_hole, mesh: block.obj, friction: {num(PEG_FRICTION)}"]
    models = [entry("upright", vec(0.00003, 0, DEPTH - 0.002 + PEG_LENGTH / 2), 0.0003)]
    for name, x, share in (("slides", 0.1, 0.98), ("jams", 0.2, 1.02)):
        hole, model = tilted_peg(name, x, share)
        holes, models = holes + hole, models + model
    return holes, models


def hand():
    """A palm that slides along -x, two fingers and a thumb of two links each, which hang on both sides of a bar along
    x. The axis of a bar of 5 mm radius is 8 mm below the palm."""
    robot = Robot("hand", "A hand that slides along -x: palm, two fingers, a thumb.")
    robot.link("base")
    robot.link("palm", box(0.05, 0.04, 0.02), 0.2, center=(0, 0, 0.01))
    robot.joint("lift", "prismatic", "base", "palm", (0, 0, 0), (-1, 0, 0), (0, 0.1, 1000, 10))
    for name, x, side in (("left", -0.014, 1), ("right", 0.014, 1), ("thumb", 0, -1)):
        robot.link(f"{name}_near", capsule(0.004, 0.014), 0.02, center=(0, 0, -0.009))
        robot.joint(f"{name}_knuckle", "revolute", "palm", f"{name}_near", (x, 0.016 * side, 0), (-side, 0, 0),
                    (-0.7, 1.6, 10, 100))
        robot.link(f"{name}_far", capsule(0.004, 0.016), 0.02, center=(0, 0, -0.01))
        robot.joint(f"{name}_middle", "revolute", f"{name}_near", f"{name}_far", (0, 0, -0.018), (-side, 0, 0),
                    (0, 2.4, 10, 100))
    return robot.text()


def grasp():
    """Models of the hand, open beside the handle of a mug, and the mug."""
    joints, servos = [], ["lift: {servo: {damping: 500, velocity: 0.05}}"]
    for finger in ("left", "right", "thumb"):
        joints += [f"{finger}_knuckle: -0.6", f"{finger}_middle: 1.2"]
        for joint, angle in (("knuckle", 0.2), ("middle", 1.7)):
            servos.append(f"{finger}_{joint}: {{servo: {{stiffness: 1, damping: 0.02, position: {num(angle)}}}}}")
    return [f"name: hand, urdf: hand.urdf, position: [0.0855, 0, 0.05], rpy: [0, {num(math.pi / 2)}, 0], "
            f"friction: 0.5, joints: {{{', '.join(joints)}}}, dynamics: {{{', '.join(servos)}}}",
            "name: mug, mesh: mug.obj, mass: 0.3, friction: 0.5"]


def gears():
    """Two gears on parallel axes along z."""
    robot = Robot("gears", "Two spur gears on axes along z.")
    robot.link("frame")
    for name, teeth, x in (("pinion", TEETH[0], 0), ("wheel", TEETH[1], AXES)):
        robot.link(name, cylinder(0.0025 * teeth, 0.01), 0.22 * (teeth / 12) ** 2, mesh=f"{name}.obj")
        robot.joint(f"{name}_turn", "continuous", "frame", name, (x, 0, 0), (0, 0, 1))
    return robot.text()
