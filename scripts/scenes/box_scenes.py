"""Scenes of cubes, a hull with an elliptic rim, and the heights of a terrain."""
import math

from scenes.robot_text import number

# ---- box scenes: cubes of 0.2 m and 1 kg, friction 0.5, gravity 9.81, as in common benchmarks
# -----------

EDGE, LIFT = 0.2, 0.001


def rows_of(kind, n):
    """Rows of cubes: (first position, count, spacing)."""
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


ELLIPSE_HALF_AXES, ELLIPSE_CORNERS = (0.035, 0.025), 720  # [m]; corners at steps of half a degree of the parameter


def ellipse():
    """A disc with an elliptic rim in the plane y = 0 and an apex on either side, so that only its rim touches."""
    lines = ["# The ellipse of 0.07 m x 0.05 m of planar impacts, as a hull. Written by scripts/make_data.py."]
    for k in range(ELLIPSE_CORNERS):
        angle = 2 * math.pi * k / ELLIPSE_CORNERS
        lines.append(f"v {ELLIPSE_HALF_AXES[0] * math.cos(angle) + 0.0:.9f} 0 {ELLIPSE_HALF_AXES[1] * math.sin(angle) + 0.0:.9f}")
    lines += ["v 0 0.01 0", "v 0 -0.01 0"]
    for k in range(ELLIPSE_CORNERS):
        a, b = k + 1, (k + 1) % ELLIPSE_CORNERS + 1
        lines += [f"f {b} {a} {ELLIPSE_CORNERS + 1}", f"f {a} {b} {ELLIPSE_CORNERS + 2}"]
    return "\n".join(lines) + "\n"


HOLLOW_SIDE, HOLLOW_CELLS = 4.0, 40  # [m], cells along a side


def hollow():
    """Heights of a shallow bowl with humps, one row per line, the first at the largest y."""
    def height(x, y):
        return 0.05 * (x * x + y * y) + 0.05 * math.sin(4 * x) * math.cos(3 * y)

    lines = ["# A hollow of 4 m x 4 m with humps: heights [m]. Written by scripts/make_data.py."]
    at = [HOLLOW_SIDE * (i / HOLLOW_CELLS - 0.5) for i in range(HOLLOW_CELLS + 1)]
    for y in reversed(at):
        lines.append(",".join(f"{height(x, y) + 0.0:.4f}" for x in at))
    return "\n".join(lines) + "\n"
