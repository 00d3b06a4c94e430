from ._core.contact import *  # type: ignore  # noqa: F401,F403
