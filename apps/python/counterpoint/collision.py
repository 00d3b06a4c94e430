from ._core.collision import *  # type: ignore  # noqa: F401,F403
