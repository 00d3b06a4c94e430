"""Rigid-body physics with convex, smooth, invertible contact.

    import counterpoint as cp

    sim = cp.Simulator(cp.load_scene("data/scenes/cube_drop.yaml"))
    while sim.time < 2.0:
        sim.step()
    print(sim.state["cube.z"])
"""

from . import _core
from ._core import *  # noqa: F401,F403
from ._core import __version__
from . import collision, contact, recordings, view

__all__ = sorted(
    [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
)

for _name, _object in vars(_core).items():
    # Where users find it: for repr, help and pickle.
    if not _name.startswith("_") and getattr(_object, "__module__", "") == _core.__name__:
        try:
            _object.__module__ = __name__
        except (AttributeError, TypeError):
            pass  # a function: pickled and shown by name all the same
del _name, _object
