#!/usr/bin/env python3
"""Writes data/robots/*.urdf, the box scenes and the heights of data/scenes. Standard library only.

Inertias follow from the mass and the uniform density of each link's primitive shape, so the files are
physical by construction. Usage: scripts/make_data.py [--check]   (--check: compare, write nothing)
"""
import math
import pathlib
import sys

sys.dont_write_bytecode = True  # the tests run this in the sources
from hard_scenes import hard_files  # noqa: E402
from mechanism_scenes import mechanism_files  # noqa: E402
from pile_scenes import bundled_pile_files  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent / "data"
HEADER = """<?xml version="1.0"?>
<!-- Written by scripts/make_data.py; edit that file. Inertias: uniform density of the shape named in
     each link, about its centre of mass. Units: m, kg, rad, N, s.
     {about} -->
"""


def number(x):
    text = f"{x:.15g}"
    return "0" if text == "-0" else text


def numbers(values):
    return " ".join(number(v) for v in values)


# ---- shapes: (kind, dimensions); inertia of the unit of mass about the centre, axes of the shape --------

def box(x, y, z):
    return ("box", (x, y, z))


def sphere(radius):
    return ("sphere", (radius,))


def cylinder(radius, length):
    return ("cylinder", (radius, length))


def capsule(radius, length):
    """length: of the segment between the centres of the caps."""
    return ("capsule", (radius, length))


def inertia(shape, mass):
    """Diagonal (ixx, iyy, izz) about the centre of mass."""
    kind, d = shape
    if kind == "box":
        x, y, z = (v * v for v in d)
        return tuple(mass / 12 * s for s in (y + z, x + z, x + y))
    if kind == "sphere":
        return (0.4 * mass * d[0] ** 2,) * 3
    r, h = d
    if kind == "cylinder":
        across = mass * (3 * r * r + h * h) / 12
        return (across, across, mass * r * r / 2)
    # Capsule: a cylinder and two half spheres, whose centres of mass lie 3/8 r outside the segment.
    volume_cylinder, volume_caps = math.pi * r * r * h, 4 / 3 * math.pi * r ** 3
    mass_cylinder = mass * volume_cylinder / (volume_cylinder + volume_caps)
    mass_caps = mass - mass_cylinder
    across = (mass_cylinder * (3 * r * r + h * h) / 12
              + mass_caps * (0.4 * r * r + h * h / 4 + 3 / 8 * r * h))
    return (across, across, mass_cylinder * r * r / 2 + mass_caps * 0.4 * r * r)


def geometry(shape):
    kind, d = shape
    if kind == "box":
        return f'<box size="{numbers(d)}"/>'
    if kind == "sphere":
        return f'<sphere radius="{number(d[0])}"/>'
    return f'<{kind} radius="{number(d[0])}" length="{number(d[1])}"/>'


# ---- links and joints --------------------------------------------------------------------------------

ALONG_X = (0, math.pi / 2, 0)
ALONG_Y = (math.pi / 2, 0, 0)


