"""Hard cases of chains, nets, a gripper and an arm."""
from scenes.files import G, free, joint, link, num, scene, urdf, vec


def hanging_chain(n, drag=None):
    """A chain of bodies on closures. drag [N s/m] per link damps it: closures yield like springs, on which a long chain
    would swing for a long time."""
    links = [free("link", "capsule", (0.01, 0.08), 0.1, (0, 0, -0.05), friction=0.5,
                  extra=f"count: {n}, spacing: [0, 0, -0.1]" + (f", drag: {{linear: {drag}}}" if drag else ""))]
    ties = ["closures:", "  - {type: ball, name: tie0, between: [world, link0/body]}"]
    ties += [f"  - {{type: ball, name: tie{i}, between: [link{i - 1}/body, link{i}/body], anchor_a: [0, 0, -0.05]}}"
             for i in range(1, n)]
    return scene(f"chain_{n}", f"{n} links of 0.1 m and 0.1 kg hang on each other, tied by closures.", links,
                 ground=None, duration=2, more=ties)


def whip(n):
    """A chain of n ball joints as one tree, released from the horizontal."""
    mass, length = 0.1, 0.1
    across, along = mass * length ** 2 / 12, mass * 0.01 ** 2 / 2
    body = '  <link name="hook"/>\n'
    for i in range(n):
        body += link(f"link{i}", mass, (along, across, across), center=(0.5 * length, 0, 0))
        body += joint(f"j{i}", "floating", "hook" if i == 0 else f"link{i - 1}", f"link{i}",
                      (0 if i == 0 else length, 0, 0))
    types = ", ".join(f"j{i}: spherical" for i in range(n))
    text = scene(f"whip_{n}", f"A chain of {n} rods of 0.1 m on ball joints, let go from the horizontal.",
                 [f"urdf: ../../robots/hard/whip_{n}.urdf, joint_types: {{{types}}}"], ground=None,
                 step=0.0005, duration=5)
    return {f"robots/hard/whip_{n}.urdf": urdf(f"whip_{n}", f"{n} rods on ball joints.", body),
            f"scenes/hard/whip_{n}.yaml": text}


def net_files(n=20):
    """Nodes in a level square with ball closures halfway between neighbours. The corners are 15 % closer together than
    at full size, where the net could not sag. The nodes do not collide."""
    d, moment = 0.1, 0.4 * 0.05 * 0.02 ** 2
    nodes = [f"urdf: ../../robots/hard/node.urdf, name: n{i}_, base: floating, position: {vec(d * i, 0, 0)},"
             f" count: {n}, spacing: [0, {d}, 0], drag: {{body: {{linear: 0.2, angular: 0.0001}}}}" for i in range(n)]
    ties = ["closures:"]
    for i in range(n):
        for j in range(n):
            if i + 1 < n:
                ties.append(f"  - {{type: ball, between: [n{i}_{j}/body, n{i + 1}_{j}/body], anchor_a: [{d / 2}, 0, 0]}}")
            if j + 1 < n:
                ties.append(f"  - {{type: ball, between: [n{i}_{j}/body, n{i}_{j + 1}/body], anchor_a: [0, {d / 2}, 0]}}")
    m = n - 1
    for i, j in ((0, 0), (0, m), (m, 0), (m, m)):
        held = [d * (0.5 * m + 0.85 * (k - 0.5 * m)) for k in (i, j)]
        ties.append(f"  - {{type: ball, name: corner{i}_{j}, between: [world, n{i}_{j}/body],"
                    f" anchor_a: {vec(*held, 0)}, anchor_b: [0, 0, 0]}}")
    text = scene("net", f"A net of {n} x {n} bodies held at its corners, tied by {2 * n * m} ball closures.",
                 nodes, ground=None, duration=5, more=ties)
    return {"scenes/hard/net.yaml": text,
            "robots/hard/node.urdf": urdf("node", "A ball of 20 mm radius that touches nothing.",
                                          link("body", 0.05, (moment, moment, moment)))}


