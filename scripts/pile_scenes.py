#!/usr/bin/env python3
"""Writes scenes of random piles: boxes, balls, capsules, cylinders and convex hulls that fall into a heap.

    scripts/pile_scenes.py --count 64 --friction 2 --mass-range 1e3 --overlap 0.5 --seed 3 --out DIR
    scripts/pile_scenes.py --count 16 --chain --out DIR

Prints the scene's path, for `counterpoint simulate`. The same arguments write the same bytes. The hulls are written to
DIR/hulls, as URDFs with meshes. Standard library only. make_data.py writes data/scenes/piles with the functions of this
file.
"""
import argparse
import itertools
import json
import math
import pathlib
import random
import sys

from scenes.files import free, joint, link, num, scene, urdf, vec

KINDS = ("box", "sphere", "capsule", "cylinder", "hull")
SMALLEST, LARGEST = 0.05, 0.12  # range of half lengths and radii [m]
HULLS, HULL_CORNERS = 4, 14


# ---- hulls ---------------------------------------------------------------------------------------------

def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def faces_of(points):
    """Triangles of the convex hull of a few points in general position, counter-clockwise from outside."""
    faces = []
    for i, j, k in itertools.combinations(range(len(points)), 3):
        normal = cross(sub(points[j], points[i]), sub(points[k], points[i]))
        sides = [dot(normal, sub(p, points[i])) for n, p in enumerate(points) if n not in (i, j, k)]
        if all(s < 0 for s in sides):
            faces.append((i, j, k))
        elif all(s > 0 for s in sides):
            faces.append((i, k, j))
    return faces


def moments(points, faces):
    """Volume, centre and second moments (3 x 3, about the origin) of the hull at density 1."""
    volume, center, second = 0.0, [0.0] * 3, [[0.0] * 3 for _ in range(3)]
    for face in faces:
        a, b, c = (points[i] for i in face)
        v = dot(a, cross(b, c)) / 6
        volume += v
        total = [a[i] + b[i] + c[i] for i in range(3)]
        for i in range(3):
            center[i] += v * total[i] / 4
            for j in range(3):
                second[i][j] += v * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + total[i] * total[j]) / 20
    return volume, [c / volume for c in center], second


def hull(index):
    """Corners relative to the centre of mass, faces, and the inertia tensor per kilogram."""
    rng = random.Random(f"hull {index}")
    half = [rng.uniform(SMALLEST, LARGEST) for _ in range(3)]
    points = []
    for _ in range(HULL_CORNERS):
        direction = [rng.gauss(0, 1) for _ in range(3)]
        length = math.sqrt(dot(direction, direction))
        points.append(tuple(round(h * d / length, 6) for h, d in zip(half, direction)))
    faces = faces_of(points)
    _, center, _ = moments(points, faces)
    points = [tuple(round(x, 6) for x in sub(p, center)) for p in points]
    volume, _, second = moments(points, faces)
    trace = sum(second[i][i] for i in range(3))
    inertia = [[((trace if i == j else 0) - second[i][j]) / volume for j in range(3)] for i in range(3)]
    return points, faces, inertia


def hull_files(index, mass):
    """Returns {name below the folder of hulls: text} for hull `index`, and the URDF's name."""
    points, faces, inertia = hull(index)
    mesh = [f"# A convex hull of {HULL_CORNERS} random points. Written by scripts/pile_scenes.py."]
    mesh += ["v " + " ".join(num(x) for x in p) for p in points]
    mesh += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    name = f"hull_{index}_{num(mass)}kg"
    values = " ".join(f'i{a}="{mass * inertia["xyz".index(a[0])]["xyz".index(a[1])]:.9g}"'
                      for a in ("xx", "yy", "zz", "xy", "xz", "yz"))
    body = (f'  <link name="hull">\n    <inertial><mass value="{num(mass)}"/><inertia {values}/></inertial>\n'
            f'    <collision><geometry><mesh filename="hull_{index}.obj"/></geometry></collision>\n  </link>\n')
    text = urdf(name, "A convex hull of random points.", body).replace("make_data.py (hard_scenes.py)", "pile_scenes.py")
    return {f"hull_{index}.obj": "\n".join(mesh) + "\n", f"{name}.urdf": text}, f"{name}.urdf"


