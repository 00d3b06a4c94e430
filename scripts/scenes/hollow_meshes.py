"""Meshes that are not convex, as .obj files: a bowl, a cup, links, a ring, a mug, a block, gears."""
import math

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


PEG, CLEARANCE, DEPTH = 0.005, 0.0001, 0.04  # radius, play of the diameter, depth of the hole [m]
FLANK, LEAN = 5, 0.05  # faces of a tooth above the base circle; its slope below more than radial
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


def gear(teeth, module=0.005, width=0.01, pressure=math.radians(25), backlash=0.0002):
    """A spur gear about z, a tooth on the x axis; each of a pair is thinner by half of the backlash, all in m.
    12 teeth of 25 degrees are not undercut. The roots lie on one regular polygon with a tooth on each side, whose
    planes part the teeth from it; below the base circle a tooth is narrower, so that it is convex."""
    pitch = module * teeth / 2
    base, tip, root = pitch * math.cos(pressure), pitch + module, pitch - 1.25 * module
    involute = lambda a: math.tan(a) - a
    middle = (math.pi * module / 2 - backlash / 2) / (2 * pitch) + involute(pressure)
    foot = math.tan(middle) - (1 - root / base / math.cos(middle)) * (math.tan(middle) + LEAN)
    foot = math.atan(foot * base * math.cos(middle) / root)
    flank = [(root / math.cos(foot), foot)]
    roll = math.sqrt((tip / base) ** 2 - 1)
    for k in range(FLANK + 1):  # chords of equal height over the involute
        t = roll * (k / FLANK) ** (2 / 3)
        flank.append((base * math.sqrt(1 + t * t), middle - t + math.atan(t)))
    mesh = Mesh(f"Spur gear: {teeth} involute teeth of module {1000 * module:g} mm, {1000 * width:g} mm wide")

    def face(z):
        """Points of the outline, in order, and triangles that face up."""
        ring, triangles, center = [], [], mesh.point(0, 0, z)
        at = lambda r, a: mesh.point(r * math.cos(a), r * math.sin(a), z)
        for k in range(teeth):
            turn = 2 * math.pi * k / teeth
            right, left = ([at(r, turn + side * a) for r, a in flank] for side in (-1, 1))
            for i in range(len(flank) - 1):
                triangles += [(right[i], right[i + 1], left[i + 1]), (right[i], left[i + 1], left[i])]
            core = [right[0], left[0], at(root / math.cos(math.pi / teeth), turn + math.pi / teeth)]
            ring += right + left[::-1] + core[2:]
            triangles += [(center, p, q) for p, q in zip(core, core[1:])]
        for k in range(teeth):  # from the corner between two teeth to the next tooth
            size = len(ring) // teeth
            triangles.append((center, ring[size * k - 1], ring[size * k]))
        return ring, triangles

    low, down = face(-width / 2)
    high, up = face(width / 2)
    mesh.band([low, high])
    mesh.triangles += up + [t[::-1] for t in down]
    return mesh


def drilled(outer, hole, height, depth, corners):
    """A block with a hole from above, both regular prisms about z with a face's middle on the x axis, in m."""
    wide = 1 / math.cos(math.pi / corners)
    outline = [(0, -height + depth), (outer, -height + depth), (outer, depth), (hole, depth), (hole, 0), (0, 0)]
    mesh = Mesh(f"Block with a hole: {corners} faces {1000 * hole:g} mm from the axis, {1000 * depth:g} mm deep")
    return mesh.revolve([(wide * r, z) for r, z in outline], corners, turn=math.pi / corners)


MESHES = {
    "bowl": bowl(),
    "cup": cup(),
    "link": Mesh("Link of a chain: torus, radius 30 mm, tube 6 mm").revolve(circle(0.03, 0.006, 12), 24, True),
    "ring": Mesh("Ring: torus, radius 80 mm, tube 15 mm").revolve(circle(0.08, 0.015, 12), 32, True),
    "mug": cup("Mug, radius 50 mm, with a handle; the handle's ends are within the wall").arc(
        (0.0475, 0.05), 0.03, 0.005, -0.5 * math.pi, 0.5 * math.pi, 16),
    "block": drilled(0.015, PEG + CLEARANCE / 2, 0.05, DEPTH, 16),
    "pinion": gear(12),
    "wheel": gear(24),
    "hook": Mesh("Hook: a bent rod of 4 mm radius").arc((0, 0), 0.02, 0.004, -math.pi, 0.25 * math.pi, 20),
    "bracket": Mesh("Bracket: an L of 60 mm and 40 mm, 12 mm thick, 30 mm wide, about the centre of its box").extrude(
        [(-0.03, -0.02), (0.03, -0.02), (0.03, -0.008), (-0.018, -0.008), (-0.018, 0.02), (-0.03, 0.02)], 0.03),
}
