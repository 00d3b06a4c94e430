"""The scenes of `counterpoint hard-cases` (data/scenes/hard) and the robots that only they use.

scripts/make_data.py writes them. Defaults: g = 9.81 m/s^2, friction 0.5, time step 2 ms.
"""
import math

from scenes.files import free, scene, vec
from scenes.linked_scenes import gripper_files, hanging_chain, net_files, servo_chain, singular_poses, whip
from scenes.moving_scenes import cradle, dzhanibekov, fast_thin, rolling_box, scales, tippe_top, tops
from scenes.piled_scenes import (arch_files, card_house, card_pair, contact_points, mass_ratio, pyramid,
                                 round_card_files, tower)
from scenes.sliding_scenes import headings, on_slope, painleve, seams, wedge_files


def friction_scenes():
    return {
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
    }


def other_scenes():
    return {
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


def hard_files():
    files = {}
    scenes = friction_scenes() | other_scenes()
    for n in (10, 30, 100, 200):
        scenes[f"tower_{n}"] = tower(n)
    for name, text in scenes.items():
        files[f"scenes/hard/{name}.yaml"] = text
    for more in (round_card_files(), wedge_files(), contact_points(), arch_files(0.12), arch_files(0.09), tops(), tippe_top(),
                 whip(100), net_files(), gripper_files(), servo_chain(), singular_poses(), scales()):
        files.update(more)
    return files
