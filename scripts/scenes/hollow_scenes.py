"""Scenes of bodies that are not convex, and their meshes: a bowl, a cup, links of a chain, a ring, a mug on a hook,
brackets in a bin."""
import math

from scenes.files import num, vec

HEAD = "# Written by scripts/make_data.py (hollow_scenes.py)."


class Mesh:
    """Vertices and triangles, counter-clockwise seen from outside."""

    def __init__(self, about):
        self.about, self.vertices, self.triangles = about, [], []

    def point(self, x, y, z):
        self.vertices.append((x, y, z))
        return len(self.vertices)

    def band(self, rings):
        """Joins rings of points, each as long as the next or a single point, in order."""
        for low, high in zip(rings, rings[1:]):
            n = max(len(low), len(high))
            at = lambda ring, k: ring[k % n] if len(ring) > 1 else ring[0]
            for k in range(n):
                a, b, c, d = at(low, k), at(low, k + 1), at(high, k + 1), at(high, k)
                if a != b:
                    self.triangles.append((a, b, c))
                if c != d:
                    self.triangles.append((a, c, d))

    def revolve(self, outline, sectors, closed=False, turn=0.0):
        """Turns points (radius, z) about z, from `turn` [rad] on."""
        rings = []
        for r, z in outline:
            turns = [turn + 2 * math.pi * k / sectors for k in range(sectors)] if r > 0 else [0]
            rings.append([self.point(r * math.cos(a), r * math.sin(a), z) for a in turns])
        self.band(rings + rings[:1] if closed else rings)
        return self

    def arc(self, center, radius, tube, begin, end, steps, corners=12):
        """A bent rod in the x-z plane, closed at its ends; angles from +x towards +z, begin < end."""
        x, z = center
        rings = []
        for k in range(steps + 1):
            a = begin + (end - begin) * k / steps
            ring = []
            for c in range(corners):
                b = 2 * math.pi * c / corners
                r = radius + tube * math.cos(b)
                ring.append(self.point(x + r * math.cos(a), tube * math.sin(b), z + r * math.sin(a)))
            rings.append(ring)
        first, last = ([self.point(x + radius * math.cos(a), 0, z + radius * math.sin(a))] for a in (begin, end))
        self.band([first] + rings + [last])
        return self

    def extrude(self, outline, height):
        """Moves points (x, y), counter-clockwise and star-shaped about the first, along z, about z = 0."""
        low, high = ([self.point(x, y, z) for x, y in outline] for z in (-height / 2, height / 2))
        self.band([low, high])
        for k in range(2, len(outline)):
            self.triangles.append((low[0], low[k], low[k - 1]))
            self.triangles.append((high[0], high[k - 1], high[k]))
        return self

    def text(self):
        lines = [f"# {self.about}", HEAD]
        lines += ["v " + " ".join(f"{c:.9g}" for c in p) for p in self.vertices]
        lines += ["f " + " ".join(str(i) for i in t) for t in self.triangles]
        return "\n".join(lines) + "\n"


def circle(radius, tube, corners):
    turns = [2 * math.pi * k / corners for k in range(corners)]
    return [(radius + tube * math.cos(a), tube * math.sin(a)) for a in turns]


BOWL_RINGS, BOWL_SECTORS, BOWL_STEP = 8, 16, 0.05  # breadth of a ring [rad]


def bowl():
    """Flat faces that touch a ball of radius 0.4 m in the middle; the x axis runs through middles."""
    wide = 1 / math.cos(math.pi / BOWL_SECTORS)
    corners = [(0.4 / math.cos(BOWL_STEP / 2), (k + 0.5) * BOWL_STEP) for k in range(BOWL_RINGS)]
    inside = [(0, -0.4)] + [(wide * r * math.sin(a), -r * math.cos(a)) for r, a in corners]
    outside = [(1.1 * r, 1.1 * z) for r, z in inside]
    mesh = Mesh("Part of a hollow ball, inner radius 0.4 m about the origin, to 0.375 rad")
    return mesh.revolve(outside + inside[::-1], BOWL_SECTORS, turn=math.pi / BOWL_SECTORS)


def cup(about="Cup, radius 50 mm, height 100 mm, wall 5 mm"):
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.045, 0.1), (0.045, 0.005), (0, 0.005)]
    return Mesh(about).revolve(outline, 32)


MESHES = {
    "bowl": bowl(),
    "cup": cup(),
    "link": Mesh("Link of a chain: torus, radius 30 mm, tube 6 mm").revolve(circle(0.03, 0.006, 12), 24, True),
    "ring": Mesh("Ring: torus, radius 80 mm, tube 15 mm").revolve(circle(0.08, 0.015, 12), 32, True),
    "mug": cup("Mug, radius 50 mm, with a handle; the handle's ends are within the wall").arc(
        (0.0475, 0.05), 0.03, 0.005, -0.5 * math.pi, 0.5 * math.pi, 16),
    "hook": Mesh("Hook: a bent rod of 4 mm radius").arc((0, 0), 0.02, 0.004, -math.pi, 0.25 * math.pi, 20),
    "bracket": Mesh("Bracket: an L of 60 mm and 40 mm, 12 mm thick, 30 mm wide, about the centre of its box").extrude(
        [(-0.03, -0.02), (0.03, -0.02), (0.03, -0.008), (-0.018, -0.008), (-0.018, 0.02), (-0.03, 0.02)], 0.03),
}


