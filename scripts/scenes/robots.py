"""The robots of data/robots."""
import math

from scenes.robot_text import (ALONG_X, ALONG_Y, HEADER, Robot, box, capsule, cylinder, number, sphere)

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
    """Fingers bend inwards for positive angles; when straight they enclose a cylinder of radius 0.04 m."""
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
        """Adds a multi-axis joint as a chain of joints; the links between its axes are small spheres that do not collide.
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
        # The limits of roll and yaw joints are mirrored, so that both sides move symmetrically.
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
    """Cube with the mass, size, inertia, friction and restitution published with the cube toss recordings."""
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
