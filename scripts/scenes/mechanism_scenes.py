"""Scenes of mechanisms for long runs of `counterpoint hard-cases`: closed linkages, mimic joints and joint limits.
scripts/make_data.py writes them into data/scenes/hard and data/robots/hard.

Bars are uniform, 1 kg/m; there is no damping unless stated.
"""
import math

from scenes.files import joint, link, scene, urdf, vec


def bar(name, along):
    """A bar from the link's origin along an axis: along = (x, y, z), exactly one of them nonzero."""
    length = sum(abs(x) for x in along)
    moments = tuple(1e-4 * length if x else length ** 3 / 12 for x in along)
    return link(name, length, moments, center=tuple(0.5 * x for x in along))


def four_bar():
    bars = (0.3, 0.8, 0.6)
    body = '  <link name="frame"/>\n'
    for i, length in enumerate(bars):
        body += bar(f"bar{i}", (length, 0, 0))
        body += joint(f"j{i}", "continuous", f"bar{i - 1}" if i else "frame", f"bar{i}", (bars[i - 1] if i else 0, 0, 0))
    text = scene("four_bar", "A four-bar linkage swings under its weight; its tip is tied to the world.",
                 ["urdf: ../../robots/hard/four_bar.urdf, joints: {j0: 0, j1: -0.4, j2: -0.9}"], ground=None, step=0.001,
                 more=["closures:", f"  - {{type: ball, name: pivot, between: [bar2, world], anchor_a: {vec(bars[2], 0, 0)}}}"])
    return {"robots/hard/four_bar.urdf": urdf("four_bar", "Three bars hinged about y.", body),
            "scenes/hard/four_bar.yaml": text}


def flat_linkage():
    """A parallelogram that turns over: twice a turn it is flat, where its closure loses a rank."""
    body = '  <link name="frame"/>\n' + bar("left", (0, 0, 1)) + bar("top", (1, 0, 0)) + bar("right", (0, 0, -1))
    body += joint("j0", "continuous", "frame", "left")
    body += joint("j1", "continuous", "left", "top", (0, 0, 1))
    body += joint("j2", "continuous", "top", "right", (1, 0, 0))
    text = scene("flat_linkage", "A parallelogram of bars turns over through its flat, singular poses.",
                 ["urdf: ../../robots/hard/flat_linkage.urdf, joint_velocities: {j0: 1, j1: -1, j2: 1}"], ground=None,
                 more=["closures:", "  - {type: ball, name: pivot, between: [right, world], anchor_a: [0, 0, -1]}"])
    text = text.replace("name: flat_linkage\n", "name: flat_linkage\nintegrator: runge_kutta_4\n")
    return {"robots/hard/flat_linkage.urdf": urdf("flat_linkage", "Three bars hinged about y.", body),
            "scenes/hard/flat_linkage.yaml": text}


def slider_crank():
    """The crank starts at 20 rad/s, with consistent velocities of rod and slider."""
    crank, rod, w, a = 0.1, 0.3, 20.0, 0.5
    body = '  <link name="frame"/>\n' + bar("crank", (crank, 0, 0)) + bar("rod", (rod, 0, 0))
    body += link("slider", 0.2, (1e-4, 1e-4, 1e-4))
    body += joint("crank", "continuous", "frame", "crank")
    body += joint("wrist", "continuous", "crank", "rod", (crank, 0, 0))
    body += joint("slide", "prismatic", "frame", "slider", (0, 0, 0), (1, 0, 0),
                  '<limit lower="-1" upper="1" effort="1000" velocity="100"/>')
    # The heights of crank and rod add up to zero: crank sin a + rod sin(a + b) = 0.
    total = math.asin(-crank / rod * math.sin(a))
    rate = -crank * math.cos(a) * w / (rod * math.cos(total))
    slide = crank * math.cos(a) + rod * math.cos(total)
    slide_rate = -crank * math.sin(a) * w - rod * math.sin(total) * rate
    text = scene("slider_crank", "A crank turns over and drives a slider through a rod.",
                 [f"urdf: ../../robots/hard/slider_crank.urdf,"
                  f" joints: {{crank: {a:.15g}, wrist: {total - a:.15g}, slide: {slide:.15g}}},"
                  f" joint_velocities: {{crank: {w:.15g}, wrist: {rate - w:.15g}, slide: {slide_rate:.15g}}}"],
                 ground=None, step=0.0005,
                 more=["closures:", f"  - {{type: ball, name: pin, between: [rod, slider], anchor_a: {vec(rod, 0, 0)}, anchor_b: [0, 0, 0]}}"])
    return {"robots/hard/slider_crank.urdf": urdf("slider_crank", "A crank, its rod, a slider along x.", body),
            "scenes/hard/slider_crank.yaml": text}