# ---- piles ---------------------------------------------------------------------------------------------

def turn(rng):
    """Roll, pitch and yaw of a uniformly distributed orientation."""
    return (rng.uniform(-math.pi, math.pi), math.asin(rng.uniform(-1, 1)), rng.uniform(-math.pi, math.pi))


def mass_of(rng, mass_range, whole_decades):
    if mass_range <= 1:
        return 1.0
    decades = math.log10(mass_range)
    if whole_decades:  # for hulls, so that there are few files
        return 10.0 ** rng.randint(-math.floor(decades), math.floor(decades))
    return float(f"{10 ** rng.uniform(-decades, decades):.6g}")


def size_of(rng, kind):
    def draw():
        return round(rng.uniform(SMALLEST, LARGEST), 4)

    if kind == "box":
        return (draw(), draw(), draw())
    if kind == "sphere":
        return draw()
    return (draw(), 2 * draw() if kind == "cylinder" else draw())


def reach_of(kind, size):
    """Largest distance of a shape's points from its centre [m]; for a hull, `size` is its index."""
    if kind == "sphere":
        return size
    if kind == "capsule":
        return size[0] + 0.5 * size[1]
    if kind == "cylinder":
        return math.hypot(size[0], 0.5 * size[1])
    return math.sqrt(max(dot(p, p) for p in hull(size)[0])) if kind == "hull" else math.hypot(*size)


def body(index, kind, size, mass, position, rpy, friction, files):
    if kind != "hull":
        return free(f"body{index}", kind, size, mass, position, rpy, friction)
    texts, file = hull_files(size, mass)
    files.update({f"hulls/{name}": text for name, text in texts.items()})
    return (f"urdf: hulls/{file}, name: body{index}, base: floating, position: {vec(*position)}, rpy: {vec(*rpy)},"
            f" friction: {num(friction)}")


def positions(rng, reaches, overlap, disc):
    """Places one body after another at the lowest of twelve random places in a disc of radius `disc`, such that their
    bounding balls at most touch. `overlap`: share of their size by which bodies may overlap each other or the ground."""
    placed = []
    for reach in (1.02 * (1 - overlap) * r for r in reaches):
        best = None
        for _ in range(12):
            angle, radius = rng.uniform(0, 2 * math.pi), disc * math.sqrt(rng.random())
            x, y, z = radius * math.cos(angle), radius * math.sin(angle), reach
            for px, py, pz, other in placed:
                above = (reach + other) ** 2 - (x - px) ** 2 - (y - py) ** 2
                if above > 0 and pz + math.sqrt(above) > z:
                    z = pz + math.sqrt(above)
            if best is None or z < best[2]:
                best = (x, y, z, reach)
        placed.append(best)
        yield tuple(round(c, 6) for c in best[:3])


def bin_walls(half):
    """Four walls around a square of half width `half`."""
    walls = ["environment:"]
    for name, x, y in (("west", -1, 0), ("east", 1, 0), ("south", 0, -1), ("north", 0, 1)):
        size = (0.1 if x else half + 0.2, 0.1 if y else half + 0.2, 2)
        walls.append(f"  - {{name: {name}, box: {vec(*size)}, position: {vec(x * (half + 0.1), y * (half + 0.1), 2)},"
                     " friction: 0.5}")
    return walls


