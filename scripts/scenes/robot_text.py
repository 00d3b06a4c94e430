"""A robot as the text of a URDF file: joints, and links whose inertias follow from shape and mass."""
import math

HEADER = """<?xml version="1.0"?>
<!-- Written by scripts/make_data.py; edit that file. Inertias: uniform density of the shape named in
     each link, about its centre of mass. Units: m, kg, rad, N, s.
     {about} -->
"""


def number(x):
    text = f"{x:.15g}"
    return "0" if text == "-0" else text


def numbers(values):
    return " ".join(number(v) for v in values)


# ---- shapes: (kind, dimensions); inertia for unit mass about the centre, in the axes of the shape
# -------

def box(x, y, z):
    return ("box", (x, y, z))


def sphere(radius):
    return ("sphere", (radius,))


def cylinder(radius, length):
    return ("cylinder", (radius, length))


def capsule(radius, length):
    """length: length of the segment between the centres of the caps."""
    return ("capsule", (radius, length))


def inertia(shape, mass):
    """Diagonal (ixx, iyy, izz) about the centre of mass."""
    kind, d = shape
    if kind == "box":
        x, y, z = (v * v for v in d)
        return tuple(mass / 12 * s for s in (y + z, x + z, x + y))
    if kind == "sphere":
        return (0.4 * mass * d[0] ** 2,) * 3
    r, h = d
    if kind == "cylinder":
        across = mass * (3 * r * r + h * h) / 12
        return (across, across, mass * r * r / 2)
    # Capsule: a cylinder and two half spheres, whose centres of mass lie 3/8 r outside the segment.
    volume_cylinder, volume_caps = math.pi * r * r * h, 4 / 3 * math.pi * r ** 3
    mass_cylinder = mass * volume_cylinder / (volume_cylinder + volume_caps)
    mass_caps = mass - mass_cylinder
    across = (mass_cylinder * (3 * r * r + h * h) / 12
              + mass_caps * (0.4 * r * r + h * h / 4 + 3 / 8 * r * h))
    return (across, across, mass_cylinder * r * r / 2 + mass_caps * 0.4 * r * r)


def geometry(shape):
    kind, d = shape
    if kind == "box":
        return f'<box size="{numbers(d)}"/>'
    if kind == "sphere":
        return f'<sphere radius="{number(d[0])}"/>'
    if kind == "mesh":
        return f'<mesh filename="{d}"/>'
    return f'<{kind} radius="{number(d[0])}" length="{number(d[1])}"/>'


# ---- links and joints --------------------------------------------------------------------------------

ALONG_X = (0, math.pi / 2, 0)
ALONG_Y = (math.pi / 2, 0, 0)


class Robot:
    def __init__(self, name, about):
        self.name, self.about, self.lines = name, about, []
        self.mass = 0.0

    def link(self, name, shape=None, mass=0.0, center=(0, 0, 0), rpy=(0, 0, 0), collide=True,
             collisions=None, contact="", mesh=None):
        """Adds a link. shape gives the inertia, and the collision geometry unless `collisions` lists others or `mesh`
        names a file."""
        self.mass += mass
        out = self.lines
        if shape is None:
            out.append(f'  <link name="{name}"/>')
            return
        ixx, iyy, izz = inertia(shape, mass)
        out.append(f'  <link name="{name}">')
        if contact:
            out.append(f"    {contact}")
        out.append("    <inertial>")
        out.append(f'      <origin xyz="{numbers(center)}" rpy="{numbers(rpy)}"/>'
                   f' <!-- {shape[0]} {numbers(shape[1])} -->')
        out.append(f'      <mass value="{number(mass)}"/>')
        out.append(f'      <inertia ixx="{number(ixx)}" ixy="0" ixz="0" iyy="{number(iyy)}" iyz="0"'
                   f' izz="{number(izz)}"/>')
        out.append("    </inertial>")
        if mesh:
            out.append(f'    <collision><geometry><mesh filename="{mesh}"/></geometry></collision>')
            out.append("  </link>")
            return
        if collisions is None:
            collisions = [(shape, center, rpy)] if collide else []
        for tag in ("visual", "collision"):
            for part, origin, turned in collisions or [(shape, center, rpy)]:
                if tag == "collision" and not collisions:
                    continue
                out.append(f'    <{tag}><origin xyz="{numbers(origin)}" rpy="{numbers(turned)}"/>'
                           f"<geometry>{geometry(part)}</geometry></{tag}>")
        out.append("  </link>")

    def joint(self, name, kind, parent, child, origin, axis=None, limit=None, damping=None):
        """Adds a joint; limit: (lower, upper, effort, velocity)."""
        out = self.lines
        out.append(f'  <joint name="{name}" type="{kind}">')
        out.append(f'    <parent link="{parent}"/><child link="{child}"/>'
                   f'<origin xyz="{numbers(origin)}" rpy="0 0 0"/>')
        if axis:
            out.append(f'    <axis xyz="{numbers(axis)}"/>')
        if limit:
            lower, upper, effort, velocity = limit
            bounds = "" if kind == "continuous" else f'lower="{number(lower)}" upper="{number(upper)}" '
            out.append(f'    <limit {bounds}effort="{number(effort)}" velocity="{number(velocity)}"/>')
        if damping:
            out.append(f'    <dynamics damping="{number(damping)}"/>')
        out.append("  </joint>")

    def text(self):
        head = HEADER.format(about=self.about)
        return head + f'<robot name="{self.name}">\n' + "\n".join(self.lines) + "\n</robot>\n"
