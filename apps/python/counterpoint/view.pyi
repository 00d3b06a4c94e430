from os import PathLike
from typing import final

from . import Scene, Trajectory

def can_make_pages() -> bool: ...
def why_no_pages() -> str: ...

@final
class Replay:
    def __init__(
        self,
        trajectory: Trajectory,
        scene: Scene | None = None,
        *,
        ghost: Trajectory | None = None,
        title: str = "",
        rate: float = 100.0,
        contacts: bool = True,
        height: int = 640,
    ) -> None: ...
    def html(self) -> str: ...
    def save(self, file: str | PathLike[str]) -> None: ...
