"""Hard cases of stacks and masonry: towers, cards, arches."""
import math

from scenes.files import free, link, mesh_body, num, obj, scene, urdf, vec


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
        # Neighbours are half an edge apart: each cube rests on two.
        step = 1.5 * edge
        rows.append(free(f"row{r}_", "box", (0.1, 0.1, 0.1), 1,
                         (-0.5 * step * (n - r - 1), 0, edge * (r + 0.5)),
                         extra=f"count: {n - r}, spacing: {vec(step, 0, 0)}"))
    return scene(f"pyramid_{n}", f"{n * (n + 1) // 2} cubes in {n} layers, each on two below.", rows)


def contact_points():
    """A box that slides and comes to rest on 4, 16 or 100 feet."""
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


CARD = (0.001, 0.1, 0.1)  # half thickness, half width, half length [m]


def leaning_card(name, foot_x, foot_z, theta, mu, side):
    """A leaning card with its inner lower edge at (foot_x, foot_z); side -1: stands on the left and leans to the right."""
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
    """Cards with rounded edges, so that the normal of their mutual contact is horizontal."""
    t, w, l = CARD
    moments = tuple(0.01 / 3 * s for s in (w * w + l * l, t * t + l * l, t * t + w * w))
    body = '  <link name="card">\n    <inertial><mass value="0.01"/><inertia' + "".join(
        f' i{a}="{num(m)}"' for a, m in zip(("xx", "yy", "zz"), moments)) + ' ixy="0" ixz="0" iyz="0"/></inertial>\n'
    for z in (-l, l):
        body += (f'    <collision><origin xyz="0 0 {num(z)}" rpy="{num(math.pi / 2)} 0 0"/><geometry>'
                 f'<capsule radius="{num(t)}" length="{num(2 * w)}"/></geometry></collision>\n')
    files = {"robots/hard/card.urdf": urdf("card", "A card of which only the rounded edges touch.", body + "  </link>\n")}
    theta = math.atan(0.552)
    # Balance of moments about the foot: N (t + 2 l cos) = m g l sin; friction N <= mu m g.
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
    reach = 2 * l * math.sin(theta)  # distance of a foot from its apex
    pitch = 2 * reach + 0.006        # distance between apexes
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
    """A semicircular arch of n equal wedges, with mean radius 1 m and thickness `ratio`."""
    half, depth = math.pi / (2 * n), 0.1
    inner, outer = 1 - ratio / 2, 1 + ratio / 2
    # Cross-section: a trapezoid, symmetric about the radial axis z, with sides along the radii.
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
        turn = -math.pi / 2 + half * (2 * i + 1)  # angle from the vertical, about y
        position = (center * math.sin(turn), 0, center * math.cos(turn))
        blocks.append(f"urdf: ../../robots/hard/{name}.urdf, name: block{i}, base: floating, friction: 0.9,"
                      f" position: {vec(*position)}, rpy: {vec(0, turn, 0)}")
    key = "stands" if ratio > 0.1075 else "falls"
    return {f"robots/hard/{name}.obj": obj(corners),
            f"robots/hard/{name}.urdf": mesh_body(name, name + ".obj", mass, moments),
            f"scenes/hard/arch_{key}.yaml": scene(
                f"arch_{key}", f"A half circle of {n} loose wedges, mean radius 1 m, thickness {ratio} m.",
                blocks, ground=0.9, duration=10 if key == "stands" else 3)}
