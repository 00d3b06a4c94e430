"""Hard cases of friction: slopes, seams, a wedge."""
import math

from scenes.files import free, mesh_body, num, obj, scene, vec


def on_slope(name, tangent, friction, half, about, extra_models=()):
    theta = math.atan(tangent)
    position = (half[2] * math.sin(theta), 0, half[2] * math.cos(theta))
    return scene(name, about, [free("block", "box", half, 1, position, (0, theta, 0), friction)],
                 ground=f"{{normal: {vec(tangent, 0, 1)}, friction: {num(friction)}}}")


def seams():
    """Tiles of 13 cm side by side, over which bodies must slide as over one plane."""
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
