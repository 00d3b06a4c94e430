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


def turning_jump(urdf):
    """Text of a table of the humanoid's coordinates; urdf: text of the robot's file."""
    joints = re.findall(r'<joint name="([^"]+)"', urdf)
    base = ["pelvis." + name for name in ("x", "y", "z", "qw", "qx", "qy", "qz")]
    lines = [",".join(["time", *base, *(name + ".q" for name in joints)])]
    for time, hip, sole, yaw, shoulder in JUMP:
        angle = {"hip_pitch": -hip, "knee": 2 * hip, "ankle_pitch": -hip, "shoulder_pitch": shoulder, "elbow": -0.4}
        height = HIP + (THIGH + SHIN) * math.cos(hip) + ANKLE + sole
        row = [time, 0, 0, height, math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]
        for name in joints:
            side, _, rest = name.partition("_")
            spread = {"left": 0.15, "right": -0.15}.get(side, 0.0)
            row.append(spread if rest == "shoulder_roll" else angle.get(rest, 0.0))
        lines.append(",".join(f"{x:.6g}" for x in row))
    return "\n".join(lines) + "\n"
