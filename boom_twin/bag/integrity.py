"""Checks of .mcap files for whole ends, and one kind of error for any damage."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC
from rosbags.serde import SerdeError
from zstandard import ZstdError

from ..errors import BagError
from ..system.received_files import open_received

REMEDY = "The file is damaged or was cut off: `boom_twin recover BAG --out DIR` saves what is whole."

_LZ4 = (RuntimeError,)
_PARSING = (struct.error, ValueError, KeyError, IndexError, OverflowError, MemoryError)
PARSE_ERRORS = (McapError, SerdeError, ZstdError, *_LZ4, *_PARSING)
"""Errors that the parsers raise on invalid bytes."""


@contextmanager
def as_bag_error(path: Path) -> Iterator[None]:
    """Turn an error on reading `path` into a BagError that names it."""
    try:
        yield
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from error
    except PARSE_ERRORS as error:
        raise BagError(f"{path}: {str(error) or type(error).__name__}. {REMEDY}") from error


def compare_counts(place: Path, source: str, counts: Mapping[str, int], other: str, others: Mapping[str, int]) -> None:
    """Raise BagError that names each topic whose counts from two sources differ; a count of 0 is the same as none."""
    pairs = [(topic, counts.get(topic, 0), others.get(topic, 0)) for topic in sorted({*counts, *others})]
    if faults := "; ".join(f"{topic}: {source} {one}, {other} {two}" for topic, one, two in pairs if one != two):
        raise BagError(f"{place}: message counts differ ({faults}). {REMEDY}")


BLOCK = 2**20
"""Number of bytes read at a time from a file of any size."""

FOOTER = struct.Struct("<BQQQI8s")
"""The last record of a file, with the magic behind it."""


def check_ends(path: Path, file: BinaryIO) -> None:
    """Raise BagError unless magic at both ends, footer and checksum of the summary are valid."""
    size = path.stat().st_size
    if (start := file.read(len(MCAP0_MAGIC))) != MCAP0_MAGIC:
        if MCAP0_MAGIC.startswith(start):
            raise BagError(f"{path}: incomplete: {size} bytes, of which nothing can be saved. Its recorder was ended at once.")
        remedy = "Give a rosbag2 directory, or a file that ends with .mcap, .db3, .bag or .csv."
        raise BagError(f"{path}: not an MCAP file (it begins otherwise). {remedy}")
    if (ends := _footer(file, size)) is None:
        raise BagError(f"{path}: incomplete: the end is missing (no footer at the end of its {size} bytes). {REMEDY}")
    summary, is_sound = ends
    if not is_sound:
        fault = f"the checksum of the summary, from byte {summary}, does not fit"
        if summary > size - FOOTER.size:
            fault = f"the summary is said to begin at byte {summary}, which is not in front of the footer of its {size} bytes"
        raise BagError(f"{path}: {fault}. {REMEDY}")


def summary_start(path: Path) -> int | None:
    """Return the offset of the summary of a file; None if it is not whole or fails its checksum."""
    with open_received(path) as file:
        ends = _footer(file, path.stat().st_size)
    return ends[0] if ends and ends[1] else None


def _footer(file: BinaryIO, size: int) -> tuple[int, bool] | None:
    """Return the offset of the summary, and True if it is in the file and passes any checksum. None without a whole footer."""
    file.seek(max(0, size - FOOTER.size))
    tail = file.read()
    if len(tail) < FOOTER.size or not tail.endswith(MCAP0_MAGIC) or tail[0] != Opcode.FOOTER:
        return None
    _, _, start, _, checksum, _ = FOOTER.unpack(tail)
    start = start or size - FOOTER.size
    if start > size - FOOTER.size:
        return start, False
    return start, checksum in (0, checksum_of(file, start, size - len(MCAP0_MAGIC) - 4))


def checksum_of(file: BinaryIO, start: int, end: int) -> int:
    """Return the CRC-32 of the bytes from `start` up to `end`, read in blocks."""
    total = 0
    file.seek(start)
    while (left := end - file.tell()) > 0 and (block := file.read(min(left, BLOCK))):
        total = zlib.crc32(block, total)
    return total
