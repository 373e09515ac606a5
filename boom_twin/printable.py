"""Text from files and messages made safe to show: what would steer a terminal is written out as an escape."""

from __future__ import annotations


def printable(text: str, keep: str = "\n\t") -> str:
    r"""The text with every character that is not printed (controls, escapes, marks of direction, lone surrogates) as ``\x1b``.

    Characters of `keep` stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)
