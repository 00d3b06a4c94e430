"""Scenes of bodies that are not convex; hollow_meshes.py has their meshes."""
import math

from scenes.files import num, vec
from scenes.hollow_machines import gears, grasp, hand, pegs
from scenes.hollow_meshes import BOWL_STEP, HEAD, MESHES
from scenes.hollow_threads import THREADS, bolt, nut, nuts

# Friction of teeth reverses on the line of centres: with less smoothing, rounding there costs the inverse a digit.
REVERSES = "{smoothing: 1e-11}  # m; sliding reverses where teeth touch on the line of centres"


def scene(name, about, environment, models, duration, ground=None, meshes="", contact="", step=None):
    lines = [f"# {about}", HEAD, f"name: {name}", f"duration: {num(duration)}  # s"]
    if step:
        lines.append(f"time_step: {num(step)}  # s")
    if meshes:
        lines.append(f"meshes: {{{meshes}}}")
    if contact:
        lines.append(f"contact: {contact}")
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
              meshes="tolerance: 0.0005"),
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
        scene("peg_in_hole", "A peg falls to the floor of its hole; of two in tilted holes, one slides in and one jams.",
              *pegs(), 1, meshes="tolerance: 0.00001"),
        scene("nut_on_bolt", "M8 nuts on fixed bolts: one turns down by its weight, one is held by friction.", [],
              nuts(), 0.4, step=0.0005),
        scene("hand_on_mug", "A hand closes on the handle of a mug and lifts it by 0.1 m.", [], grasp(), 3, 0.5,
              "tolerance: 0.001"),
        scene("gears", "A pinion of 12 teeth turns a wheel of 24, which is braked: half as fast, the other way round.", [],
              ["name: gears, urdf: gears.urdf, joints: {wheel_turn: 0.1308996938995747}, friction: 0.1, dynamics: {"
               "pinion_turn: {servo: {damping: 1, velocity: 6.28318530717959}}, wheel_turn: {damping: 0.1}}"], 6,
              meshes="tolerance: 0.00005", contact=REVERSES),
    ]
    files = {"scenes/hollow/hand.urdf": hand(), "scenes/hollow/gears.urdf": gears(), "scenes/hollow/nut.urdf": nut(),
             "scenes/hollow/bolt.urdf": bolt()}
    files |= {f"scenes/hollow/{name}.obj": mesh.text() for name, mesh in (MESHES | THREADS).items()}
    for text in scenes:
        name = text.split("name: ", 1)[1].split("\n", 1)[0]
        files[f"scenes/hollow/{name}.yaml"] = text
    return files
