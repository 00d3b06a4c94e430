"""Scenes of problems that others published: the IFToMM multibody benchmark (A02, A03, A05; A01 is data/scenes/pendulum,
A04 data/scenes/hard/bricard) and SimBenchmark (its rolling test is data/scenes/hard/rolling_box). scripts/make_data.py
writes them.
"""
import math
import random

from scenes.files import free, joint, link, num, scene, urdf, vec

MIDPOINT = "integrator: implicit_midpoint"


def windows(n):
    """A02: n four-bar windows side by side, of rods of 1 m and 1 kg; the feet of the uprights are hinged to the ground."""
    moments = (1 / 12, 1 / 12, 1e-4)
    body = '  <link name="frame"/>\n'
    speeds, ties = [], ["closures:"]
    for i in range(n + 1):
        body += link(f"upright{i}", 1, moments, center=(0, 0, 0.5))
        body += joint(f"u{i}", "continuous", "frame", f"upright{i}", (i, 0, 0))
        speeds.append(f"u{i}: 1")
        if i == n:
            continue
        body += link(f"top{i}", 1, (1e-4, 1 / 12, 1 / 12), center=(0.5, 0, 0))
        body += joint(f"t{i}", "continuous", f"upright{i}", f"top{i}", (0, 0, 1))
        speeds.append(f"t{i}: -1")
        ties.append(f"  - {{type: ball, name: pin{i}, between: [top{i}, upright{i + 1}],"
                    f" anchor_a: [1, 0, 0], anchor_b: [0, 0, 1]}}")
    text = scene(f"windows_{n}", f"IFToMM benchmark A02: {n} four-bar windows, upright; their tops move at 1 m/s.",
                 [f"urdf: ../../robots/hard/windows_{n}.urdf, joint_velocities: {{{', '.join(speeds)}}}"],
                 ground=None, step=0.001, more=[MIDPOINT] + ties)
    return {f"robots/hard/windows_{n}.urdf": urdf(f"windows_{n}", f"{2 * n + 1} rods hinged about y.", body),
            f"scenes/hard/windows_{n}.yaml": text}


