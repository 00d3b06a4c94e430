"""Motions drawn by key poses, without forces, for `counterpoint retarget`."""

import math
import re

# Lengths of the humanoid [m]: hips below the pelvis, thigh, shin, ankle above the sole (robots.py).
HIP, THIGH, SHIN, ANKLE = 0.06, 0.36, 0.36, 0.08


# Time [s], hip angle [rad] of a leg whose foot is level below the hip, height of the soles [m], yaw [rad],
# pitch of the shoulders [rad].
JUMP = (
    (0.0, 0.30, 0.0, 0.0, 0.0),
    (0.2, 0.30, 0.0, 0.0, 0.0),
    (0.6, 0.75, 0.0, 0.0, 0.6),
    (0.9, 0.20, 0.0, 0.0, -0.5),
    (1.05, 0.40, 0.11, 0.785, -0.7),
    (1.2, 0.25, 0.0, 1.571, -0.4),
    (1.6, 0.75, 0.0, 1.571, 0.2),
    (2.0, 0.30, 0.0, 1.571, 0.0),
    (2.2, 0.30, 0.0, 1.571, 0.0),
)


# Skeleton of the figure in the BVH file: a joint, its parent, and the joints of the robot that turn it, in their order.
SKELETON = (
    ("Chest", "Hips", ("waist_yaw", "waist_pitch", "waist_roll")),
    ("Head", "Chest", ("neck_yaw", "neck_pitch")),
    ("LeftArm", "Chest", ("left_shoulder_pitch", "left_shoulder_roll", "left_shoulder_yaw")),
    ("LeftForeArm", "LeftArm", ("left_elbow",)),
    ("RightArm", "Chest", ("right_shoulder_pitch", "right_shoulder_roll", "right_shoulder_yaw")),
    ("RightForeArm", "RightArm", ("right_elbow",)),
    ("LeftUpLeg", "Hips", ("left_hip_yaw", "left_hip_roll", "left_hip_pitch")),
    ("LeftLeg", "LeftUpLeg", ("left_knee",)),
    ("LeftFoot", "LeftLeg", ("left_ankle_pitch", "left_ankle_roll")),
    ("RightUpLeg", "Hips", ("right_hip_yaw", "right_hip_roll", "right_hip_pitch")),
    ("RightLeg", "RightUpLeg", ("right_knee",)),
    ("RightFoot", "RightLeg", ("right_ankle_pitch", "right_ankle_roll")),
)
# Ends of limbs from their last joint [m].
ENDS = {"Head": (0, 0, 0.2), "LeftForeArm": (0, 0, -0.25), "RightForeArm": (0, 0, -0.25)}
FOOT = (0.11, 0, -0.05)
FRAME_TIME = 0.03


def pose(key, joints):
    """Height of the pelvis [m], its yaw and the angles of the joints [rad] in a key pose."""
    _, hip, sole, yaw, shoulder = key
    angle = {"hip_pitch": -hip, "knee": 2 * hip, "ankle_pitch": -hip, "shoulder_pitch": shoulder, "elbow": -0.4}
    angles = []
    for name in joints:
        side, _, rest = name.partition("_")
        spread = {"left": 0.15, "right": -0.15}.get(side, 0.0)
        angles.append(spread if rest == "shoulder_roll" else angle.get(rest, 0.0))
    return [HIP + (THIGH + SHIN) * math.cos(hip) + ANKLE + sole, yaw, *angles]


def turning_jump(urdf):
    """Text of a table of the humanoid's coordinates; urdf: text of the robot's file."""
    joints = re.findall(r'<joint name="([^"]+)"', urdf)
    base = ["pelvis." + name for name in ("x", "y", "z", "qw", "qx", "qy", "qz")]
    lines = [",".join(["time", *base, *(name + ".q" for name in joints)])]
    for key in JUMP:
        height, yaw, *angles = pose(key, joints)
        row = [key[0], 0, 0, height, math.cos(yaw / 2), 0, 0, math.sin(yaw / 2), *angles]
        lines.append(",".join(f"{x:.6g}" for x in row))
    return "\n".join(lines) + "\n"


def turning_jump_bvh(urdf):
    """Text of a BVH file of the same motion, straight from key pose to key pose, by a figure of the humanoid's build.

    In cm and degrees; y points up, z ahead, as usual: the axes of the file along x, y, z are z, x, y of ours.
    """
    origin, axis = {}, {}
    for name, body in re.findall(r'<joint name="([^"]+)"(.*?)</joint>', urdf, re.S):
        origin[name], axis[name] = (
            [float(x) for x in re.search(f'{key} xyz="([^"]+)"', body)[1].split()] for key in ("origin", "axis"))
    joints = list(origin)

    def offset(place):
        return "OFFSET " + " ".join(f"{100 * place[i]:.6g}" for i in (1, 2, 0))

    def joint(name, motors):
        place = [sum(origin[motor][i] for motor in motors) for i in range(3)]
        turns = [("Zrotation", "Xrotation", "Yrotation")[axis[motor].index(1)] for motor in motors]
        inner = [line for child, parent, own in SKELETON if parent == name for line in joint(child, own)]
        end = FOOT if name.endswith("Foot") else ENDS.get(name)
        if end:
            inner += ["End Site", "{", "  " + offset(end), "}"]
        body = [offset(place), f"CHANNELS {len(turns)} {' '.join(turns)}", *inner]
        return [f"JOINT {name}", "{", *("  " + line for line in body), "}"]

    def order(name):
        return [motor for child, parent, own in SKELETON if parent == name for motor in (*own, *order(child))]

    limbs = [line for child, parent, own in SKELETON if parent == "Hips" for line in joint(child, own)]
    root = [offset((0, 0, 0)), "CHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation Xrotation", *limbs]
    frames = round(JUMP[-1][0] / FRAME_TIME) + 1
    lines = ["HIERARCHY", "ROOT Hips", "{", *("  " + line for line in root), "}",
             "MOTION", f"Frames: {frames}", f"Frame Time: {FRAME_TIME}"]
    for frame in range(frames):
        time = min(frame * FRAME_TIME, JUMP[-1][0])
        after = next(i for i in range(1, len(JUMP)) if JUMP[i][0] >= time - 1e-9)
        share = (time - JUMP[after - 1][0]) / (JUMP[after][0] - JUMP[after - 1][0])
        low, high = (pose(JUMP[i], joints) for i in (after - 1, after))
        height, yaw, *angles = (a + share * (b - a) for a, b in zip(low, high))
        angle = dict(zip(joints, angles))
        row = [0, 100 * height, 0, *(math.degrees(x) for x in (yaw, 0, 0, *(angle[m] for m in order("Hips"))))]
        lines.append(" ".join(f"{round(x, 4) + 0.0:g}" if abs(x) < 1e-4 else f"{x:.4f}" for x in row))
    return "\n".join(lines) + "\n"
