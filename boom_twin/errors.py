"""Exceptions that boom_twin raises on purpose, as a tree.

::

    BoomTwinError              anything that a user can mend; the command line prints it and exits with 1
    +-- SceneError             a scene that cannot be used; carries every fault that was found
    +-- UsageError             an argument outside its bounds (a posture that is not there, strokes out of reach)
    +-- SolverError            equilibrium or step not found; says where and what to try
    +-- BagError               a session that cannot be read or written

    SceneWarning               no exception but a warning: a scene that can be used and looks odd

Kernels never raise: they return a status (see `boom_twin.kernels.tables`), and the caller decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from .system.terminal_text import printable, several


class BoomTwinError(Exception):
    """Base of all errors that are the input's fault, not the program's; their text is `printable`."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


class UsageError(BoomTwinError):
    """Error of an argument outside its bounds; the text names it, its value, the bound and the remedy."""


class SolverError(BoomTwinError):
    """Error of an equilibrium or a step that was not found; the text says where and what to try."""


class BagError(BoomTwinError):
    """Error of a session that cannot be read or written; the text names the file, the place and the remedy."""


class SceneWarning(UserWarning):
    """Warning of an irregularity in a scene that can be used; the text has the form of a `Fault`."""


ABSENT = object()  # value of a fault at a key that is not there
FaultKind = Literal["fault", "warning", "note"]


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault in a scene, or an irregularity that is only a warning."""

    path: str  # place in the words of the file: ``sections[1].root.mass``
    value: Any  # value that stands there; `ABSENT` if there is none
    bound: str  # what would be allowed
    remedy: str
    line: int | None = None  # line of the file, from 1
    kind: FaultKind = "fault"  # ``warning`` if the scene can be used; ``note`` if ``check --strict`` lets it pass, too

    def __str__(self) -> str:
        where = self.path if self.line is None else f"line {self.line}: {self.path}"
        state = "is absent" if self.value is ABSENT else f"= {_shortened(self.value)}"
        stop = "" if self.bound.endswith("?") else "."
        return printable(f"{where} {state}: {self.bound}{stop} {self.remedy}")


def _shortened(value: Any, width: int = 60) -> str:
    """Return the text of a value in the spelling of the file, cut in the middle where it is long."""
    if isinstance(value, tuple):
        text = "[" + ", ".join(_shortened(item) for item in value) + "]"
    elif value is None or isinstance(value, bool):
        text = {None: "null", True: "true", False: "false"}[value]
    else:
        text = repr(value)
    return text if len(text) <= width else f"{text[: width - 12]} ... {text[-7:]}"


def bound_of(message: str) -> str:
    """Return a message of pydantic as the bound of a `Fault`: ``it must be greater than 0``."""
    return (message[:1].lower() + message[1:]).replace("input should", "it must")


def listed(source: str, faults: Sequence[Fault]) -> str:
    """Return the text of an error that lists the faults of a file."""
    return "\n".join([f"{source}: {several(len(faults), 'fault')}", *(f"  {fault}" for fault in faults)])


class SceneError(BoomTwinError):
    """Error of a scene that cannot be used."""

    source: str  # the file, or where else the scene came from
    faults: tuple[Fault, ...]  # all faults, in the order of the file
    oddities: tuple[Fault, ...]  # what would only have been a `SceneWarning`; often the cause of a fault

    def __init__(self, source: str, faults: tuple[Fault, ...], oddities: tuple[Fault, ...] = ()) -> None:
        self.source, self.faults, self.oddities = source, faults, oddities
        super().__init__("\n".join([listed(source, faults), *(f"  {oddity.kind}: {oddity}" for oddity in oddities)]))