class Robot:
    def __init__(self, name, about):
        self.name, self.about, self.lines = name, about, []
        self.mass = 0.0

    def link(self, name, shape=None, mass=0.0, center=(0, 0, 0), rpy=(0, 0, 0), collide=True,
             collisions=None, contact=""):
        """shape gives the inertia, and the collision geometry unless `collisions` lists others."""
        self.mass += mass
        out = self.lines
        if shape is None:
            out.append(f'  <link name="{name}"/>')
            return
        ixx, iyy, izz = inertia(shape, mass)
        out.append(f'  <link name="{name}">')
        if contact:
            out.append(f"    {contact}")
        out.append("    <inertial>")
        out.append(f'      <origin xyz="{numbers(center)}" rpy="{numbers(rpy)}"/>'
                   f' <!-- {shape[0]} {numbers(shape[1])} -->')
        out.append(f'      <mass value="{number(mass)}"/>')
        out.append(f'      <inertia ixx="{number(ixx)}" ixy="0" ixz="0" iyy="{number(iyy)}" iyz="0"'
                   f' izz="{number(izz)}"/>')
        out.append("    </inertial>")
        if collisions is None:
            collisions = [(shape, center, rpy)] if collide else []
        for tag in ("visual", "collision"):
            for part, origin, turned in collisions or [(shape, center, rpy)]:
                if tag == "collision" and not collisions:
                    continue
                out.append(f'    <{tag}><origin xyz="{numbers(origin)}" rpy="{numbers(turned)}"/>'
                           f"<geometry>{geometry(part)}</geometry></{tag}>")
        out.append("  </link>")

    def joint(self, name, kind, parent, child, origin, axis=None, limit=None, damping=None):
        """limit: (lower, upper, effort, velocity)."""
        out = self.lines
        out.append(f'  <joint name="{name}" type="{kind}">')
        out.append(f'    <parent link="{parent}"/><child link="{child}"/>'
                   f'<origin xyz="{numbers(origin)}" rpy="0 0 0"/>')
        if axis:
            out.append(f'    <axis xyz="{numbers(axis)}"/>')
        if limit:
            lower, upper, effort, velocity = limit
            bounds = "" if kind == "continuous" else f'lower="{number(lower)}" upper="{number(upper)}" '
            out.append(f'    <limit {bounds}effort="{number(effort)}" velocity="{number(velocity)}"/>')
        if damping:
            out.append(f'    <dynamics damping="{number(damping)}"/>')
        out.append("  </joint>")

    def text(self):
        head = HEADER.format(about=self.about)
        return head + f'<robot name="{self.name}">\n' + "\n".join(self.lines) + "\n</robot>\n"


X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def bullet_contact(friction, restitution=0.0):
    return (f'<contact><lateral_friction value="{number(friction)}"/>'
            f'<restitution value="{number(restitution)}"/></contact>')


def hopper():
    robot = Robot("hopper", "A trunk on one leg of two joints, kept in the plane y = 0 by sliders; 5 degrees of freedom.")
    slider = sphere(0.02)
    robot.link("rail")
    robot.link("carriage", slider, 0.1, collide=False)
    robot.joint("slide_x", "prismatic", "rail", "carriage", (0, 0, 0), X, (-100, 100, 0, 100))
    robot.link("lift", slider, 0.1, collide=False)
    robot.joint("slide_z", "prismatic", "carriage", "lift", (0, 0, 0), Z, (-100, 100, 0, 100))
    robot.link("trunk", capsule(0.08, 0.2), 8.0, rpy=(0, 0, 0))
    robot.joint("pitch", "continuous", "lift", "trunk", (0, 0, 0), Y)
    robot.link("thigh", capsule(0.04, 0.25), 1.5, center=(0, 0, -0.16), collide=False)
    robot.joint("hip", "revolute", "trunk", "thigh", (0, 0, -0.1), Y, (-2.0, 2.0, 120, 20), damping=0.1)
    robot.link("shank", capsule(0.03, 0.25), 0.8, center=(0, 0, -0.16), collide=False)
    robot.joint("knee", "revolute", "thigh", "shank", (0, 0, -0.32), Y, (-2.6, 2.6, 120, 20), damping=0.1)
    robot.link("foot", sphere(0.04), 0.2)
    robot.joint("sole", "fixed", "shank", "foot", (0, 0, -0.32))
    return robot