def bricard():
    """Five bars of 1 m along the edges of a cube and six hinges; by count of constraints it is rigid, but it moves."""
    edges = ((1, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, 1, 0))
    axes = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    body = '  <link name="frame"/>\n'
    for i in range(5):
        body += bar(f"bar{i}", edges[i])
        body += joint(f"j{i}", "continuous", f"bar{i - 1}" if i else "frame", f"bar{i}", edges[i - 1] if i else (0, 0, 0), axes[i])
    # Two ball closures form the sixth hinge, about x through the end of the last bar.
    ties = ["closures:"] + [f"  - {{type: ball, name: hinge_{side}, between: [bar4, world], anchor_a: {vec(x, 1, 0)}}}"
                            for side, x in (("left", -0.1), ("right", 0.1))]
    text = scene("bricard", "Bricard's linkage, overconstrained and movable (IFToMM benchmark A04).",
                 ["urdf: ../../robots/hard/bricard.urdf"], ground=None, step=0.001, more=ties)
    return {"robots/hard/bricard.urdf": urdf("bricard", "Five bars along edges of a cube.", body),
            "scenes/hard/bricard.yaml": text}


def geared():
    body = '  <link name="frame"/>\n'
    for name, x in (("slow", 0), ("fast", 0.5)):
        body += bar(name, (0, 0, -0.5))
        body += joint(name, "continuous", "frame", name, (x, 0, 0),
                      rest="" if name == "slow" else '<mimic joint="slow" multiplier="-2" offset="0.3"/>')
    text = scene("geared", "Two pendulums in gear: one turns twice as far, the other way.",
                 ["urdf: ../../robots/hard/geared.urdf, joints: {slow: 1.2}"], ground=None, step=0.001)
    return {"robots/hard/geared.urdf": urdf("geared", "Two bars that hang, one geared to the other by -2.", body),
            "scenes/hard/geared.yaml": text}


def hung_chain():
    joints = ", ".join(f"hinge_{i}: {a}" for i, a in enumerate((-1.3, 0.3, 0.6, 0.6, 0.6)))
    text = scene("hung_chain", "A chain of five rods hangs by both its ends, and swings.",
                 [f"urdf: ../../robots/planar_chain.urdf, joints: {{{joints}}}"], ground=None, step=0.001,
                 more=["closures:", "  - {type: ball, name: end, between: [rod_4, world], anchor_a: [0, 0, -0.4]}"])
    return {"scenes/hard/hung_chain.yaml": text}


def ball_chain(n=4):
    """Rods on ball joints, released from the horizontal with some spin: quaternions in a long run."""
    across, along = 0.1 * 0.2 ** 2 / 12, 0.1 * 0.02 ** 2 / 2
    body = '  <link name="hook"/>\n'
    for i in range(n):
        body += link(f"link{i}", 0.1, (along, across, across), center=(0.1, 0, 0))
        body += joint(f"j{i}", "floating", f"link{i - 1}" if i else "hook", f"link{i}", (0.2 if i else 0, 0, 0))
    types = ", ".join(f"j{i}: spherical" for i in range(n))
    text = scene("ball_chain", f"{n} rods on ball joints, let go from the horizontal, the first one sideways.",
                 [f"urdf: ../../robots/hard/ball_chain.urdf, joint_types: {{{types}}}, joint_velocities: {{j0: [0, 0, 2]}}"],
                 ground=None, step=0.001)
    return {"robots/hard/ball_chain.urdf": urdf("ball_chain", f"{n} rods on ball joints.", body),
            "scenes/hard/ball_chain.yaml": text}


def crane():
    """Free bodies only: a beam on two rods, a load on a third rod, and two boxes welded together on a hook."""
    def box(name, half, mass, position):
        return f"name: {name}, box: {vec(*half)}, mass: {mass}, position: {vec(*position)}"
    # The bodies may pass through each other: contacts are tested by other cases.
    ties = ["groups: {all: [beam/body, load/body, inner/body, outer/body]}", "exclude: [[all, all]]", "closures:",
            "  - {type: distance, name: left, between: [world, beam/body], anchor_a: [-0.5, 0, 2], anchor_b: [-0.5, 0, 0]}",
            "  - {type: distance, name: right, between: [world, beam/body], anchor_a: [0.5, 0, 2], anchor_b: [0.5, 0, 0]}",
            "  - {type: distance, name: rope, between: [beam/body, load/body], anchor_a: [0.5, 0, 0]}",
            "  - {type: ball, name: hook, between: [beam/body, inner/body], anchor_a: [-0.5, 0, 0], anchor_b: [0, 0, 0.2]}",
            "  - {type: weld, name: weld, between: [inner/body, outer/body], anchor_a: [0.1, 0, 0]}"]
    text = scene("crane", "A beam on two rods carries a load on a third and two boxes, welded together, on a hook.",
                 [box("beam", (0.5, 0.02, 0.02), 1, (0.3, 0, 1)), box("load", (0.1, 0.1, 0.1), 2, (0.8, 0.2, 0.5)),
                  box("inner", (0.05, 0.05, 0.05), 0.5, (-0.2, 0, 0.8)), box("outer", (0.05, 0.05, 0.05), 0.5, (0, 0, 0.8))],
                 ground=None, step=0.001, more=ties)
    return {"scenes/hard/crane.yaml": text}


def mechanism_files():
    files = {}
    for more in (four_bar(), flat_linkage(), slider_crank(), bricard(), geared(), hung_chain(), ball_chain(), crane()):
        files.update(more)
    for name in ("bricard", "hung_chain", "ball_chain"):
        text = files[f"scenes/hard/{name}.yaml"]
        files[f"scenes/hard/{name}_midpoint.yaml"] = text.replace(
            f"name: {name}\n", f"name: {name}_midpoint\nintegrator: implicit_midpoint\n")
    return files