def gripper_files():
    moments = tuple(0.2 / 3 * s for s in (0.02 ** 2 + 0.03 ** 2, 0.01 ** 2 + 0.03 ** 2, 0.01 ** 2 + 0.02 ** 2))
    body = '  <link name="palm"/>\n'
    for side, s in (("left", 1), ("right", -1)):
        body += link(side, 0.2, moments, geometry=[('<box size="0.02 0.04 0.06"/>', (0, 0, 0))])
        body += joint(side + "_slide", "prismatic", "palm", side, (-s * 0.06, 0, 0), (s, 0, 0),
                      '<limit lower="-0.05" upper="0.06" effort="1000" velocity="10"/>')
    robot = urdf("gripper", "Two fingers of 0.2 kg that slide along x.", body)
    mu = 0.2
    text = scene("gripper", "Two light fingers hold a heavy, slippery box by friction alone.",
                 ["urdf: ../../robots/hard/gripper.urdf, name: gripper, position: [0, 0, 1], friction: 0.2",
                  free("load", "box", (0.05, 0.05, 0.05), 10, (0, 0, 1), friction=mu)], ground=None, duration=60)
    return {"robots/hard/gripper.urdf": robot, "scenes/hard/gripper.yaml": text}


def servo_chain(n=10, mass=1.0, length=0.2):
    """An inverted chain of n links on servos, with 1.1 and 0.9 of the critical stiffness for standing upright."""
    across = mass * (length ** 2 / 12 + 1e-4)
    body = '  <link name="base"/>\n'
    for i in range(n):
        body += link(f"link{i}", mass, (across, across, mass * 2e-4), center=(0, 0, length / 2))
        body += joint(f"j{i}", "continuous", f"link{i - 1}" if i else "base", f"link{i}", (0, 0, length if i else 0))
    # Potential -1/2 sum_k c_k phi_k^2 with phi_k = sum of the first k joints: the least stiffness
    # is the largest eigenvalue of G_ij = sum of c_k over k >= max(i, j), found by power iteration,
    # since the entries of G are positive.
    c = [mass * G * length * (n - k - 0.5) for k in range(n)]
    v = [1.0] * n
    for _ in range(200):
        w = [sum(v[j] * sum(c[max(i, j):]) for j in range(n)) for i in range(n)]
        critical = max(w)
        v = [x / critical for x in w]
    models = []
    for name, x, share in (("stiff", 0, 1.1), ("soft", 5, 0.9)):
        kp = share * critical
        models.append(f"urdf: ../../robots/hard/servo_chain.urdf, name: {name}, position: {vec(x, 0, 0)}, joints: {{j0: 0.001}},"
                      f" dynamics: {{all: {{servo: {{stiffness: {num(kp)}, damping: {num(0.2 * kp)}, position: 0}}}}}}")
    text = scene("servo_chain", f"{n} links balance on each other by servos of 1.1 and 0.9 times the least stiffness"
                 f" {critical:.6f} N m/rad.", models, ground=None, duration=30)
    return {"robots/hard/servo_chain.urdf": urdf("servo_chain", "Links of 0.2 m and 1 kg, hinged about y.", body),
            "scenes/hard/servo_chain.yaml": text}


def singular_poses():
    """An arm with a gimbal at its pole whose axes intersect, a massless fixed link, and aligned links."""
    rod = (0.25 / 12 + 1e-4, 0.25 / 12 + 1e-4, 1e-4)
    tiny = (1e-4, 1e-4, 1e-4)
    body = '  <link name="base"/>\n' + link("yaw", 0.01, tiny) + link("pitch", 0.01, tiny)
    body += joint("yaw", "continuous", "base", "yaw", axis=(0, 0, 1))
    body += joint("pitch", "continuous", "yaw", "pitch", axis=(0, 1, 0))
    body += link("upper", 1, rod, center=(0, 0, 0.25)) + joint("roll", "continuous", "pitch", "upper", axis=(0, 0, 1))
    body += '  <link name="flange"/>\n' + joint("mount", "fixed", "upper", "flange", (0, 0, 0.5))
    body += link("lower", 1, rod, center=(0, 0, 0.25)) + joint("elbow", "continuous", "flange", "lower", axis=(0, 1, 0))
    robot = urdf("singular_arm", "Yaw, pitch and roll in one point, a massless flange, an elbow.", body)
    # Upright with pitch 0, the axes of yaw and roll coincide. The initial velocity of the elbow
    # starts the motion.
    text = scene("singular_poses", "An arm stands upright: its yaw and roll axes fall together, its links are in line.",
                 ["urdf: ../../robots/hard/singular_arm.urdf, name: arm, joint_velocities: {elbow: 0.5}"],
                 ground=None, step=0.0001, duration=5)
    return {"robots/hard/singular_arm.urdf": robot, "scenes/hard/singular_poses.yaml": text}
