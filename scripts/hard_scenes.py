"""The scenes of `counterpoint hard-cases` (data/scenes/hard) and the robots that only they use.

make_data.py writes them. All with g = 9.81 m/s^2, friction 0.5 and 2 ms unless a scene says otherwise.
"""
import math

G = 9.81


def num(x):
    text = f"{x:.15g}"
    return "0" if text == "-0" else text


def vec(*values):
    return "[" + ", ".join(num(v) for v in values) + "]"


def scene(name, about, models, ground=0.5, step=0.002, duration=10, gravity=(0, 0, -G), more=()):
    """ground: friction of the plane z = 0, text after `ground:`, or None. models, more: lines."""
    lines = [f"# {about}", "# Written by scripts/make_data.py (hard_scenes.py).", f"name: {name}",
             f"gravity: {vec(*gravity)}  # m/s^2", f"time_step: {num(step)}  # s",
             f"duration: {num(duration)}  # s"]
    if isinstance(ground, str):
        lines.append(f"ground: {ground}")
    elif ground is not None:
        lines.append(f"ground: {{friction: {num(ground)}}}")
    lines.append("models:")
    lines += [f"  - {{{m}}}" for m in models]
    lines += list(more)
    return "\n".join(lines) + "\n"


def free(name, shape, size, mass, position=(0, 0, 0), rpy=None, friction=0.5, velocity=None,
         spin=None, extra=""):
    """An object; size: a number or a list, as in scene files."""
    size = vec(*size) if isinstance(size, (list, tuple)) else num(size)
    text = f"name: {name}, {shape}: {size}, mass: {num(mass)}, position: {vec(*position)}"
    if rpy:
        text += f", rpy: {vec(*rpy)}"
    text += f", friction: {num(friction)}"
    if velocity or spin:
        parts = ([f"linear: {vec(*velocity)}"] if velocity else []) + ([f"angular: {vec(*spin)}"] if spin else [])
        text += ", velocity: {" + ", ".join(parts) + "}"
    return text + (f", {extra}" if extra else "")


# ---- friction ------------------------------------------------------------------------------------------

def on_slope(name, tangent, friction, half, about, extra_models=()):
    theta = math.atan(tangent)
    position = (half[2] * math.sin(theta), 0, half[2] * math.cos(theta))
    return scene(name, about, [free("block", "box", half, 1, position, (0, theta, 0), friction)],
                 ground=f"{{normal: {vec(tangent, 0, 1)}, friction: {num(friction)}}}")


def seams():
    """Tiles of 13 cm side by side; what slides over them goes as over one plane."""
    def thrown(name, shape, size, y, height, yaw=0):
        return free(name, shape, size, 1, (0, y, height), (0, 0, yaw) if yaw else None, 0.2, velocity=(2, 0, 0))
    tiles = [f"  - {{name: tile_{i}, box: [0.065, 2, 0.1], position: {vec(0.13 * (i - 1), 0, -0.1)}, friction: 0.2}}"
             for i in range(15)]
    return scene("seams", "Four bodies thrown at 2 m/s over a floor of tiles, all of one height.",
                 [thrown("block", "box", (0.05, 0.05, 0.05), -1.2, 0.05),
                  thrown("plate", "box", (0.1, 0.1, 0.005), -0.4, 0.005, 0.3),
                  thrown("can", "cylinder", (0.05, 0.1), 0.4, 0.05),
                  thrown("ball", "sphere", 0.05, 1.2, 0.05)],
                 ground=None, duration=1, more=["environment:"] + tiles)


