"""What a session lacks for a replay, in words with the remedy."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from ..errors import BagError
from ..records import Stream
from .definitions import check_encoding
from .info import BagInfo
from .reader import check_topic
from .tally import NANO, Tally
from .topics import load_topics

SKEW = 0.05
"""Difference (s) of two streams' clocks that is worth a word: a boom moves by centimetres in it."""

_NAMES = {Stream.STROKES: "cylinder_", Stream.ANGLES: "joint_"}
_WITHOUT = {
    Stream.STROKES: "nothing can be replayed",
    Stream.ANGLES: "there are no joint residuals",
    Stream.IMU: "there are no residuals of the tip's acceleration (optional)",
}


def names_missing(info: BagInfo, joints: int | None = None) -> list[str]:
    """Names of channels that are not in (all) messages, one sentence for each.

    Parameters
    ----------
    info : BagInfo
    joints : int, optional
        Of the scene; by default the highest number that occurs.
    """
    last = joints or _highest(info)
    return [
        f"{name} is not in {lacking} of {sum(tally.names.values())} messages of {tally.name}"
        for stream, tally in _joint_states(info)
        for name in (f"{_NAMES[stream]}{number}" for number in range(1, last + 1))
        if (lacking := sum(count for names, count in tally.names.items() if name not in names))
    ]


def names_extra(info: BagInfo, joints: int | None = None) -> list[str]:
    """Names that no replay uses, one sentence for each."""
    last = joints or _highest(info)
    return [
        f"{name} of {tally.name} is not used"
        for stream, tally in _joint_states(info)
        for name in sorted({name for names in tally.names for name in names})
        if name not in [f"{_NAMES[stream]}{number}" for number in range(1, last + 1)]
    ]


def missing(info: BagInfo, joints: int | None = None) -> list[str]:
    """What is missing for a replay, one sentence for each, the worst first; empty when all is there."""
    found: list[str] = []
    for stream, topic in load_topics().inputs.items():
        try:
            name = check_topic(info.session, topic.name, topic.type).name
            for file in info.session.files:
                check_encoding(file, {name})
        except BagError as error:
            reason = str(error).removeprefix(f"{info.session.path}: ")
            found.append(f"{reason} Without it {_WITHOUT[stream]}.")
            continue
        if (tally := info.tally(topic.name)) is not None:
            found += _stamps(tally)
    lacking = names_missing(info, joints)
    remedy = "The channel stays empty there: give the driver's names as topics.yaml says."
    return found + [f"{sentence}. {remedy}" for sentence in lacking]


def remarks(info: BagInfo) -> list[str]:
    """What else a reader should know: checksums, origin, clocks."""
    found: list[str] = []
    if not info.session.checked:
        found.append("No checksums: a flipped bit cannot be noticed. Record with `boom_twin record`.")
    if info.synthetic is None:
        found.append("Its origin is not noted, so whether a rig made it is unknown. Record with --origin.")
    known = [tally for topic in load_topics().inputs.values() if (tally := info.tally(topic.name)) and tally.skewed]
    for one, other in pairwise(known):
        apart = (other.skews[2] / other.skewed - one.skews[2] / one.skewed) * NANO
        if abs(apart) > SKEW:
            found.append(
                f"Clocks of {one.name} and {other.name} differ: on average {other.name} is stamped {apart:+.3f} s before "
                f"its log time, compared with {one.name}. Synchronise the sensors' clocks."
            )
    return found


def _stamps(tally: Tally) -> Iterator[str]:
    if tally.unset:
        yield (
            f"{tally.name}: {tally.unset} of {tally.count} messages have no header.stamp and are left out. "
            "Let the driver set it."
        )
    if tally.not_increasing:
        yield (
            f"{tally.name}: {tally.not_increasing} of {tally.count} stamps are not after the one before, and such "
            "messages are left out. Look for two publishers, a looped bag, or a clock that was set."
        )


def _joint_states(info: BagInfo) -> Iterator[tuple[Stream, Tally]]:
    for stream, topic in load_topics().inputs.items():
        if stream in _NAMES and (tally := info.tally(topic.name)) is not None and tally.named:
            yield stream, tally


def _highest(info: BagInfo) -> int:
    """The highest number of a cylinder or joint that occurs, at most 99."""
    numbers = [
        int(match[1])
        for stream, tally in _joint_states(info)
        for names in tally.names
        for name in names
        if (match := re.fullmatch(rf"{_NAMES[stream]}([1-9]\d?)", name))
    ]
    return max(numbers, default=0)
