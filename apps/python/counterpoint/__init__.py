"""Rigid-body physics with convex, smooth, invertible contact.

    import counterpoint as cp

    sim = cp.Simulator(cp.load_scene("data/scenes/cube_drop.yaml"))
    while sim.time < 2.0:
        sim.step()
    print(sim.state["cube.z"])
"""



def _why_not(error: ImportError) -> str:
    """Return a message for a failed import of the compiled module."""
    import importlib.machinery
    import importlib.util
    import pathlib
    import sys

    folder = pathlib.Path(__file__).parent
    built = sorted(file.name for file in folder.glob("_core*.so"))
    if not built:
        return (
            f"counterpoint: its compiled part is not in {folder}: `ninja -C build/release counterpoint_python` builds it "
            "(Debian: python3-dev python3-numpy pybind11-dev; then configure again), and "
            "PYTHONPATH=build/release/python finds it"
        )
    if not any((folder / f"_core{suffix}").exists() for suffix in importlib.machinery.EXTENSION_SUFFIXES):
        return (
            f"counterpoint: {built[0]} in {folder} was built for another Python than this "
            f"{sys.version_info.major}.{sys.version_info.minor} ({sys.executable}); run that one, or configure with "
            f"-DPython_EXECUTABLE={sys.executable}"
        )
    if importlib.util.find_spec("numpy") is None:
        return f"counterpoint: NumPy is missing in {sys.executable} (Debian: python3-numpy; pip install numpy)"
    return f"counterpoint: {built[0]} in {folder} cannot be loaded: {error}"


try:
    from . import _core
except ImportError as _error:
    raise ImportError(_why_not(_error)) from _error
from ._core import *  # noqa: F401,F403
from ._core import __version__
from . import collision, contact, optimization, recordings, view

del _why_not

__all__ = sorted(
    [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
)


def _move(source: object, name: str) -> None:
    """Set the module of classes to the public one, for repr, help and pickle."""
    for thing in vars(source).values():
        if isinstance(thing, type) and thing.__module__ == getattr(source, "__name__"):
            thing.__module__ = name


_move(_core, __name__)
for _module in (_core.collision, _core.contact, _core.optimization, _core.recordings, _core.view):
    _move(_module, _module.__name__.replace("._core", ""))
del _module
