from ._core.optimization import *  # type: ignore  # noqa: F401,F403
