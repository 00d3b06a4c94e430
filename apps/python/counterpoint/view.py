from ._core.view import *  # type: ignore  # noqa: F401,F403
