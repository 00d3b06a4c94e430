"""Texts of scene files, URDFs and meshes, for the generators of this folder and scripts/pile_scenes.py."""

G = 9.81  # m/s^2


def num(x):
    text = f"{x:.15g}"
    return "0" if text == "-0" else text


def vec(*values):
    return "[" + ", ".join(num(v) for v in values) + "]"


def scene(name, about, models, ground=0.5, step=0.002, duration=10, gravity=(0, 0, -G), more=()):
    """Text of a scene file. ground: friction of the plane z = 0, text after `ground:`, or None. models, more: lines."""
    lines = [f"# {about}", "# Written by scripts/make_data.py (hard_scenes.py).", f"name: {name}",
             f"gravity: {vec(*gravity)}  # m/s^2", f"time_step: {num(step)}  # s",
             f"duration: {num(duration)}  # s"]
    if isinstance(ground, str):
        lines.append(f"ground: {ground}")
    elif ground is not None:
        lines.append(f"ground: {{friction: {num(ground)}}}")
    lines.append("models:")
    lines += [f"  - {{{m}}}" for m in models]
    lines += list(more)
    return "\n".join(lines) + "\n"


def free(name, shape, size, mass, position=(0, 0, 0), rpy=None, friction=0.5, velocity=None,
         spin=None, extra=""):
    """Entry of a free object; size: a number or a list, as in scene files."""
    size = vec(*size) if isinstance(size, (list, tuple)) else num(size)
    text = f"name: {name}, {shape}: {size}, mass: {num(mass)}, position: {vec(*position)}"
    if rpy:
        text += f", rpy: {vec(*rpy)}"
    text += f", friction: {num(friction)}"
    if velocity or spin:
        parts = ([f"linear: {vec(*velocity)}"] if velocity else []) + ([f"angular: {vec(*spin)}"] if spin else [])
        text += ", velocity: {" + ", ".join(parts) + "}"
    return text + (f", {extra}" if extra else "")


def obj(corners):
    """Mesh of a hexahedron from eight corners, in the order (z, y, x) from low to high."""
    lines = ["# Written by scripts/make_data.py (hard_scenes.py).", "o block"]
    lines += ["v " + " ".join(num(v) for v in p) for p in corners]
    quads = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    for a, b, c, d in quads:
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    return "\n".join(lines) + "\n"


def urdf(name, about, body):
    return ('<?xml version="1.0"?>\n<!-- Written by scripts/make_data.py (hard_scenes.py). '
            f'{about} -->\n<robot name="{name}">\n{body}</robot>\n')


def link(name, mass=None, moments=None, center=(0, 0, 0), geometry=()):
    """Text of a URDF link; geometry: list of (text, origin)."""
    out = [f'  <link name="{name}">']
    if mass:
        ixx, iyy, izz = moments
        xyz = " ".join(num(v) for v in center)
        out.append(f'    <inertial><origin xyz="{xyz}"/><mass value="{num(mass)}"/>'
                   f'<inertia ixx="{num(ixx)}" iyy="{num(iyy)}" izz="{num(izz)}" ixy="0" ixz="0" iyz="0"/></inertial>')
    for text, origin in geometry:
        out.append(f'    <collision><origin xyz="{" ".join(num(v) for v in origin)}"/>'
                   f'<geometry>{text}</geometry></collision>')
    return "\n".join(out + ["  </link>"]) + "\n"


def joint(name, kind, parent, child, origin=(0, 0, 0), axis=(0, 1, 0), rest=""):
    return (f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{" ".join(num(v) for v in origin)}"/>'
            f'<axis xyz="{" ".join(num(v) for v in axis)}"/>{rest}</joint>\n')


def mesh_body(name, file, mass, moments):
    return urdf(name, "One convex block.",
                link(name, mass, moments, geometry=[(f'<mesh filename="{file}"/>', (0, 0, 0))]))
