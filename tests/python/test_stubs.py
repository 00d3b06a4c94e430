"""Properties of living objects have the types of the generated stubs, and everything public is documented.

Functions are for pyright to check: pyright/expected_types.py.
"""

import ast
import inspect
import pathlib

import numpy as np
import pytest

import counterpoint as cp

PACKAGE = pathlib.Path(cp.__file__).parent
MODULES = {"counterpoint": cp, **{f"counterpoint.{name}": getattr(cp, name)
                                  for name in ("collision", "contact", "optimization", "recordings", "view")}}
PLAIN = {"int": int, "float": float, "str": str, "bool": bool, "slice": slice, "None": type(None)}


def stub_of(module):
    name = module.removeprefix("counterpoint").lstrip(".") or "__init__"
    return ast.parse((PACKAGE / f"{name}.pyi").read_text())


def property_types(thing):
    """{property: type} of the class of an object, from its stub."""
    classes = {node.name: node for node in stub_of(type(thing).__module__).body if isinstance(node, ast.ClassDef)}
    types = {}
    for item in classes[type(thing).__name__].body:
        if isinstance(item, ast.AnnAssign):
            types[item.target.id] = item.annotation
        elif isinstance(item, ast.FunctionDef) and any(getattr(d, "id", "") == "property" for d in item.decorator_list):
            types[item.name] = item.returns
    return types


def fits(value, kind):
    """Is `value` of the type that the node `kind` spells?"""
    if isinstance(kind, ast.BinOp):
        return fits(value, kind.left) or fits(value, kind.right)
    name = ast.unparse(kind)
    if name == "_Floats" or name.startswith("NDArray"):
        dtype = {"_Floats": "float64", "NDArray[np.bool_]": "bool", "NDArray[np.int64]": "int64"}[name]
        return isinstance(value, np.ndarray) and value.dtype == dtype
    if not isinstance(kind, ast.Subscript):
        return type(value) is PLAIN[name] if name in PLAIN else type(value).__name__ == name.split(".")[-1]
    name = ast.unparse(kind.value)
    parts = kind.slice.elts if isinstance(kind.slice, ast.Tuple) else [kind.slice]
    if name == "Literal":
        return value in [part.value for part in parts]
    if type(value).__name__ != name:
        return False
    if name == "tuple":
        return len(value) == len(parts) and all(map(fits, value, parts))
    items = value.items() if name == "dict" else [(x,) for x in value]
    return all(fits(x, part) for item in items for x, part in zip(item, parts))


def check(thing, seen):
    """Checks an object once for each class, and those that its properties lead to."""
    if type(thing) in seen or not type(thing).__module__.startswith("counterpoint"):
        return
    seen.add(type(thing))
    for name, kind in property_types(thing).items():
        value = getattr(thing, name)
        assert fits(value, kind), f"{type(thing).__name__}.{name} is {value!r}, not {ast.unparse(kind)}"
        for x in value if isinstance(value, list) else [value]:
            check(x, seen)


def living_objects(load):
    scene = load("cube_drop")
    scene.options.step_control = cp.StepControlOptions()
    simulator = cp.Simulator(scene)
    trajectory = simulator.run(steps=400)
    inverse = simulator.last_forces()
    state = simulator.state
    options, steps = scene.options, (scene.model, scene.options, state.q, state.v, state.v)
    yield from (simulator, trajectory, inverse, cp.Batch(scene, 1), cp.rollout(scene, [state], steps=2))
    yield from (scene, options, state, simulator.step(), simulator.step_controlled(10.0), simulator.frame("cube"))
    yield from cp.step_inverse_derivatives(*steps)
    yield from (cp.step_forward_derivatives(*steps), cp.mass_parameter(scene.model, "cube"))
    yield from (cp.rnea_derivatives(scene.model, *steps[2:]), cp.aba_derivatives(scene.model, *steps[2:]))
    yield from cp.Batch(scene, 1).forward_derivatives([state], [state.v])
    query = cp.collision.SceneQuery(scene.model)
    query.set_configuration(state.q)
    yield from (*query.contacts(0.01), query.cast_ray((0, 0, 5), (0, 0, -1)), query.distance(0, 1))
    yield cp.contact.solve_contact_space(np.eye(3), [-1.0, 0.0, 0.0], [0.5])
    yield from (cp.contact.Settings(), cp.JointSpec("hip", "revolute", "body", "leg"), cp.Drag())
    yield cp.object_of("ball", cp.Shape.sphere(1), 1)


def test_properties_have_the_types_of_their_stubs(load):
    seen = set()
    for thing in living_objects(load):
        check(thing, seen)
    assert len(seen) >= 35, sorted(x.__name__ for x in seen)


@pytest.mark.parametrize("module", MODULES)
def test_stubs_have_what_is_public(module):
    public = {name for name, x in vars(MODULES[module]).items() if not name.startswith("_") and not inspect.ismodule(x)}
    stubbed = {node.name for node in stub_of(module).body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert {name for name in stubbed if not name.startswith("_")} == public


@pytest.mark.parametrize("module", MODULES)
def test_everything_has_a_docstring(module):
    for name, thing in vars(MODULES[module]).items():
        if name.startswith("_") or inspect.ismodule(thing):
            continue
        assert (thing.__doc__ or "").strip(), name
        for member in vars(thing) if inspect.isclass(thing) else ():
            if not member.startswith("_"):
                text = getattr(thing, member).__doc__ or ""
                assert text.strip() and "counterpoint._core" not in text, f"{name}.{member}"


def test_the_package_is_typed():
    assert (PACKAGE / "py.typed").exists()
