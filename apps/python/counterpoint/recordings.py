from ._core.recordings import *  # type: ignore  # noqa: F401,F403