def andrews():
    """A03: Andrews' squeezing mechanism, dimensions and start of the Test Set for IVP Solvers (Mazzia, Magherini 2008)."""
    O, A, B, C = (0, 0), (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    d, da, e, ea, rr, ra = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092
    ss, sa, sb, sc, sd = 0.035, 0.01874, 0.01043, 0.018, 0.02
    ta, tb, u, ua, ub, zf, fa, zt = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.01421, 0.04

    def plate(name, mass, inertia, x, y=0.0):
        return link(name, mass, (0.6 * inertia, 0.6 * inertia, inertia), center=(x, y, 0))

    def hinge(name, parent, child, at):
        return joint(name, "continuous", parent, child, (*at, 0), (0, 0, 1))
    body = '  <link name="frame"/>\n'
    body += plate("k1", 0.04325, 2.194e-6, ra) + hinge("beta", "frame", "k1", O)
    body += plate("k2", 0.00365, 4.410e-7, -da) + hinge("theta", "k1", "k2", (rr, 0))
    body += plate("k3", 0.02373, 5.255e-6, sb, -sa) + hinge("gamma", "frame", "k3", B)
    body += plate("k5", 0.07050, 1.169e-5, ta, tb) + hinge("delta", "frame", "k5", A)
    body += plate("k4", 0.00706, 5.667e-7, 0, ea - e) + hinge("phi", "k5", "k4", (zt, 0))
    body += plate("k7", 0.05498, 1.912e-5, ub, -ua) + hinge("epsilon", "frame", "k7", A)
    body += plate("k6", 0.00706, 5.667e-7, zf - fa) + hinge("omega", "k7", "k6", (0, -u))
    start = {"beta": -0.0617138900142764496358948458001, "theta": 0, "gamma": 0.455279819163070380255912382449,
             "phi": 0.222668390165885884674473185609, "delta": 0.487364979543842550225598953530,
             "omega": -0.222668390165885884674473185609, "epsilon": 1.23054744454982119249735015568}
    angles = ", ".join(f"{name}: {num(x)}" for name, x in start.items())
    ties = ["closures:"] + [f"  - {{type: ball, name: {name}, between: [k2, {name}], anchor_a: {vec(-d, 0, 0)},"
                            f" anchor_b: {vec(*end, 0)}}}"
                            for name, end in (("k3", (0, -ss)), ("k4", (0, -e)), ("k6", (zf, 0)))]
    spring = ["tendons:", f"  - {{name: spring, path: [{{point: {vec(sd, -sc, 0)}, link: k3}},"
                          f" {{point: {vec(*C, 0)}, link: world}}], stiffness: 4530, rest_length: 0.07785}}"]
    text = scene("andrews", "IFToMM benchmark A03: Andrews' squeezing mechanism, driven by 0.033 N m on beta.",
                 [f"urdf: ../../robots/hard/andrews.urdf, joints: {{{angles}}}"], ground=None, gravity=(0, 0, 0),
                 step=2.5e-6, duration=0.03, more=[MIDPOINT] + ties + spring)
    return {"robots/hard/andrews.urdf": urdf("andrews", "Seven plates hinged about z.", body),
            "scenes/hard/andrews.yaml": text}


def governor():
    """A05: a stiff flyball governor; boxes of 3000 kg/m^3, a point mass of 5 kg at the end of each rod."""
    def cuboid(mass, x, y, z):
        return tuple(mass * (a * a + b * b) / 12 for a, b in ((y, z), (x, z), (x, y)))
    rod, ball = 0.3, 5.0
    center = (0.5 * rod + ball) / (rod + ball)
    along, across, _ = cuboid(rod, 1, 0.01, 0.01)
    across += rod * (0.5 - center) ** 2 + ball * (1 - center) ** 2
    body = '  <link name="frame"/>\n' + link("shaft", 0.3, cuboid(0.3, 0.01, 0.01, 1), center=(0, 0, 0.5))
    body += joint("spin", "continuous", "frame", "shaft", axis=(0, 0, 1))
    body += link("slider", 3, cuboid(3, 0.1, 0.1, 0.1))
    body += joint("slide", "prismatic", "shaft", "slider", axis=(0, 0, 1),
                  rest='<limit lower="-1" upper="2" effort="1e6" velocity="1e3"/>')
    springs = ["tendons:"]
    for side, sign in (("right", 1), ("left", -1)):
        body += link(f"rod_{side}", rod + ball, (along, across, across), center=(sign * center, 0, 0))
        body += joint(side, "continuous", "shaft", f"rod_{side}", (sign * 0.05, 0, 1), (0, sign, 0))
        springs.append(f"  - {{name: spring_{side}, path: [{{point: {vec(sign * 0.05, 0, 0)}, link: slider}},"
                       f" {{point: {vec(sign * 0.5, 0, 0)}, link: rod_{side}}}], stiffness: 8e5, damping: 4e4,"
                       f" rest_length: 0.5}}")
    angle = num(math.radians(30))
    text = scene("governor", "IFToMM benchmark A05: a flyball governor at 2 pi rad/s, its rods tied by stiff springs.",
                 [f"urdf: ../../robots/hard/governor.urdf, joints: {{slide: 0.5, right: {angle}, left: {angle}}},"
                  f" joint_velocities: {{spin: {num(2 * math.pi)}}}"],
                 ground=None, step=0.0002, more=springs)
    return {"robots/hard/governor.urdf": urdf("governor", "A shaft, its slider, two rods with balls.", body),
            "scenes/hard/governor.yaml": text}


def balls_666(name, height, restitution, about):
    """216 balls in a grid; each coordinate is moved by up to 1 mm."""
    place = random.Random(42)
    balls = [free(f"b{i}{j}{k}", "sphere", 0.1, 10, [round(0.21 * x + 0.001 * place.random(), 9) + shift
                                                    for x, shift in ((i, 0), (j, 0), (k, height))],
                  friction=0, extra=f"restitution: {num(restitution)}" if restitution else "")
             for i in range(6) for j in range(6) for k in range(6)]
    ground = f"{{friction: 0, restitution: {num(restitution)}}}"
    return {f"scenes/hard/{name}.yaml": scene(name, about, balls, ground=ground, step=0.001,
                                              more=[MIDPOINT] if restitution else [])}


def published_files():
    files = {}
    for more in (windows(2), windows(40), andrews(), governor(),
                 balls_666("balls_666", 0.101, 0, "SimBenchmark, 666: 216 balls of 10 kg without friction."),
                 balls_666("elastic_666", 1.101, 1, "SimBenchmark, elastic 666: 216 elastic balls fall 1 m.")):
        files.update(more)
    balls = [free(f"b{i}{j}", "sphere", 0.1, 10, (2 * i, 2 * j, 5), friction=0, extra="restitution: 1")
             for i in range(7) for j in range(7)]
    files["scenes/hard/bouncing_49.yaml"] = scene(
        "bouncing_49", "SimBenchmark, bouncing: 49 elastic balls of 10 kg fall 4.9 m.", balls,
        ground="{friction: 0, restitution: 1}", step=0.001, duration=20, more=[MIDPOINT])
    return files
