"""What became of one case, and the table of many."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from enum import StrEnum
from io import StringIO

from command import main


class Kind(StrEnum):
    """What became of a case, the worst first; what is promised of each is written in docs/reliability.md."""

    TRACEBACK = "traceback"
    HANG = "hang"
    GROWTH = "growth"
    SILENT = "silent"
    TOLD = "altered and told"
    REFUSED = "refused"
    OTHER = "other content"
    EQUAL = "equal"

    @property
    def is_finding(self) -> bool:
        """Return True if it shows a defect."""
        return self in (Kind.TRACEBACK, Kind.HANG, Kind.GROWTH, Kind.SILENT)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Kind, and the reason in words: what refused it, what was told, or what is wrong."""

    kind: Kind
    words: str = ""

    @property
    def is_finding(self) -> bool:
        """Return True if this case shows a defect."""
        return self.kind.is_finding


def printed(*arguments: str) -> tuple[int, str]:
    """Return the exit code of a command, and what it writes; AssertionError if that would steer a terminal."""
    out = StringIO()
    with redirect_stdout(out), redirect_stderr(out):
        code = main(arguments)
    words = out.getvalue()
    odd = next((letter for letter in words if letter != "\n" and not letter.isprintable()), None)
    assert odd is None, f"{arguments} writes {odd!r}: {words!r}"
    return code, words


def worst(*verdicts: Verdict) -> Verdict:
    """Return the verdict on a case that was looked at in several ways."""
    return min(verdicts, key=lambda verdict: list(Kind).index(verdict.kind))


def table(counts: Mapping[str, Counter[str]]) -> str:
    """Return the counts by target as a table in Markdown."""
    lines = ["| target | cases | " + " | ".join(Kind) + " |", "|---" * (len(Kind) + 2) + "|"]
    for target, found in counts.items():
        lines.append(f"| {target} | {found.total()} | " + " | ".join(str(found[kind]) for kind in Kind) + " |")
    return "\n".join(lines)