def spinner():
    robot = Robot("spinner", "A finger of two joints beside a wheel of three arms on a pivot, all turning about z.")
    robot.link("board")
    robot.link("upper", capsule(0.02, 0.2), 0.5, center=(0.12, 0, 0), rpy=ALONG_X, collide=False)
    robot.joint("base_joint", "revolute", "board", "upper", (0, 0, 0), Z, (-2.5, 2.5, 10, 30), damping=0.02)
    robot.link("lower", capsule(0.02, 0.14), 0.3, center=(0.1, 0, 0), rpy=ALONG_X,
               collisions=[(sphere(0.03), (0.2, 0, 0), (0, 0, 0))])
    robot.joint("tip_joint", "revolute", "upper", "lower", (0.24, 0, 0), Z, (-2.5, 2.5, 10, 30), damping=0.02)
    arms = []
    for k in range(3):
        angle = 2 * math.pi * k / 3
        arms.append((capsule(0.02, 0.1), (0.07 * math.cos(angle), 0.07 * math.sin(angle), 0),
                     (0, math.pi / 2, angle)))
    robot.link("wheel", cylinder(0.12, 0.04), 0.6, collisions=arms)
    robot.joint("pivot", "continuous", "board", "wheel", (0.45, 0.15, 0), Z, damping=0.005)
    return robot


def pusher():
    robot = Robot("pusher", "A ball of 0.04 m radius on three crossed slides: a finger with motors along x, y and z.")
    slider = sphere(0.02)
    robot.link("frame")
    robot.link("bridge", slider, 0.2, collide=False)
    robot.joint("move_x", "prismatic", "frame", "bridge", (0, 0, 0), X, (-2, 2, 60, 4), damping=1)
    robot.link("trolley", slider, 0.2, collide=False)
    robot.joint("move_y", "prismatic", "bridge", "trolley", (0, 0, 0), Y, (-2, 2, 60, 4), damping=1)
    robot.link("finger", sphere(0.04), 0.4)
    robot.joint("move_z", "prismatic", "trolley", "finger", (0, 0, 0), Z, (-0.5, 1, 60, 4), damping=1)
    return robot


def one_link(name, about, shape, mass, friction, restitution=0.0):
    robot = Robot(name, about)
    robot.link(name, shape, mass, contact=bullet_contact(friction, restitution))
    return robot


def pendulum():
    robot = Robot("pendulum", "A mass of 1 kg (sphere of 1 mm, in effect a point) 1 m from the pivot.")
    robot.link("pivot")
    robot.link("bob", sphere(0.001), 1.0, center=(0, 0, -1), collide=False)
    robot.joint("swing", "continuous", "pivot", "bob", (0, 0, 0), Y, (0, 0, 50, 50))
    return robot


def double_pendulum():
    robot = Robot("double_pendulum", "Two uniform rods, 1 m and 1 kg each, swinging about y.")
    robot.link("pivot")
    for parent, child, joint, z in (("pivot", "upper", "shoulder", 0), ("upper", "lower", "elbow", -1)):
        robot.link(child, cylinder(0.02, 1), 1.0, center=(0, 0, -0.5), collide=False)
        robot.joint(joint, "continuous", parent, child, (0, 0, z), Y, (0, 0, 50, 50))
    return robot


def planar_chain():
    robot = Robot("planar_chain", "Five uniform rods, 0.4 m and 1 kg each, in a chain, swinging about y; no limits.")
    robot.link("pivot")
    parent, z = "pivot", 0
    for i in range(5):
        robot.link(f"rod_{i}", cylinder(0.02, 0.4), 1.0, center=(0, 0, -0.2), collide=False)
        robot.joint(f"hinge_{i}", "continuous", parent, f"rod_{i}", (0, 0, z), Y)
        parent, z = f"rod_{i}", -0.4
    return robot


