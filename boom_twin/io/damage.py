"""One kind of error for whatever is wrong inside a bag's files."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from mcap.exceptions import McapError
from rosbags.serde import SerdeError
from zstandard import ZstdError

from ..errors import BagError

RESCUE = "The file is damaged or was cut off: `boom_twin recover BAG --out DIR` saves what is whole."

_LZ4 = (RuntimeError,)
_PARSING = (struct.error, ValueError, KeyError, IndexError, OverflowError, MemoryError)
STUMBLES = (McapError, SerdeError, ZstdError, *_LZ4, *_PARSING)
"""What the parsers raise on bytes that are not what they should be."""


@contextmanager
def blame(path: Path) -> Iterator[None]:
    """Turn what reading `path` stumbles over into a BagError that names it."""
    try:
        yield
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from error
    except STUMBLES as error:
        raise BagError(f"{path}: {str(error) or type(error).__name__}. {RESCUE}") from error


def compare_counts(place: Path, teller: str, told: Mapping[str, int], finder: str, found: Mapping[str, int]) -> None:
    """Raise BagError that names each topic whose two counts differ; a count of 0 is the same as none."""
    topics = sorted(topic for topic in {*told, *found} if told.get(topic, 0) != found.get(topic, 0))
    if topics:
        pairs = [(topic, told.get(topic, 0), found.get(topic, 0)) for topic in topics]
        faults = "; ".join(f"{topic}: {teller} {one}, {finder} {other}" for topic, one, other in pairs)
        raise BagError(f"{place}: message counts differ ({faults}). {RESCUE}")