def chain(links=12):
    """A chain of capsules with hinges about two alternating axes, as a URDF, that moves at 6 m/s towards the pile."""
    radius, length, mass = 0.03, 0.15, 0.5
    across = mass * (3 * radius ** 2 + (length + radius) ** 2) / 12
    along = 0.5 * mass * radius ** 2
    text = ""
    for i in range(links):
        text += link(f"link{i}", mass, (across, across, along), center=(0, 0, -0.5 * length),
                     geometry=[(f'<capsule radius="{radius}" length="{length - 2 * radius:g}"/>', (0, 0, -0.5 * length))])
        if i:
            text += joint(f"hinge{i}", "continuous", f"link{i - 1}", f"link{i}", (0, 0, -length),
                          (1, 0, 0) if i % 2 else (0, 1, 0))
    name = f"chain_{links}"
    text = urdf(name, "Capsules on hinges.", text).replace("make_data.py (hard_scenes.py)", "pile_scenes.py")
    model = (f"urdf: hulls/{name}.urdf, name: chain, base: floating, position: [-2, 0, 2], rpy: [0, 1.2, 0],"
             " friction: 0.5, velocity: {linear: [6, 0, 1], angular: [0, 3, 0]}")
    return {f"hulls/{name}.urdf": text}, model


def pile(name, count, friction=0.5, mass_range=1.0, overlap=0.0, seed=0, step=0.002, duration=5.0, with_chain=False,
         in_bin=False):
    """Returns {path: text} of a pile; its scene is NAME.yaml."""
    rng = random.Random(f"pile {count} {seed}")
    shapes = []
    for i in range(count):
        kind = KINDS[i % len(KINDS)]
        shapes.append((kind, rng.randrange(HULLS) if kind == "hull" else size_of(rng, kind)))
    reaches = {shape: reach_of(*shape) for shape in set(shapes)}
    largest = max(reaches.values())
    bin_half = round(max(0.14 * count ** (1 / 3), 1.1 * largest), 3)  # bodies lie some layers deep in it
    disc = bin_half - largest if in_bin else 0.12 * count ** (1 / 3)
    places = positions(rng, [reaches[shape] for shape in shapes], overlap, disc)
    models, files = [], {}
    for i, (shape, position) in enumerate(zip(shapes, list(places))):
        rpy = tuple(round(a, 6) for a in turn(rng))
        models.append(body(i, *shape, mass_of(rng, mass_range, shape[0] == "hull"), position, rpy, friction, files))
    about = f"{count} bodies fall into a {'bin' if in_bin else 'heap'}; friction {num(friction)}"
    about += f", masses {1 / mass_range:g} to {mass_range:g} kg" if mass_range > 1 else ", 1 kg each"
    about += f", at first up to {100 * overlap:g} % inside each other" if overlap > 0 else ""
    if with_chain:
        texts, model = chain()
        files.update(texts)
        models.append(model)
        about += "; a chain is thrown at them"
    text = scene(name, f"{about}. Seed {seed}.", models, ground=friction, step=step, duration=duration,
                 more=bin_walls(bin_half) if in_bin else ())
    files[f"{name}.yaml"] = text.replace("make_data.py (hard_scenes.py)", "pile_scenes.py")
    return files


def pile_name(count, friction, mass_range, overlap, seed, with_chain=False, in_bin=False):
    kind = ("chain_" if with_chain else "") + ("bin" if in_bin else "pile")
    return f"{kind}_{count}_mu{num(friction)}_m{num(mass_range)}_o{num(overlap)}_s{seed}"


def dominoes(count):
    """A row of dominoes, of which the first leans towards the others and falls."""
    half, lean, distance = (0.01, 0.025, 0.05), 0.25, 0.04
    x = half[2] * math.sin(lean) - half[0] * math.cos(lean)  # the centre's distance from the edge below it
    z = half[0] * math.sin(lean) + half[2] * math.cos(lean)
    models = [free("domino0", "box", half, 0.1, (round(x - half[0], 6), 0, round(z, 6)), (0, lean, 0))]
    models += [free(f"domino{i}", "box", half, 0.1, (round(distance * i, 6), 0, half[2])) for i in range(1, count)]
    return scene(f"dominoes_{count}", f"{count} dominoes in a row; the first falls.", models, step=0.002, duration=3)