def add_arm7(robot):
    """Links and joints of the 7-axis arm; returns its last link."""
    robot.link("base", cylinder(0.09, 0.12), 6.0, center=(0, 0, 0.06))
    #        name   axis origin z, shape, mass, centre z, lower, upper, effort, velocity, damping
    parts = [("shoulder_yaw", Z, 0.14, capsule(0.06, 0.12), 3.5, 0.08, -2.9, 2.9, 150, 2.0, 1.0),
             ("shoulder_pitch", Y, 0.2, capsule(0.055, 0.18), 3.5, 0.1, -2.0, 2.0, 150, 2.0, 1.0),
             ("arm_roll", Z, 0.2, capsule(0.055, 0.12), 2.8, 0.1, -2.9, 2.9, 100, 2.4, 0.7),
             ("elbow", Y, 0.2, capsule(0.05, 0.16), 2.6, 0.1, -2.1, 2.1, 100, 2.4, 0.7),
             ("forearm_roll", Z, 0.2, capsule(0.045, 0.12), 1.8, 0.1, -2.9, 2.9, 40, 3.0, 0.3),
             ("wrist_pitch", Y, 0.2, capsule(0.04, 0.06), 1.2, 0.03, -2.0, 2.0, 30, 3.5, 0.2),
             ("flange_roll", Z, 0.12, capsule(0.035, 0.06), 0.6, 0.05, -3.0, 3.0, 20, 3.5, 0.1)]
    parent = "base"
    for name, axis, z, shape, mass, center, lower, upper, effort, velocity, damping in parts:
        link = f"{name}_link"
        robot.link(link, shape, mass, center=(0, 0, center))
        robot.joint(name, "revolute", parent, link, (0, 0, z), axis,
                    (lower, upper, effort, velocity), damping)
        parent = link
    return parent


def arm7():
    robot = Robot("arm7", "A 7-axis arm, 1.3 m of reach, made of capsules.")
    add_arm7(robot)
    return robot


def arm_hand():
    """Fingers bend inwards for positive angles; straight they stand around a cylinder of radius 0.04 m."""
    robot = Robot("arm_hand", "The 7-axis arm with a hand of three fingers of two joints each.")
    flange = add_arm7(robot)
    robot.link("palm", cylinder(0.065, 0.02), 0.3)
    robot.joint("wrist_flange", "fixed", flange, "palm", (0, 0, 0.135))
    for i in range(3):
        angle = 2 * math.pi * i / 3
        c, s = (0.0 if abs(v) < 1e-12 else v for v in (math.cos(angle), math.sin(angle)))
        origin, parent = (0.055 * c, 0.055 * s, 0.02), "palm"
        for part in ("knuckle", "tip"):
            robot.link(f"finger_{i}_{part}", capsule(0.012, 0.035), 0.05, center=(0, 0, 0.03))
            robot.joint(f"finger_{i}_{part}_bend", "revolute", parent, f"finger_{i}_{part}", origin,
                        (s, -c, 0), (-0.5, 1.5, 5, 10), 0.02)
            origin, parent = (0, 0, 0.06), f"finger_{i}_{part}"
    return robot


def quadruped():
    robot = Robot("quadruped", "Four legs of three joints; stands 0.33 m high with hips at 0.8, knees at"
                  " -1.6 rad.")
    robot.link("trunk", box(0.42, 0.2, 0.12), 7.0)
    for front, fx in (("front", 1), ("hind", -1)):
        for side, sy in (("left", 1), ("right", -1)):
            leg = f"{front}_{side}"
            robot.link(f"{leg}_hip", cylinder(0.045, 0.05), 0.6, rpy=ALONG_X, collide=False)
            robot.link(f"{leg}_thigh", capsule(0.025, 0.16), 1.0, center=(0, 0, -0.11))
            robot.link(f"{leg}_shank", capsule(0.015, 0.16), 0.3, center=(0, 0, -0.1))
            robot.link(f"{leg}_foot", sphere(0.022), 0.06)
            robot.joint(f"{leg}_abduction", "revolute", "trunk", f"{leg}_hip",
                        (0.19 * fx, 0.07 * sy, 0), X, (-0.8, 0.8, 25, 20), 0.1)
            robot.joint(f"{leg}_hip_pitch", "revolute", f"{leg}_hip", f"{leg}_thigh",
                        (0, 0.075 * sy, 0), Y, (-1.6, 2.4, 25, 20), 0.1)
            robot.joint(f"{leg}_knee", "revolute", f"{leg}_thigh", f"{leg}_shank",
                        (0, 0, -0.22), Y, (-2.6, 0, 35, 15), 0.1)
            robot.joint(f"{leg}_sole", "fixed", f"{leg}_shank", f"{leg}_foot", (0, 0, -0.22))
    return robot


