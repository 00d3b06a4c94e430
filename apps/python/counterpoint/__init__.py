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
from . import collision, contact, optimization, recordings, view

__all__ = sorted(
    [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
)


def _move(source: object, name: str) -> None:
    """Classes say that they are where users find them: for repr, help and pickle."""
    for thing in vars(source).values():
        if isinstance(thing, type) and thing.__module__ == getattr(source, "__name__"):
            thing.__module__ = name


_move(_core, __name__)
for _module in (_core.collision, _core.contact, _core.optimization, _core.recordings, _core.view):
    _move(_module, _module.__name__.replace("._core", ""))
del _module
