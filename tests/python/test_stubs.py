"""The stubs and the module have the same names, both ways, and everything public is documented."""

import ast
import inspect
import pathlib

import pytest

import counterpoint as cp

PACKAGE = pathlib.Path(cp.__file__).resolve().parent
MODULES = {"__init__": cp, **{name: getattr(cp, name) for name in ("collision", "contact", "optimization", "recordings", "view")}}
# Members of every class, and those that only notebooks, copy and pickle call.
UNSTUBBED = {"__init__", "__repr__", "__module__", "__doc__", "__eq__", "__hash__", "__new__", "__reduce__", "__getstate__",
             "__setstate__", "_pybind11_conduit_v1_", "_repr_html_", "_ipython_key_completions_", "__weakref__", "__dict__"}


def stub_names(body):
    """Names defined by the stub of a module or class: {name: node}."""
    names = {}
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names[node.name] = node
        elif isinstance(node, ast.AnnAssign):
            names[node.target.id] = node
    return {name: node for name, node in names.items() if not name.startswith("_") or name.startswith("__")}


def stub_of(module):
    return stub_names(ast.parse((PACKAGE / f"{module}.pyi").read_text()).body)


@pytest.mark.parametrize("module", MODULES)
def test_modules_have_the_names_of_their_stubs(module):
    real = {n for n, x in vars(MODULES[module]).items() if not n.startswith("_") and not inspect.ismodule(x)}
    if module == "__init__":
        real |= {"__version__", "__all__"}
    assert real == set(stub_of(module))


@pytest.mark.parametrize("module", MODULES)
def test_classes_have_the_members_of_their_stubs(module):
    for name, node in stub_of(module).items():
        if not isinstance(node, ast.ClassDef) or name.endswith("Error"):
            continue
        real = {n for n in vars(getattr(MODULES[module], name)) if n not in UNSTUBBED}
        assert real == set(stub_names(node.body)) - UNSTUBBED, name


@pytest.mark.parametrize("module", MODULES)
def test_arguments_have_the_names_of_their_stubs(module):
    """Compares the argument names in the error of a call with an unknown keyword: pybind11 keeps no signatures."""
    for name, node in stub_of(module).items():
        if not isinstance(node, ast.FunctionDef):
            continue
        function = getattr(MODULES[module], name)
        for argument in node.args.posonlyargs + node.args.args + node.args.kwonlyargs:
            assert argument.arg in keywords(function), f"{name}: {argument.arg}"


def keywords(function):
    """The names of a function's arguments, from the error message of an invalid call."""
    with pytest.raises(TypeError) as error:
        function(**{"no such argument": 1})
    return str(error.value)


@pytest.mark.parametrize("module", MODULES)
def test_everything_has_a_docstring(module):
    for name, node in stub_of(module).items():
        if name.startswith("__"):
            continue
        thing = getattr(MODULES[module], name)
        assert (thing.__doc__ or "").strip(), name
        if not isinstance(node, ast.ClassDef) or name.endswith("Error"):
            continue
        for member in stub_names(node.body):
            if not member.startswith("__"):
                assert (getattr(thing, member).__doc__ or "").strip(), f"{name}.{member}"


def test_the_package_is_typed():
    assert (PACKAGE / "py.typed").exists()