def humanoid():
    robot = Robot("humanoid", "25 joints and a floating pelvis: 31 degrees of freedom, 1.52 m, 64 kg,"
                  " capsules and spheres only.\n     Arms hang, feet forward along x, pelvis 0.86 m up.")

    def chain(parent, origin, steps, damping):
        """Joints of one multi-axis joint; links between the axes are small spheres that do not collide.
        steps: (joint, axis, limit, link, link arguments or None)."""
        for name, axis, limit, link, body in steps:
            if body is None:
                robot.link(link, sphere(0.04), 0.4, collide=False)
            else:
                robot.link(link, **body)
            robot.joint(name, "revolute", parent, link, origin, axis, limit, damping)
            parent, origin = link, (0, 0, 0)

    robot.link("pelvis", capsule(0.09, 0.14), 8.0, rpy=ALONG_Y)
    chest = dict(shape=capsule(0.11, 0.18), mass=19.0, center=(0, 0, 0.19), rpy=ALONG_Y,
                 collisions=[(capsule(0.11, 0.18), (0, 0, 0.24), ALONG_Y),
                             (capsule(0.1, 0.12), (0, 0, 0.09), ALONG_Y)])
    chain("pelvis", (0, 0, 0.11), [
        ("waist_yaw", Z, (-0.8, 0.8, 120, 12), "waist_1", None),
        ("waist_pitch", Y, (-0.5, 1.2, 200, 12), "waist_2", None),
        ("waist_roll", X, (-0.5, 0.5, 120, 12), "chest", chest)], 3)
    chain("chest", (0, 0, 0.38), [
        ("neck_yaw", Z, (-1.2, 1.2, 20, 12), "neck", None),
        ("neck_pitch", Y, (-0.6, 0.8, 20, 12), "head",
         dict(shape=sphere(0.095), mass=4.0, center=(0, 0, 0.075)))], 0.5)

    for side, s in (("left", 1), ("right", -1)):
        # Limits of roll and yaw joints are mirrored, so that both sides move alike.
        def mirrored(low, high, effort, velocity):
            return (low, high, effort, velocity) if s > 0 else (-high, -low, effort, velocity)

        chain("pelvis", (0, 0.09 * s, -0.06), [
            (f"{side}_hip_yaw", Z, mirrored(-0.6, 0.8, 100, 12), f"{side}_hip_1", None),
            (f"{side}_hip_roll", X, mirrored(-0.4, 0.9, 150, 12), f"{side}_hip_2", None),
            (f"{side}_hip_pitch", Y, (-2.0, 0.6, 200, 12), f"{side}_thigh",
             dict(shape=capsule(0.065, 0.24), mass=6.6, center=(0, 0, -0.18)))], 2)
        chain(f"{side}_thigh", (0, 0, -0.36), [
            (f"{side}_knee", Y, (0, 2.4, 200, 15), f"{side}_shin",
             dict(shape=capsule(0.05, 0.24), mass=3.0, center=(0, 0, -0.17)))], 2)
        foot = [(capsule(0.03, 0.14), (0.04, 0.025 * w, -0.05), ALONG_X) for w in (1, -1)]
        chain(f"{side}_shin", (0, 0, -0.36), [
            (f"{side}_ankle_pitch", Y, (-0.8, 0.6, 100, 12), f"{side}_ankle", None),
            (f"{side}_ankle_roll", X, (-0.4, 0.4, 60, 12), f"{side}_foot",
             dict(shape=box(0.2, 0.11, 0.06), mass=1.0, center=(0.04, 0, -0.05), collisions=foot))], 1)
        chain("chest", (0, 0.235 * s, 0.28), [
            (f"{side}_shoulder_pitch", Y, (-2.6, 1.0, 60, 15), f"{side}_shoulder_1", None),
            (f"{side}_shoulder_roll", X, mirrored(-0.2, 2.2, 60, 15), f"{side}_shoulder_2", None),
            (f"{side}_shoulder_yaw", Z, mirrored(-1.2, 1.2, 30, 15), f"{side}_upper_arm",
             dict(shape=capsule(0.042, 0.18), mass=1.8, center=(0, 0, -0.12)))], 0.5)
        chain(f"{side}_upper_arm", (0, 0, -0.25), [
            (f"{side}_elbow", Y, (-2.4, 0, 40, 15), f"{side}_forearm",
             dict(shape=capsule(0.035, 0.17), mass=1.3, center=(0, 0, -0.12),
                  collisions=[(capsule(0.035, 0.17), (0, 0, -0.12), (0, 0, 0)),
                              (sphere(0.042), (0, 0, -0.26), (0, 0, 0))]))], 0.5)
    return robot