def headings():
    blocks = []
    for k in range(12):
        a = math.pi / 6 * k
        blocks.append(free(f"block{k}", "box", (0.1, 0.1, 0.02), 1, (3 * (k % 4), 3 * (k // 4), 0.02),
                           velocity=(2 * math.cos(a), 2 * math.sin(a), 0)))
    return scene("headings", "Twelve blocks slide in twelve directions.", blocks, duration=0.6)


def painleve():
    theta, radius, half = 1.0, 0.01, 0.5
    rods = []
    for i, (mu, sign) in enumerate([(1.5, 1), (1.5, -1), (3, 1), (3, -1)]):
        # A pair's friction is the geometric mean: mu^2 on ground of 1.
        rods.append(free(f"rod{i}", "capsule", (radius, 2 * half), 1,
                         (0, 3 * i, radius + half * math.sin(theta)), (0, math.pi / 2 - theta, 0),
                         mu * mu, velocity=(2 * sign, 0, 0)))
    return scene("painleve_rod", "Leaning rods slide on their lower ends; friction 1.5 and 3 with the"
                 " ground.", rods, ground=1.0, duration=3)


def wedge_files():
    half_angle, depth = 0.2, 0.1
    t = 0.2 * math.tan(half_angle)
    corners = [(x * (0.05 + dz), y, z) for z, dz in ((-0.1, 0), (0.1, t)) for y in (-depth, depth)
               for x in (-1, 1)]
    s, c = math.sin(half_angle), math.cos(half_angle)
    # Walls: boxes of half thickness 1 whose inner faces pass through (+-0.05, 0, -0.1).
    walls = ["environment:"]
    for name, side in (("left", -1), ("right", 1)):
        # Outward normal of the face (-side c, 0, s): the box's -side x axis, turned about y.
        center = (side * 0.05 + side * c, 0, -0.1 - s)
        walls.append(f"  - {{name: {name}, box: [1, 1, 3], position: {vec(*center)},"
                     f" rpy: {vec(0, side * half_angle, 0)}, friction: 0.9}}")
    text = scene("wedge", "A wedge falls 5 cm between two walls and jams.",
                 ["urdf: ../../robots/hard/wedge.urdf, base: floating, position: [0, 0, 0.05], friction: 0.9"],
                 ground=None, duration=2, more=walls)
    return {"scenes/hard/wedge.yaml": text,
            "robots/hard/wedge.obj": obj(corners),
            "robots/hard/wedge.urdf": mesh_body("wedge", "wedge.obj", 1.0, (0.005, 0.005, 0.005))}


# ---- meshes and URDFs ----------------------------------------------------------------------------------

def obj(corners):
    """Eight corners, ordered (z, y, x) from low to high: a hexahedron of triangles."""
    lines = ["# Written by scripts/make_data.py (hard_scenes.py).", "o block"]
    lines += ["v " + " ".join(num(v) for v in p) for p in corners]
    quads = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    for a, b, c, d in quads:
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    return "\n".join(lines) + "\n"


def urdf(name, about, body):
    return ('<?xml version="1.0"?>\n<!-- Written by scripts/make_data.py (hard_scenes.py). '
            f'{about} -->\n<robot name="{name}">\n{body}</robot>\n')


def link(name, mass=None, moments=None, center=(0, 0, 0), geometry=()):
    """geometry: (text, origin)."""
    out = [f'  <link name="{name}">']
    if mass:
        ixx, iyy, izz = moments
        xyz = " ".join(num(v) for v in center)
        out.append(f'    <inertial><origin xyz="{xyz}"/><mass value="{num(mass)}"/>'
                   f'<inertia ixx="{num(ixx)}" iyy="{num(iyy)}" izz="{num(izz)}" ixy="0" ixz="0" iyz="0"/></inertial>')
    for text, origin in geometry:
        out.append(f'    <collision><origin xyz="{" ".join(num(v) for v in origin)}"/>'
                   f'<geometry>{text}</geometry></collision>')
    return "\n".join(out + ["  </link>"]) + "\n"


def joint(name, kind, parent, child, origin=(0, 0, 0), axis=(0, 1, 0), rest=""):
    return (f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{" ".join(num(v) for v in origin)}"/>'
            f'<axis xyz="{" ".join(num(v) for v in axis)}"/>{rest}</joint>\n')


def mesh_body(name, file, mass, moments):
    return urdf(name, "One convex block.",
                link(name, mass, moments, geometry=[(f'<mesh filename="{file}"/>', (0, 0, 0))]))


# ---- stacks --------------------------------------------------------------------------------------------

def tower(n):
    return scene(f"tower_{n}", f"{n} cubes of 0.2 m and 1 kg on top of each other, touching.",
                 [free("cube", "box", (0.1, 0.1, 0.1), 1, (0, 0, 0.1),
                       extra=f"count: {n}, spacing: [0, 0, 0.2]")])


def mass_ratio():
    boxes = []
    for i, (below, above) in enumerate([(1, 1e3), (1, 1e6), (1e3, 1), (1e6, 1)]):
        boxes.append(free(f"below{i}", "box", (0.1, 0.1, 0.1), below, (2 * i, 0, 0.1)))
        boxes.append(free(f"above{i}", "box", (0.1, 0.1, 0.1), above, (2 * i, 0, 0.3)))
    return scene("mass_ratio", "Boxes on boxes, masses 1 : 1000 and 1 : 1000000, both ways up.", boxes)


def pyramid(n):
    edge = 0.2
    rows = []
    for r in range(n):
        # Half an edge of air between neighbours: each cube rests on two.
        step = 1.5 * edge
        rows.append(free(f"row{r}_", "box", (0.1, 0.1, 0.1), 1,
                         (-0.5 * step * (n - r - 1), 0, edge * (r + 0.5)),
                         extra=f"count: {n - r}, spacing: {vec(step, 0, 0)}"))
    return scene(f"pyramid_{n}", f"{n * (n + 1) // 2} cubes in {n} layers, each on two below.", rows)


def contact_points():
    """A box slides and rests on 4, 16, 100 feet."""
    files, models = {}, []
    for i, side in enumerate((2, 4, 10)):
        feet = [('<sphere radius="0.01"/>', (-0.2 + 0.4 * a / (side - 1), -0.2 + 0.4 * b / (side - 1), -0.05))
                for a in range(side) for b in range(side)]
        moments = [2 / 3 * s for s in (0.2 ** 2 + 0.05 ** 2, 0.2 ** 2 + 0.05 ** 2, 2 * 0.2 ** 2)]
        name = f"feet_{side * side}"
        files[f"robots/hard/{name}.urdf"] = urdf(name, f"A box of 2 kg on {side * side} feet.",
                                                 link("body", 2, moments, geometry=feet))
        models.append(f"urdf: ../../robots/hard/{name}.urdf, name: {name}, base: floating, friction: 0.5,"
                      f" position: {vec(0, 2 * i, 0.06)}, velocity: {{linear: [1, 0.3, 0]}}")
    files["scenes/hard/contact_points.yaml"] = scene(
        "contact_points", "The same box slides and rests on 4, 16 and 100 feet.", models, duration=1)
    return files


# ---- masonry -------------------------------------------------------------------------------------------

CARD = (0.001, 0.1, 0.1)  # half thickness, half width, half length


def leaning_card(name, foot_x, foot_z, theta, mu, side):
    """side -1: leans to the right from the left; its inner lower edge at foot_x, foot_z."""
    t, _, l = CARD
    turn = -side * theta
    # From the inner lower edge to the centre: half a length along the card, half a thickness outwards.
    x = foot_x - side * l * math.sin(theta) + side * t * math.cos(theta)
    z = foot_z + l * math.cos(theta) + t * math.sin(theta)
    return free(name, "box", CARD, 0.01, (x, 0, z), (0, turn, 0), mu)


def card_pair(name, factor, about):
    theta = math.atan(0.552)
    limit = 0.5 * (math.tan(theta) - CARD[0] / CARD[2])
    reach = 2 * CARD[2] * math.sin(theta)
    mu = factor * limit
    cards = [leaning_card("left", -reach, 0, theta, mu, -1), leaning_card("right", reach, 0, theta, mu, 1)]
    return scene(name, about + f" Friction {factor} times (tan(theta) - t/L)/2 = {limit:.6f}.", cards,
                 ground=mu, step=0.001, duration=5)


def round_card_files():
    """Cards whose edges are rounded, so that the normal where they lean on each other is level."""
    t, w, l = CARD
    moments = tuple(0.01 / 3 * s for s in (w * w + l * l, t * t + l * l, t * t + w * w))
    body = '  <link name="card">\n    <inertial><mass value="0.01"/><inertia' + "".join(
        f' i{a}="{num(m)}"' for a, m in zip(("xx", "yy", "zz"), moments)) + ' ixy="0" ixz="0" iyz="0"/></inertial>\n'
    for z in (-l, l):
        body += (f'    <collision><origin xyz="0 0 {num(z)}" rpy="{num(math.pi / 2)} 0 0"/><geometry>'
                 f'<capsule radius="{num(t)}" length="{num(2 * w)}"/></geometry></collision>\n')
    files = {"robots/hard/card.urdf": urdf("card", "A card of which only the rounded edges touch.", body + "  </link>\n")}
    theta = math.atan(0.552)
    # Moments about the foot: N (t + 2 l cos) = m g l sin; friction N <= mu m g.
    limit = l * math.sin(theta) / (t + 2 * l * math.cos(theta))
    for key, factor in (("stands", 1.02), ("slides", 0.98)):
        mu = factor * limit
        models = [f"urdf: ../../robots/hard/card.urdf, name: {side}, base: floating, friction: {num(mu)},"
                  f" position: {vec(s * (l * math.sin(theta) + t), 0, t + l * math.cos(theta))}, rpy: {vec(0, -s * theta, 0)}"
                  for side, s in (("left", -1), ("right", 1))]
        files[f"scenes/hard/card_pair_{key}.yaml"] = scene(
            f"card_pair_{key}", f"Two cards with rounded edges lean on each other; friction {factor} times the"
            f" limit {limit:.6f}.", models, ground=mu, step=0.001, duration=5)
    return files


def card_house(storeys=3):
    theta, mu = math.radians(20), 0.6
    t, w, l = CARD
    reach = 2 * l * math.sin(theta)  # of a foot from its apex
    pitch = 2 * reach + 0.006        # between apexes
    height = 2 * l * math.cos(theta) + 2 * t * math.sin(theta)
    cards, floor = [], 0.0
    for s in range(storeys):
        pairs = storeys - s
        for i in range(pairs):
            x = (i - 0.5 * (pairs - 1)) * pitch
            cards.append(leaning_card(f"left{s}{i}", x - reach, floor, theta, mu, -1))
            cards.append(leaning_card(f"right{s}{i}", x + reach, floor, theta, mu, 1))
        top = floor + height
        for i in range(pairs - 1):
            x = (i - 0.5 * (pairs - 2)) * pitch
            cards.append(free(f"floor{s}{i}", "box", (0.5 * pitch - 0.0002, w, t), 0.01, (x, 0, top + t), friction=mu))
        floor = top + 2 * t
    return scene("card_house", f"{len(cards)} cards of 2 mm, {storeys} storeys, leaning by 20 degrees.",
                 cards, ground=mu, step=0.001, duration=5)


def arch_files(ratio, n=20):
    """A half circle of n wedges, mean radius 1, thickness `ratio`; every wedge the same mesh."""
    half, depth = math.pi / (2 * n), 0.1
    inner, outer = 1 - ratio / 2, 1 + ratio / 2
    # Cross-section: a trapezoid, symmetric about the radial axis z, its sides along the radii.
    lo, hi = (inner * math.sin(half), inner * math.cos(half)), (outer * math.sin(half), outer * math.cos(half))
    b, a, h = 2 * lo[0], 2 * hi[0], hi[1] - lo[1]
    area = 0.5 * (a + b) * h
    center = lo[1] + h * (b + 2 * a) / (3 * (a + b))
    corners = [(x * p[0], y, p[1] - center) for p in (lo, hi) for y in (-depth, depth) for x in (-1, 1)]
    mass = area * 2 * depth * 1000
    # Second moments of the trapezoid about its centroid, per area, and of the depth.
    zz = h * h * (a * a + 4 * a * b + b * b) / (18 * (a + b) ** 2)
    xx = (a * a + b * b) / 24
    yy = depth * depth / 3
    moments = (mass * (yy + zz), mass * (xx + zz), mass * (xx + yy))
    name = f"arch_block_{round(1000 * ratio):03d}"
    blocks = []
    for i in range(n):
        turn = -math.pi / 2 + half * (2 * i + 1)  # from the vertical, about y
        position = (center * math.sin(turn), 0, center * math.cos(turn))
        blocks.append(f"urdf: ../../robots/hard/{name}.urdf, name: block{i}, base: floating, friction: 0.9,"
                      f" position: {vec(*position)}, rpy: {vec(0, turn, 0)}")
    key = "stands" if ratio > 0.1075 else "falls"
    return {f"robots/hard/{name}.obj": obj(corners),
            f"robots/hard/{name}.urdf": mesh_body(name, name + ".obj", mass, moments),
            f"scenes/hard/arch_{key}.yaml": scene(
                f"arch_{key}", f"A half circle of {n} loose wedges, mean radius 1 m, thickness {ratio} m.",
                blocks, ground=0.9, duration=10 if key == "stands" else 3)}


# ---- impacts -------------------------------------------------------------------------------------------

def rolling_box():
    """SimBenchmark's rolling test: geometric means 0.4 (box, ground) and 0.8 (ball, box)."""
    balls = [free(f"ball{i}{j}", "sphere", 0.5, 1, (2 * i - 4, 2 * j - 4, 1.5), friction=1.6)
             for i in range(5) for j in range(5)]
    return scene("rolling_box", "A box of 10 kg, 25 balls of 1 kg on it, to be pushed with 150 N at 45 degrees.",
                 [free("box", "box", (10, 10, 0.5), 10, (0, 0, 0.5), friction=0.4)] + balls,
                 ground=0.4, duration=4)


def cradle(name, gap, about):
    balls = [free(f"ball{i}", "sphere", 0.05, 1, ((0.1 + gap) * i, 0, 0), friction=0, extra="restitution: 1",
                  velocity=(1, 0, 0) if i == 0 else None) for i in range(5)]
    return scene(name, about, balls, ground=None, gravity=(0, 0, 0), duration=2)


def fast_thin():
    objects = []
    for i, speed in enumerate((30, 100, 300)):
        objects.append(free(f"ball{i}", "sphere", 0.0025, 0.001, (-0.3, 2 * i, 0), velocity=(speed, 0, 0)))
        objects.append(free(f"plate{i}", "box", (0.0005, 0.1, 0.1), 0.01, (-0.3, 20 + 2 * i, 0),
                            velocity=(speed, 0, 0)))
    return scene("fast_thin", "Balls of 5 mm and plates of 1 mm fly at a wall of 1 mm, up to 0.6 m a step.",
                 objects, ground=None, gravity=(0, 0, 0), duration=0.5,
                 more=["environment:", "  - {name: wall, box: [0.0005, 50, 5], friction: 0.5}"])


# ---- spinning bodies -----------------------------------------------------------------------------------

def top_urdf():
    """A disk of 0.1 m radius and 0.02 m thickness, 1 kg, its centre 0.1 m above the tip."""
    across = (3 * 0.1 ** 2 + 0.02 ** 2) / 12
    return urdf("top", "A heavy top; its tip is the link's origin.",
                link("top", 1, (across, across, 0.5 * 0.1 ** 2), center=(0, 0, 0.1)))


def tops():
    l, across, axial = 0.1, (3 * 0.1 ** 2 + 0.02 ** 2) / 12 + 0.1 ** 2, 0.5 * 0.1 ** 2
    top = "urdf: ../../robots/hard/top.urdf, base: spherical"
    theta, w3 = 0.5, 100.0
    # I1 W^2 cos - I3 w3 W + m g l = 0, the slow root.
    a, b, c = across * math.cos(theta), -axial * w3, G * l
    W = (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)
    # Turned about y by theta: the vertical is (-sin, 0, cos) in the body.
    spin = (-W * math.sin(theta), 0, w3)
    steady = scene("top_steady", f"A heavy top leans by 0.5 rad and precesses steadily at {W:.6f} rad/s.",
                   [f"name: top, {top}, rpy: {vec(0, theta, 0)}, velocity: {{angular: {vec(*spin)}}}"],
                   ground=None, step=0.0002, duration=5)
    critical = 2 * math.sqrt(across * G * l) / axial
    models = [f"name: {name}, {top}, position: {vec(x, 0, 0)}, rpy: [0, 0.01, 0], velocity: {{angular: {vec(0, 0, f * critical)}}}"
              for name, x, f in (("fast", 0, 1.1), ("slow", 1, 0.9))]
    sleeping = scene("top_sleeping", f"Two upright tops at 1.1 and 0.9 of the critical spin {critical:.6f} rad/s.",
                     models, ground=None, step=0.0002, duration=5)
    return {"robots/hard/top.urdf": top_urdf(), "scenes/hard/top_steady.yaml": steady,
            "scenes/hard/top_sleeping.yaml": sleeping}


def dzhanibekov():
    return scene("dzhanibekov", "A box turns about its middle axis, without gravity.",
                 [free("body", "box", (0.1, 0.2, 0.3), 1, spin=(0.01, 5, 0.01))],
                 ground=None, gravity=(0, 0, 0), duration=60)


def tippe_top():
    """A ball of 20 mm radius whose centre of mass lies 4 mm below its middle."""
    r, e, m = 0.02, 0.004, 0.03
    moment = 0.4 * m * r * r
    robot = urdf("tippe_top", "A ball with a low centre of mass, the link's origin.",
                 link("top", m, (moment, moment, moment), geometry=[(f'<sphere radius="{num(r)}"/>', (0, 0, e))]))
    # Leaning by 0.1 rad, its middle is at height r: the centre of mass e cos(0.1) below.
    text = scene("tippe_top", "A ball with a low centre of mass spins upright, leaning by 0.1 rad.",
                 [f"urdf: ../../robots/hard/tippe_top.urdf, name: top, base: floating, friction: 0.3,"
                  f" position: {vec(0, 0, r - e * math.cos(0.1))}, rpy: [0.1, 0, 0],"
                  " velocity: {angular: [0, 0, 150]}"], ground=0.3, step=0.0005, duration=5)
    return {"robots/hard/tippe_top.urdf": robot, "scenes/hard/tippe_top.yaml": text}


# ---- linkages ------------------------------------------------------------------------------------------

def hanging_chain(n, drag=None):
    """drag [N s/m] a link: closures yield like springs, and a long chain swings on them for long."""
    links = [free("link", "capsule", (0.01, 0.08), 0.1, (0, 0, -0.05), friction=0.5,
                  extra=f"count: {n}, spacing: [0, 0, -0.1]" + (f", drag: {{linear: {drag}}}" if drag else ""))]
    ties = ["closures:", "  - {type: ball, name: tie0, between: [world, link0/body]}"]
    ties += [f"  - {{type: ball, name: tie{i}, between: [link{i - 1}/body, link{i}/body], anchor_a: [0, 0, -0.05]}}"
             for i in range(1, n)]
    return scene(f"chain_{n}", f"{n} links of 0.1 m and 0.1 kg hang on each other, tied by closures.", links,
                 ground=None, duration=2, more=ties)


def whip(n):
    """A chain of n ball joints as one tree, let go from the horizontal."""
    mass, length = 0.1, 0.1
    across, along = mass * length ** 2 / 12, mass * 0.01 ** 2 / 2
    body = '  <link name="hook"/>\n'
    for i in range(n):
        body += link(f"link{i}", mass, (along, across, across), center=(0.5 * length, 0, 0))
        body += joint(f"j{i}", "floating", "hook" if i == 0 else f"link{i - 1}", f"link{i}",
                      (0 if i == 0 else length, 0, 0))
    types = ", ".join(f"j{i}: spherical" for i in range(n))
    text = scene(f"whip_{n}", f"A chain of {n} rods of 0.1 m on ball joints, let go from the horizontal.",
                 [f"urdf: ../../robots/hard/whip_{n}.urdf, joint_types: {{{types}}}"], ground=None,
                 step=0.0005, duration=5)
    return {f"robots/hard/whip_{n}.urdf": urdf(f"whip_{n}", f"{n} rods on ball joints.", body),
            f"scenes/hard/whip_{n}.yaml": text}


def net_files(n=20):
    """Nodes in a level square, ball closures halfway between neighbours, its corners drawn
    together by 15 %: held at its full size it could not sag. They touch nothing."""
    d, moment = 0.1, 0.4 * 0.05 * 0.02 ** 2
    nodes = [f"urdf: ../../robots/hard/node.urdf, name: n{i}_, base: floating, position: {vec(d * i, 0, 0)},"
             f" count: {n}, spacing: [0, {d}, 0], drag: {{body: {{linear: 0.2, angular: 0.0001}}}}" for i in range(n)]
    ties = ["closures:"]
    for i in range(n):
        for j in range(n):
            if i + 1 < n:
                ties.append(f"  - {{type: ball, between: [n{i}_{j}/body, n{i + 1}_{j}/body], anchor_a: [{d / 2}, 0, 0]}}")
            if j + 1 < n:
                ties.append(f"  - {{type: ball, between: [n{i}_{j}/body, n{i}_{j + 1}/body], anchor_a: [0, {d / 2}, 0]}}")
    m = n - 1
    for i, j in ((0, 0), (0, m), (m, 0), (m, m)):
        held = [d * (0.5 * m + 0.85 * (k - 0.5 * m)) for k in (i, j)]
        ties.append(f"  - {{type: ball, name: corner{i}_{j}, between: [world, n{i}_{j}/body],"
                    f" anchor_a: {vec(*held, 0)}, anchor_b: [0, 0, 0]}}")
    text = scene("net", f"A net of {n} x {n} bodies held at its corners, tied by {2 * n * m} ball closures.",
                 nodes, ground=None, duration=5, more=ties)
    return {"scenes/hard/net.yaml": text,
            "robots/hard/node.urdf": urdf("node", "A ball of 20 mm radius that touches nothing.",
                                          link("body", 0.05, (moment, moment, moment)))}


def gripper_files():
    moments = tuple(0.2 / 3 * s for s in (0.02 ** 2 + 0.03 ** 2, 0.01 ** 2 + 0.03 ** 2, 0.01 ** 2 + 0.02 ** 2))
    body = '  <link name="palm"/>\n'
    for side, s in (("left", 1), ("right", -1)):
        body += link(side, 0.2, moments, geometry=[('<box size="0.02 0.04 0.06"/>', (0, 0, 0))])
        body += joint(side + "_slide", "prismatic", "palm", side, (-s * 0.06, 0, 0), (s, 0, 0),
                      '<limit lower="-0.05" upper="0.06" effort="1000" velocity="10"/>')
    robot = urdf("gripper", "Two fingers of 0.2 kg that slide along x.", body)
    mu = 0.2
    text = scene("gripper", "Two light fingers hold a heavy, slippery box by friction alone.",
                 ["urdf: ../../robots/hard/gripper.urdf, name: gripper, position: [0, 0, 1], friction: 0.2",
                  free("load", "box", (0.05, 0.05, 0.05), 10, (0, 0, 1), friction=mu)], ground=None, duration=60)
    return {"robots/hard/gripper.urdf": robot, "scenes/hard/gripper.yaml": text}


def servo_chain(n=10, mass=1.0, length=0.2):
    """An inverted chain of n links on servos, at 1.1 and 0.9 of the stiffness that holds it upright."""
    across = mass * (length ** 2 / 12 + 1e-4)
    body = '  <link name="base"/>\n'
    for i in range(n):
        body += link(f"link{i}", mass, (across, across, mass * 2e-4), center=(0, 0, length / 2))
        body += joint(f"j{i}", "continuous", f"link{i - 1}" if i else "base", f"link{i}", (0, 0, length if i else 0))
    # Potential -1/2 sum_k c_k phi_k^2, phi_k = sum of the first k joints: the least stiffness is the largest
    # eigenvalue of G_ij = sum of c_k over k >= max(i, j). By iteration: G's entries are positive.
    c = [mass * G * length * (n - k - 0.5) for k in range(n)]
    v = [1.0] * n
    for _ in range(200):
        w = [sum(v[j] * sum(c[max(i, j):]) for j in range(n)) for i in range(n)]
        critical = max(w)
        v = [x / critical for x in w]
    models = []
    for name, x, share in (("stiff", 0, 1.1), ("soft", 5, 0.9)):
        kp = share * critical
        models.append(f"urdf: ../../robots/hard/servo_chain.urdf, name: {name}, position: {vec(x, 0, 0)}, joints: {{j0: 0.001}},"
                      f" dynamics: {{all: {{servo: {{stiffness: {num(kp)}, damping: {num(0.2 * kp)}, position: 0}}}}}}")
    text = scene("servo_chain", f"{n} links balance on each other by servos of 1.1 and 0.9 times the least stiffness"
                 f" {critical:.6f} N m/rad.", models, ground=None, duration=30)
    return {"robots/hard/servo_chain.urdf": urdf("servo_chain", "Links of 0.2 m and 1 kg, hinged about y.", body),
            "scenes/hard/servo_chain.yaml": text}


def singular_poses():
    """Gimbal at its pole, no length between its axes, a massless fixed link, and a straight arm behind."""
    rod = (0.25 / 12 + 1e-4, 0.25 / 12 + 1e-4, 1e-4)
    tiny = (1e-4, 1e-4, 1e-4)
    body = '  <link name="base"/>\n' + link("yaw", 0.01, tiny) + link("pitch", 0.01, tiny)
    body += joint("yaw", "continuous", "base", "yaw", axis=(0, 0, 1))
    body += joint("pitch", "continuous", "yaw", "pitch", axis=(0, 1, 0))
    body += link("upper", 1, rod, center=(0, 0, 0.25)) + joint("roll", "continuous", "pitch", "upper", axis=(0, 0, 1))
    body += '  <link name="flange"/>\n' + joint("mount", "fixed", "upper", "flange", (0, 0, 0.5))
    body += link("lower", 1, rod, center=(0, 0, 0.25)) + joint("elbow", "continuous", "flange", "lower", axis=(0, 1, 0))
    robot = urdf("singular_arm", "Yaw, pitch and roll in one point, a massless flange, an elbow.", body)
    # Upright, pitch 0: yaw and roll are one axis. A push of the elbow sets it off.
    text = scene("singular_poses", "An arm stands upright: its yaw and roll axes fall together, its links are in line.",
                 ["urdf: ../../robots/hard/singular_arm.urdf, name: arm, joint_velocities: {elbow: 0.5}"],
                 ground=None, step=0.0001, duration=5)
    return {"robots/hard/singular_arm.urdf": robot, "scenes/hard/singular_poses.yaml": text}


# ---- scales --------------------------------------------------------------------------------------------

def drop(name, size, mass, time_step, scaled):
    """A box of half lengths (1, 0.7, 0.5) size falls on a corner; scaled: also what is a length, a speed or a time."""
    contact = (f"contact: {{margin: {num(0.01 * size)}, smoothing: {num(1e-13 * size)},"
               f" max_recovery_speed: {num(math.sqrt(size))}, slip_time: {num(2 * math.sqrt(size))}}}")
    return scene(name, f"A box of {num(2 * size)} m and {num(mass)} kg falls on a corner; time in sqrt(size).",
                 [free("box", "box", (size, 0.7 * size, 0.5 * size), mass, (0, 0, 2 * size), (0.5, 0.3, 0.2),
                       velocity=(math.sqrt(size), 0, 0))],
                 step=time_step, duration=1000 * time_step, more=[contact] if scaled else [])


def scales():
    files = {}
    for exponent in range(-3, 4):
        size = 10.0 ** exponent
        for scaled, kind in ((True, "size"), (False, "unscaled")):
            if exponent == 0 and not scaled:
                continue  # the same scene
            name = f"drop_{kind}_1e{exponent}"
            files[f"scenes/hard/{name}.yaml"] = drop(name, size, 1, 0.005 * math.sqrt(size), scaled)
    for exponent in (-6, -3, 3, 6):
        name = f"drop_mass_1e{exponent}"
        files[f"scenes/hard/{name}.yaml"] = drop(name, 1, 10.0 ** exponent, 0.005, True)
    return files


def hard_files():
    files = {}
    scenes = {
        "slope_rest": on_slope("slope_rest", 0.4, 0.5, (0.1, 0.1, 0.1), "A block on a slope of tan 0.4, friction 0.5."),
        "slope_slide": on_slope("slope_slide", 0.6, 0.5, (0.1, 0.1, 0.1), "A block on a slope of tan 0.6, friction 0.5."),
        "sliding_stop": scene("sliding_stop", "A block slides at 2 m/s to a stop.",
                              [free("block", "box", (0.1, 0.1, 0.1), 1, (0, 0, 0.1), velocity=(2, 0, 0))], duration=1),
        "seams": seams(),
        "headings": headings(),
        "push_ramp": scene("push_ramp", "A block of 1 kg, to be pushed by 20 N/s times t.",
                           [free("block", "box", (0.1, 0.1, 0.1), 1, (0, 0, 0.1), friction=0.4)], ground=0.4, duration=1),
        "sphere_rolls": scene("sphere_rolls", "A ball slides at 2 m/s until it rolls.",
                              [free("ball", "sphere", 0.1, 1, (0, 0, 0.1), friction=0.3, velocity=(2, 0, 0))],
                              ground=0.3, duration=1),
        "painleve_rod": painleve(),
        "friction_extremes": scene(
            "friction_extremes", "A block on ice, and a plate on a wall of 84 degrees with friction 10.",
            [free("ice", "box", (0.1, 0.1, 0.1), 1, (0, 0, 0.1), friction=0, velocity=(1, 0, 0)),
             free("wall", "box", (0.2, 0.2, 0.005), 1,
                  (0.005 * math.sin(math.atan(9)), 20, 0.005 * math.cos(math.atan(9)) + 5), (0, math.atan(9), 0), 10)],
            duration=5, more=["environment:", f"  - {{name: cliff, box: [2, 1, 0.1], position: {vec(-0.1 * math.sin(math.atan(9)), 20, 5 - 0.1 * math.cos(math.atan(9)))},"
                              f" rpy: {vec(0, math.atan(9), 0)}, friction: 10}}"]),
        "mass_ratio": mass_ratio(),
        "pyramid_20": pyramid(20),
        "card_pair_sharp": card_pair("card_pair_sharp", 1.02, "Two cards with sharp edges lean on each other."),
        "card_house": card_house(),
        "bouncing": scene("bouncing", "A ball of restitution 0.8 falls from 1 m.",
                          [free("ball", "sphere", 0.1, 1, (0, 0, 1.1), extra="restitution: 0.8")], step=0.0005, duration=5),
        "rolling_box": rolling_box(),
        "cradle_touching": cradle("cradle_touching", 0, "Five balls in a row, touching; the first comes at 1 m/s."),
        "cradle_apart": cradle("cradle_apart", 0.01, "Five balls in a row, 10 mm apart; the first comes at 1 m/s."),
        "fast_thin": fast_thin(),
        "overlap": scene("overlap", "Two boxes start 10 mm inside each other, without gravity.",
                         [free("left", "box", (0.1, 0.1, 0.1), 1, (-0.095, 0, 0)),
                          free("right", "box", (0.1, 0.1, 0.1), 1, (0.095, 0, 0))], ground=None,
                         gravity=(0, 0, 0), duration=1),
        "dzhanibekov": dzhanibekov(),
        "coin": scene("coin", "A coin of 50 mm radius spins on its edge, leaning a little, until it lies.",
                      [free("coin", "cylinder", (0.05, 0.01), 0.2, (0, 0, 0.05 * math.cos(0.3) + 0.005 * math.sin(0.3) + 1e-4), (math.pi / 2 - 0.3, 0, 0), 0.3,
                            spin=(0, 15, 0), extra="rolling_friction: 0.001, torsional_friction: 0.001")],
                      ground="{friction: 0.3, rolling_friction: 0.001, torsional_friction: 0.001}", step=0.001, duration=8),
        "fast_spin": scene("fast_spin", "A disk lies on the ground and spins at 10000 rad/s; another one flies.",
                           [free("lying", "cylinder", (0.05, 0.02), 0.5, (0, 0, 0.01), spin=(0, 0, 1e4)),
                            free("flying", "cylinder", (0.05, 0.02), 0.5, (1, 0, 2), (0.3, 0, 0), spin=(0, 0, 1e4))],
                           duration=2),
        "chain_100": hanging_chain(100),
        "chain_1000": hanging_chain(1000, drag=2.5),
        "humanoid": scene("humanoid", "A humanoid falls on its side and on its own limbs.",
                          ["urdf: ../../robots/humanoid.urdf, base: floating, position: [0, 0, 1.2],"
                           " rpy: [1.2, 0.6, 0.3], velocity: {angular: [1, 2, 3]}"], ground=0.8, duration=5),
        "time_steps": scene("time_steps", "A block slides at 0.4 m/s to a stop; three cubes stand.",
                            [free("block", "box", (0.1, 0.1, 0.02), 1, (0, 0, 0.02), velocity=(0.4, 0, 0)),
                             free("cube", "box", (0.1, 0.1, 0.1), 1, (2, 0, 0.1), extra="count: 3, spacing: [0, 0, 0.2]")],
                            duration=0.1),
    }
    for n in (10, 30, 100, 200):
        scenes[f"tower_{n}"] = tower(n)
    for name, text in scenes.items():
        files[f"scenes/hard/{name}.yaml"] = text
    for more in (round_card_files(), wedge_files(), contact_points(), arch_files(0.12), arch_files(0.09), tops(), tippe_top(),
                 whip(100), net_files(), gripper_files(), servo_chain(), singular_poses(), scales()):
        files.update(more)
    return files
