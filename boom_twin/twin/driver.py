"""Drive a twin with the samples of a session: the one loop of the live node, the replay, the live page and the calibration.

What a twin predicts depends on its samples and on the changes between them alone. Every user takes both from here, in the
order in which they come, and only differs in what it does with the reports: so a replay repeats the live node to the bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from time import perf_counter
from typing import NamedTuple, TypeVar, overload

from ..types import Change, Report, Sample
from .blocks import ReportBlock, SampleBlock
from .twin import Twin

Item = TypeVar("Item", Sample, SampleBlock)


class Step(NamedTuple):
    """A sample, what it caused, and how long that took the twin, s."""

    sample: Sample
    report: Report
    duration: float


@overload
def drive(twin: Twin, items: Iterable[Sample], judged: bool = True) -> Iterator[Step]: ...


@overload
def drive(twin: Twin, items: Iterable[Sample | Change | None], judged: bool = True) -> Iterator[Step | None]: ...


def drive(twin: Twin, items: Iterable[Sample | Change | None], judged: bool = True) -> Iterator[Step | None]:
    """Update `twin` with every sample, as it is asked for.

    Parameters
    ----------
    twin : Twin
    items : iterable of Sample, Change or None
        None is a message without a usable value. A change is asked of the twin, and takes effect with the next full stroke
        sample, as it did while the session was recorded.
    judged : bool
        See `Twin.update`.

    Yields
    ------
    Step or None
        Of every sample; None for a message without a usable value.
    """
    for item in _repeating_changes(twin, items):
        yield None if item is None else drive_one(twin, item, judged)


def drive_one(twin: Twin, sample: Sample, judged: bool = True) -> Step:
    """Update `twin` with one sample that no change precedes; see `drive`."""
    began = perf_counter()
    report = twin.update(sample, judged)
    return Step(sample, report, perf_counter() - began)


def drive_blocks(
    twin: Twin, items: Iterable[SampleBlock | Change | None]
) -> Iterator[tuple[SampleBlock, list[ReportBlock | Report]] | None]:
    """Update `twin` block by block and yield each block with its reports, see `drive` and `Twin.update_block`."""
    for item in _repeating_changes(twin, items):
        yield None if item is None else (item, twin.update_block(item))


def _repeating_changes(twin: Twin, items: Iterable[Item | Change | None]) -> Iterator[Item | None]:
    """Yield all items but the changes; request each change of the twin in its turn."""
    for item in items:
        if isinstance(item, Change):
            twin.requests.repeat(item)
        else:
            yield item