ROBOTS = [
    one_link("cube", "A cube of 0.2 m, 1 kg, friction 0.5.", box(0.2, 0.2, 0.2), 1.0, 0.5),
    one_link("ball", "A ball of 0.1 m radius, 1 kg, friction 0.5, restitution 0.8.", sphere(0.1), 1.0,
             0.5, 0.8),
    one_link("coin", "A disk of 0.1 m diameter and 0.01 m thickness, 0.2 kg.", cylinder(0.05, 0.01),
             0.2, 0.3),
    pendulum(), double_pendulum(), planar_chain(), arm7(), arm_hand(), quadruped(), humanoid(),
    hopper(), spinner(), pusher(),
]


def toss_cube():
    """Mass, half width, inertia, friction and restitution as published with the cube toss recordings."""
    robot = Robot("toss_cube", "Exception: mass, size, inertia, friction and restitution are the values"
                  " published with the ContactNets cube toss recordings.")
    text = HEADER.format(about=robot.about) + f"""<robot name="toss_cube">
  <link name="cube">
    {bullet_contact(0.18, 0.125)}
    <inertial>
      <mass value="0.37"/>
      <inertia ixx="0.00081" ixy="0" ixz="0" iyy="0.00081" iyz="0" izz="0.00081"/>
    </inertial>
    <collision><geometry><box size="0.1048 0.1048 0.1048"/></geometry></collision>
  </link>
</robot>
"""
    return text


# ---- box scenes: cubes of 0.2 m and 1 kg, friction 0.5, gravity 9.81, as commonly benchmarked -----------

EDGE, LIFT = 0.2, 0.001


def rows_of(kind, n):
    """Rows of cubes (first position, count, spacing)."""
    if kind == "stack":
        return [((0, 0, EDGE / 2 + LIFT), n, (0, 0, EDGE + LIFT))]
    if kind == "pyramid":
        return [((-0.5 * (n - r - 1) * (EDGE + 0.01), 0, EDGE / 2 + LIFT + r * (EDGE + LIFT)), n - r,
                 (EDGE + 0.01, 0, 0)) for r in range(n)]
    if kind == "grid":
        return [((0.4 * i, 0, EDGE / 2 + 0.1), n, (0, 0.4, 0)) for i in range(n)]
    if kind == "columns":
        return [((0.4 * i, 0.4 * j, EDGE / 2 + LIFT), n, (0, 0, EDGE + LIFT))
                for i in range(n) for j in range(n)]
    step = EDGE + 0.005
    return [((i * step, 0, EDGE / 2 + LIFT + k * (EDGE + LIFT)), n, (0, step, 0))
            for k in range(n) for i in range(n)]