def brick_wall(layers=8, length=8):
    """A wall of bricks in running bond that a ball of five bricks' mass hits at 20 m/s."""
    half, friction = (0.0995, 0.05, 0.04), 0.6
    models = [free(f"brick{i}_{k}", "box", half, 2, (round(0.2 * k + 0.1 * (i % 2), 6), 0, round(0.08 * i + 0.04, 6)),
                   friction=friction) for i in range(layers) for k in range(length)]
    models.append(free("ball", "sphere", 0.1, 10, (0.8, -2, 0.4), friction=friction, velocity=(0, 20, 0)))
    return scene("brick_wall", f"{layers * length} bricks, hit by a ball at 20 m/s.", models, ground=friction, step=0.002,
                 duration=3)


def bundled_pile_files():
    """Files of piles that make_data.py writes to data."""
    files = {f"scenes/piles/{name}.yaml": text.replace("make_data.py (hard_scenes.py)", "pile_scenes.py")
             for name, text in {"dominoes_50": dominoes(50), "brick_wall": brick_wall()}.items()}
    for name, options in {
            "pile_16": {"count": 16},
            "pile_64": {"count": 64},
            "pile_200": {"count": 200},
            "bin_64": {"count": 64, "in_bin": True},
            "pile_16_masses": {"count": 16, "friction": 2, "mass_range": 1e3},
            "pile_64_masses": {"count": 64, "friction": 2, "mass_range": 1e4},
            "pile_16_overlap": {"count": 16, "overlap": 0.5},
            "pile_64_overlap": {"count": 64, "overlap": 0.5, "friction": 2},
            "chain_into_pile": {"count": 16, "with_chain": True}}.items():
        files.update({f"scenes/piles/{file}": text for file, text in pile(name, **options).items()})
    return files


def write(files, folder):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=64, help="bodies; default 64")
    parser.add_argument("--friction", type=float, default=0.5, help="of all surfaces; default 0.5")
    parser.add_argument("--mass-range", type=float, default=1.0,
                        help="masses are 1/R to R kg, even in the logarithm (of hulls whole powers of 10); default 1: all 1 kg")
    parser.add_argument("--overlap", type=float, default=0.0,
                        help="share of their size, 0 to 0.5, by which bodies may start inside each other; default 0: apart")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--step", type=float, default=0.002, help="time step [s]; default 0.002")
    parser.add_argument("--duration", type=float, default=5.0, help="[s]; default 5")
    parser.add_argument("--chain", action="store_true", help="throw a chain of 12 links at the pile")
    parser.add_argument("--bin", action="store_true", help="walls around the bodies, so that they lie some layers deep")
    parser.add_argument("--name", help="of the scene and its file; default: made of the other arguments")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write to")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="write what was made as JSON")
    a = parser.parse_args()
    for good, message in ((a.count >= 1, "--count: expected 1 or more"), (a.friction >= 0, "--friction: expected 0 or more"),
                          (a.mass_range >= 1, "--mass-range: expected 1 or more"),
                          (0 <= a.overlap <= 0.5, "--overlap: expected 0 to 0.5"),
                          (a.step > 0 and a.duration > 0, "--step, --duration: expected positive numbers")):
        if not good:
            parser.error(message)
    name = a.name or pile_name(a.count, a.friction, a.mass_range, a.overlap, a.seed, a.chain, a.bin)
    files = pile(name, a.count, a.friction, a.mass_range, a.overlap, a.seed, a.step, a.duration, a.chain,
                 a.bin)
    write(files, a.out)
    if a.json:
        a.json.write_text(json.dumps({"scene": str(a.out / f"{name}.yaml"), "files": sorted(files)}, indent=2) + "\n")
    print(a.out / f"{name}.yaml")
    return 0


if __name__ == "__main__":
    sys.exit(main())
