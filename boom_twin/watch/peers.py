"""The other ends of a topic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Peers:
    """The publishers of an input, or the subscribers of an output.

    Attributes
    ----------
    address : str
        Name of the topic as it is resolved.
    names : sequence of str
        Their nodes.
    incompatible : sequence of str
        Those of them that cannot hear or be heard for their quality of service, and why, in words.
    ids : sequence of str
        GIDs, hexadecimal, in the order of `names`.
    """

    address: str = ""
    names: Sequence[str] = ()
    incompatible: Sequence[str] = ()
    ids: Sequence[str] = ()