def box_scene(kind, n, about):
    lines = [f"# {about} Written by scripts/make_data.py.",
             f"name: {kind}_{n}", "gravity: [0, 0, -9.81]  # m/s^2", "time_step: 0.002  # s",
             "duration: 2  # s", "ground: {friction: 0.5}", "models:"]
    for i, (position, count, spacing) in enumerate(rows_of(kind, n)):
        lines.append(f"  - {{urdf: ../robots/cube.urdf, name: row_{i}, base: floating,")
        lines.append(f"     position: [{', '.join(number(p) for p in position)}], count: {count},"
                     f" spacing: [{', '.join(number(s) for s in spacing)}]}}")
    if kind == "columns":
        middle = number(0.4 * (n // 2) + 0.05)
        lines.append(f"  - {{urdf: ../robots/cube.urdf, name: late, base: floating,")
        lines.append(f"     position: [{middle}, {middle}, {number(EDGE * n + 3)}],"
                     " velocity: {linear: [0, 0, 13]}}")
    return "\n".join(lines) + "\n"


SCENES = [("stack", 5, "A tower of 5 cubes, 1 mm apart."),
          ("stack", 10, "A tower of 10 cubes, 1 mm apart."),
          ("pyramid", 5, "A pyramid of 15 cubes in a plane, 10 mm apart sideways."),
          ("grid", 5, "25 cubes apart from each other, dropped 0.1 m."),
          ("columns", 10, "100 columns of 10 cubes; one more falls on them after 3 s."),
          ("pack", 4, "64 cubes in a 4 x 4 x 4 pack, 5 mm apart sideways.")]


ELLIPSE_HALF_AXES, ELLIPSE_CORNERS = (0.035, 0.025), 720  # m, half a degree of the parameter apart


def ellipse():
    """A disc with an elliptic rim in the plane y = 0, thinning to a point on either side: it touches with its rim only."""
    lines = ["# The ellipse of 0.07 m x 0.05 m of planar impacts, as a hull. Written by scripts/make_data.py."]
    for k in range(ELLIPSE_CORNERS):
        angle = 2 * math.pi * k / ELLIPSE_CORNERS
        lines.append(f"v {ELLIPSE_HALF_AXES[0] * math.cos(angle) + 0.0:.9f} 0 {ELLIPSE_HALF_AXES[1] * math.sin(angle) + 0.0:.9f}")
    lines += ["v 0 0.01 0", "v 0 -0.01 0"]
    for k in range(ELLIPSE_CORNERS):
        a, b = k + 1, (k + 1) % ELLIPSE_CORNERS + 1
        lines += [f"f {b} {a} {ELLIPSE_CORNERS + 1}", f"f {a} {b} {ELLIPSE_CORNERS + 2}"]
    return "\n".join(lines) + "\n"


HOLLOW_SIDE, HOLLOW_CELLS = 4.0, 40  # m, cells along a side


def hollow():
    """Heights of a shallow bowl with humps, one row a line, the first at the largest y."""
    def height(x, y):
        return 0.05 * (x * x + y * y) + 0.05 * math.sin(4 * x) * math.cos(3 * y)

    lines = ["# A hollow of 4 m x 4 m with humps: heights [m]. Written by scripts/make_data.py."]
    at = [HOLLOW_SIDE * (i / HOLLOW_CELLS - 0.5) for i in range(HOLLOW_CELLS + 1)]
    for y in reversed(at):
        lines.append(",".join(f"{height(x, y) + 0.0:.4f}" for x in at))
    return "\n".join(lines) + "\n"


def main():
    files = {f"robots/{robot.name}.urdf": robot.text() for robot in ROBOTS}
    files["robots/toss_cube.urdf"] = toss_cube()
    for kind, n, about in SCENES:
        name = "box_stack" if (kind, n) == ("stack", 10) else f"{kind}_{n}"
        files[f"scenes/{name}.yaml"] = box_scene(kind, n, about)
    files["scenes/hollow.csv"] = hollow()
    files["robots/ellipse.obj"] = ellipse()
    files.update(hard_files())
    files.update(mechanism_files())
    files.update(bundled_pile_files())
    stale = 0
    for name, text in files.items():
        path = ROOT / name
        if "--check" in sys.argv[1:]:
            if not path.exists() or path.read_text() != text:
                print(f"{path} differs from what scripts/make_data.py writes")
                stale += 1
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    for robot in ROBOTS:
        print(f"{robot.name}: {robot.mass:.3f} kg")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
