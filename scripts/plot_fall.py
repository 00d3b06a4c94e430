#!/usr/bin/env python3
"""Draws docs/images/humanoid_fall.svg from what setup.sh computes. Standard library only.

    scripts/plot_fall.py out/fall.csv out/contacts.csv docs/images/humanoid_fall.svg

Above: the humanoid (side view) at some moments, with the ground's force on it as recovered by the inverse. Below:
the vertical component of that force over time, against the weight.
"""
import csv
import math
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
MOMENTS = [0.0, 0.2, 0.5, 0.8, 1.1, 1.5]  # s
WIDTH, FIGURES, CHART = 960, 250, 170     # px
SCALE = 125.0                             # px/m
ARROW = 0.06                              # px/N
GRAVITY = 9.80665


def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def axis_angle(axis, angle):
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    d = 1 - c
    return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d]]


def from_rpy(r, p, y):
    return multiply(axis_angle((0, 0, 1), y), multiply(axis_angle((0, 1, 0), p), axis_angle((1, 0, 0), r)))


def from_quaternion(w, x, y, z):
    n = math.sqrt(x * x + y * y + z * z)
    return axis_angle((x / n, y / n, z / n) if n else (0, 0, 1), 2 * math.atan2(n, w))


def origin_of(element):
    origin = element.find("origin")
    if origin is None:
        return [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    xyz = [float(v) for v in origin.get("xyz", "0 0 0").split()]
    return from_rpy(*(float(v) for v in origin.get("rpy", "0 0 0").split())), xyz


class Humanoid:
    def __init__(self, urdf):
        robot = ElementTree.parse(urdf).getroot()
        self.links = {link.get("name"): link for link in robot.findall("link")}
        self.joints = robot.findall("joint")
        self.mass = sum(float(m.get("value")) for m in robot.iter("mass"))

    def segments(self, row):
        """(p, q, radius) of every capsule and sphere in the world, the far (right) side first."""
        base = [float(row[f"pelvis.{c}"]) for c in ("x", "y", "z")]
        poses = {"pelvis": (from_quaternion(*(float(row[f"pelvis.{c}"]) for c in ("qw", "qx", "qy", "qz"))),
                            base)}
        for joint in self.joints:  # parents come first in the file
            rotation, position = poses[joint.find("parent").get("link")]
            turned, offset = origin_of(joint)
            axis = [float(v) for v in joint.find("axis").get("xyz").split()]
            here = multiply(multiply(rotation, turned), axis_angle(axis, float(row[joint.get("name") + ".q"])))
            poses[joint.find("child").get("link")] = (here, add(position, apply(rotation, offset)))
        out = []
        for name, link in self.links.items():
            rotation, position = poses[name]
            for collision in link.findall("collision"):
                turned, offset = origin_of(collision)
                center = add(position, apply(rotation, offset))
                shape = collision.find("geometry")[0]
                half = 0.5 * float(shape.get("length", 0))
                along = apply(multiply(rotation, turned), [0, 0, half])
                side = 0 if name.startswith("right") else 2 if name.startswith("left") else 1
                out.append((side, add(center, along), add(center, [-a for a in along]),
                            float(shape.get("radius"))))
        return sorted(out, key=lambda s: s[0])


def draw_figures(humanoid, rows, forces, out):
    step = WIDTH / len(MOMENTS)
    ground = FIGURES - 30
    out.append(f'<line x1="0" y1="{ground}" x2="{WIDTH}" y2="{ground}" stroke="#555" stroke-width="1.5"/>')
    for i, moment in enumerate(MOMENTS):
        time = min(rows, key=lambda t: abs(t - moment))
        row = rows[time]
        center = (i + 0.5) * step
        x0 = float(row["pelvis.x"])

        def px(p):
            return f"{center + SCALE * (p[0] - x0):.1f}", f"{ground - SCALE * p[2]:.1f}"

        for side, p, q, radius in humanoid.segments(row):
            (x1, y1), (x2, y2) = px(p), px(q)
            color = ("#9db4c8", "#5f86a8", "#33607f")[side]
            out.append(f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{color}" '
                       f'stroke-width="{2 * SCALE * radius:.1f}" stroke-linecap="round"/>')
        for position, force in forces.get(time, []):
            if force[2] < 20:
                continue
            (x1, y1) = px(position)
            x2, y2 = float(x1) + ARROW * force[0], float(y1) - ARROW * force[2]
            out.append(f'<line x1="{x1}" y1="{y1}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#c8452f" '
                       f'stroke-width="2"/>')
        out.append(f'<text x="{center:.0f}" y="{FIGURES - 8}" text-anchor="middle">{time:.2f} s</text>')


def draw_chart(total, weight, out):
    top, bottom, left, right = FIGURES + 20, FIGURES + CHART - 25, 70, WIDTH - 20
    end = max(total)
    peak = 6 * weight

    def px(t, f):
        return f"{left + (right - left) * t / end:.1f},{bottom - (bottom - top) * min(f, peak) / peak:.1f}"

    for n in range(0, 7, 2):
        y = px(0, n * weight).split(",")[1]
        out.append(f'<line x1="{left}" y1="{y}" x2="{right}" y2="{y}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{float(y) + 4:.1f}" text-anchor="end">{n} weights</text>')
    y = px(0, weight).split(",")[1]
    out.append(f'<line x1="{left}" y1="{y}" x2="{right}" y2="{y}" stroke="#33607f" stroke-dasharray="5 4"/>'
               f'<text x="{right}" y="{float(y) - 5:.1f}" text-anchor="end" fill="#33607f">weight</text>')
    points = " ".join(px(t, f) for t, f in sorted(total.items()))
    out.append(f'<polyline points="{points}" fill="none" stroke="#c8452f" stroke-width="1.3"/>')
    for n in range(0, int(end / 0.5) + 1):
        x = px(0.5 * n, 0).split(",")[0]
        out.append(f'<text x="{x}" y="{bottom + 16}" text-anchor="middle">{0.5 * n:.1f} s</text>')
    out.append(f'<text x="{left + 8}" y="{top - 6}" fill="#c8452f">vertical force of the ground, recovered from '
               f"the motion (cut off at 6 weights)</text>")


def main():
    trajectory, contacts, picture = sys.argv[1:]
    with open(trajectory, newline="") as file:
        rows = {float(row["time"]): row for row in csv.DictReader(file)}
    forces = {}
    with open(contacts, newline="") as file:
        for row in csv.DictReader(file):
            sign = 1 if row["geometry_a"] == "ground" else -1 if row["geometry_b"] == "ground" else 0
            if sign:
                forces.setdefault(float(row["time"]), []).append(
                    ([float(row[c]) for c in "xyz"], [sign * float(row[c]) for c in ("fx", "fy", "fz")]))
    humanoid = Humanoid(ROOT / "data/robots/humanoid.urdf")
    times = sorted(rows)[:-1]  # no step, hence no force, after the last row
    total = {t: sum(force[2] for _, force in forces.get(t, [])) for t in times}
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {FIGURES + CHART}" '
           'font-family="sans-serif" font-size="12" fill="#333">',
           f'<rect width="{WIDTH}" height="{FIGURES + CHART}" fill="white"/>']
    draw_figures(humanoid, rows, forces, out)
    draw_chart(total, humanoid.mass * GRAVITY, out)
    out.append("</svg>")
    pathlib.Path(picture).write_text("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
