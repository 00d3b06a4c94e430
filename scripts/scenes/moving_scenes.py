"""Hard cases of impacts, spinning bodies, and the same drop at many scales."""
import math

from scenes.files import G, free, link, num, scene, urdf, vec


def rolling_box():
    """SimBenchmark's rolling test; friction of the pairs (geometric means): 0.4 (box, ground) and 0.8 (ball, box)."""
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


def top_urdf():
    """A disk of 0.1 m radius and 0.02 m thickness, 1 kg, its centre 0.1 m above the tip."""
    across = (3 * 0.1 ** 2 + 0.02 ** 2) / 12
    return urdf("top", "A heavy top; its tip is the link's origin.",
                link("top", 1, (across, across, 0.5 * 0.1 ** 2), center=(0, 0, 0.1)))


def tops():
    l, across, axial = 0.1, (3 * 0.1 ** 2 + 0.02 ** 2) / 12 + 0.1 ** 2, 0.5 * 0.1 ** 2
    top = "urdf: ../../robots/hard/top.urdf, base: spherical"
    theta, w3 = 0.5, 100.0
    # Precession rate: the slow root of I1 W^2 cos - I3 w3 W + m g l = 0.
    a, b, c = across * math.cos(theta), -axial * w3, G * l
    W = (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)
    # With the top turned about y by theta, the vertical is (-sin, 0, cos) in the body-fixed frame.
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
    # At a lean of 0.1 rad the centre of the ball is at height r, and the centre of mass e cos(0.1)
    # below it.
    text = scene("tippe_top", "A ball with a low centre of mass spins upright, leaning by 0.1 rad.",
                 [f"urdf: ../../robots/hard/tippe_top.urdf, name: top, base: floating, friction: 0.3,"
                  f" position: {vec(0, 0, r - e * math.cos(0.1))}, rpy: [0.1, 0, 0],"
                  " velocity: {angular: [0, 0, 150]}"], ground=0.3, step=0.0005, duration=5)
    return {"robots/hard/tippe_top.urdf": robot, "scenes/hard/tippe_top.yaml": text}


def drop(name, size, mass, time_step, scaled):
    """A box of half lengths (1, 0.7, 0.5) size falls on a corner; scaled: contact options
    that are lengths, speeds or times scale too."""
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
                continue  # the same scene as the scaled one
            name = f"drop_{kind}_1e{exponent}"
            files[f"scenes/hard/{name}.yaml"] = drop(name, size, 1, 0.005 * math.sqrt(size), scaled)
    for exponent in (-6, -3, 3, 6):
        name = f"drop_mass_1e{exponent}"
        files[f"scenes/hard/{name}.yaml"] = drop(name, 1, 10.0 ** exponent, 0.005, True)
    return files
