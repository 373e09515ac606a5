"""The end mark of a scene file, by which one that was cut off is told from a whole one.

Both lines are comments, so that the file stays plain YAML, and blocks can still be written behind it. A file that says in
its head that it has the mark is refused without it; one that says nothing can be used, with a warning.
"""

from __future__ import annotations

from ..errors import Fault

PROMISE = '# This file ends with the line "# end of scene"; without it, it was cut off.'
MARK = "# end of scene"


def with_end_mark(text: str) -> str:
    """The text with the mark in its last line, and in its first the promise of it, if that does not stand there already."""
    kept = [line for line in text.splitlines() if line != MARK]
    head = [] if PROMISE in kept else [PROMISE]
    return "\n".join([*head, *kept]).rstrip() + f"\n\n{MARK}\n"


def missing_end_mark(text: str) -> tuple[Fault | None, Fault | None]:
    """What is wrong with the end of a scene file: a fault that stops, an oddity that only warns, or neither."""
    lines = text.splitlines()
    number = max((i for i, line in enumerate(lines, 1) if line.strip()), default=0)
    last = lines[number - 1].strip() if number else ""
    if last == MARK:
        return None, None
    if PROMISE in lines and MARK not in lines:
        bound = f"the first lines say that the file ends with `{MARK}`, and it does not: it was cut off"
        remedy = "Fetch the whole file; or, if nothing is missing, add that line."
        return Fault("end of the file", last, bound, remedy, number), None
    bound = f"no line `{MARK}`, so one cannot tell whether the rest of the file was cut off"
    if text and not text.endswith("\n"):
        bound = f"no line `{MARK}`, and not even an end of line: it may have been cut off"
    return None, Fault("end of the file", last, bound, "If nothing is missing, add that line at the end.", number)
