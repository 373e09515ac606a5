"""Loop that updates a twin with samples and changes, shared by live node, replay, live page and calibration.

All give samples and the changes between them in their order, so a replay repeats the live node bit for bit.
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
    """A sample, its report, and the computing time of the twin, s."""

    sample: Sample
    report: Report
    duration: float


@overload
def drive(twin: Twin, items: Iterable[Sample], judged: bool = True) -> Iterator[Step]: ...


@overload
def drive(twin: Twin, items: Iterable[Sample | Change | None], judged: bool = True) -> Iterator[Step | None]: ...


def drive(twin: Twin, items: Iterable[Sample | Change | None], judged: bool = True) -> Iterator[Step | None]:
    """Update `twin` with one sample for each step that the caller takes; for `judged` see `Twin.update`.

    A change is requested from the twin. It takes effect with the next full stroke sample, as in the recording. None, a
    message without a usable value, gives None.
    """
    for item in _repeating_changes(twin, items):
        yield None if item is None else drive_one(twin, item, judged)


def drive_one(twin: Twin, sample: Sample, judged: bool = True) -> Step:
    """Update `twin` with one sample without a change; see `drive`."""
    began = perf_counter()
    report = twin.update(sample, judged)
    return Step(sample, report, perf_counter() - began)


def drive_blocks(
    twin: Twin, items: Iterable[SampleBlock | Change | None]
) -> Iterator[tuple[SampleBlock, list[ReportBlock | Report]] | None]:
    """Update `twin` block by block; yield each block with its reports. See `drive` and `Twin.update_block`."""
    for item in _repeating_changes(twin, items):
        yield None if item is None else (item, twin.update_block(item))


def _repeating_changes(twin: Twin, items: Iterable[Item | Change | None]) -> Iterator[Item | None]:
    """Yield all items except changes; request each change from the twin at its place."""
    for item in items:
        if isinstance(item, Change):
            twin.requests.repeat(item)
        else:
            yield item
