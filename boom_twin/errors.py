"""The exceptions that boom_twin raises on purpose, as a tree.

::

    BoomTwinError              anything that a user can mend; the command line prints it and exits with 1
    +-- SceneError             a scene that cannot be used; carries every fault that was found
    +-- UsageError             an argument outside its bounds (a posture that is not there, strokes out of reach)
    +-- SolverError            equilibrium or step not found; says where and what to try
    +-- BagError               a session that cannot be read or written

Kernels never raise: they return a status (see `boom_twin.chain.status`), and the caller decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


class BoomTwinError(Exception):
    """Base of all errors that are the input's fault, not the program's."""


class UsageError(BoomTwinError):
    """An argument is outside its bounds; the text names it, its value, the bound and the remedy."""


class SolverError(BoomTwinError):
    """No equilibrium or no step was found; the text says where and what to try."""


class BagError(BoomTwinError):
    """A session cannot be read or written; the text names the file, the place and the remedy."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong in a scene.

    Parameters
    ----------
    path : str
        Where, in the words of the file: ``sections[1].root.mass``.
    value : object
        What stands there.
    bound : str
        What would be allowed.
    remedy : str
        What to do about it.
    """

    path: str
    value: Any
    bound: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.path} = {self.value!r}: {self.bound}. {self.remedy}"


class SceneError(BoomTwinError):
    """A scene that cannot be used.

    Attributes
    ----------
    source : str
        The file, or where else the scene came from.
    faults : tuple of Fault
        All that was found, in the order of the file.
    """

    def __init__(self, source: str, faults: tuple[Fault, ...]) -> None:
        self.source = source
        self.faults = faults
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        super().__init__("\n".join([f"{source}: {count}", *(f"  {fault}" for fault in faults)]))