def scene(name, about, environment, models, duration, ground=None, meshes=""):
    lines = [f"# {about}", HEAD, f"name: {name}", f"duration: {num(duration)}  # s"]
    if meshes:
        lines.append(f"meshes: {{{meshes}}}")
    if ground:
        lines.append(f"ground: {{friction: {num(ground)}}}")
    if environment:
        lines.append("environment:")
        lines += [f"  - {{{e}}}" for e in environment]
    lines.append("models:")
    lines += [f"  - {{{m}}}" for m in models]
    return "\n".join(lines) + "\n"


def chain(links):
    out = []
    for k in range(1, links + 1):
        rpy = vec(1.5707963267949, 0, 0 if k % 2 == 0 else 1.5707963267949)
        out.append(f"name: link{k}, mesh: link.obj, mass: 0.05, position: {vec(0, 0, -0.048 * k)}, rpy: {rpy}, "
                   "friction: 0.3")
    return out


def brackets(count):
    """The ball around a bracket has a diameter of 78.1 mm, so that none meets another at the start."""
    out = []
    for k in range(count):
        place = vec(0.08 * (k % 3) - 0.08, 0.08 * (k // 3 % 3) - 0.08, 0.05 + 0.08 * (k // 9))
        rpy = vec(0.7 * (k % 5), 0.9 * (k % 3), 1.1 * (k % 7))
        out.append(f"name: bracket{k}, mesh: bracket.obj, mass: 0.1, position: {place}, rpy: {rpy}, friction: 0.5")
    return out


def hollow_files():
    wall = "friction: 0.5"
    start = vec(0.35 * math.sin(5 * BOWL_STEP), 0, -0.35 * math.cos(5 * BOWL_STEP))  # on the middle of a face
    scenes = [
        scene("ball_in_bowl", "A ball rolls in a bowl: period 2 pi sqrt(7 (0.4 - 0.05) / (5 g)) = 1.404 s (small swings).",
              ["name: bowl, mesh: bowl.obj, friction: 0.5"],
              [f"name: ball, sphere: 0.05, mass: 0.3, position: {start}, friction: 0.5"], 3, meshes="tolerance: 0.00001"),
        scene("ball_in_cup", "A ball dropped into a cup rests on its bottom, 25 mm above the ground.", [],
              ["name: cup, mesh: cup.obj, mass: 0.2, position: [0, 0, 0.01], friction: 0.5",
               "name: ball, sphere: 0.02, mass: 0.1, position: [0.015, 0.005, 0.15], friction: 0.5"], 3, 0.5,
              "tolerance: 0.001"),
        scene("chain_20", "Twenty links hang from a fixed one; link k carries (20 - k) 0.05 kg.",
              ["name: fixed, mesh: link.obj, rpy: [1.5707963267949, 0, 0], friction: 0.3"], chain(20), 3,
              meshes="tolerance: 0.001"),
        scene("ring_on_peg", "A ring thrown over a peg lies around it, 15 mm above the ground.",
              [f"name: peg, cylinder: [0.02, 0.2], position: [0, 0, 0.1], {wall}"],
              ["name: ring, mesh: ring.obj, mass: 0.3, position: [-0.03, 0.01, 0.28], rpy: [0.4, 0.2, 0], "
               "velocity: {linear: [0.2, 0, 0]}, friction: 0.5"], 2, 0.5, "tolerance: 0.001"),
        scene("mug_on_hook", "A mug hangs by its handle on a hook.",
              ["name: hook, mesh: hook.obj, rpy: [0, 0, 1.5707963267949], friction: 0.3"],
              ["name: mug, mesh: mug.obj, mass: 0.3, position: [0.041, 0, -0.095], rpy: [0, -1.395, 0], friction: 0.3"], 3,
              meshes="tolerance: 0.001"),
        scene("brackets_in_bin", "Thirty brackets poured into a bin come to rest.",
              [f"name: left, box: [0.01, 0.12, 0.1], position: [-0.13, 0, 0.1], {wall}",
               f"name: right, box: [0.01, 0.12, 0.1], position: [0.13, 0, 0.1], {wall}",
               f"name: front, box: [0.14, 0.01, 0.1], position: [0, -0.13, 0.1], {wall}",
               f"name: back, box: [0.14, 0.01, 0.1], position: [0, 0.13, 0.1], {wall}"], brackets(30), 3, 0.5,
              "tolerance: 0.001"),
    ]
    files = {f"scenes/hollow/{name}.obj": mesh.text() for name, mesh in MESHES.items()}
    for text in scenes:
        name = text.split("name: ", 1)[1].split("\n", 1)[0]
        files[f"scenes/hollow/{name}.yaml"] = text
    return files
