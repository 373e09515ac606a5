"""Encode what the compiled update wrote of one sample: all its messages in one call of compiled code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..kernels.jit import hold
from ..twin.report_rows import ReportRows
from ..types import Array
from .cdr_encoder import ORIGIN, Template
from .numeric_outputs import Selection
from .prediction_numbers import Chain, Layout, number_names, write_messages, write_residuals
from .topic_table import Output

DOUBLE, WORD = 8, 4  # bytes


class _Group(NamedTuple):
    """Messages that are written together; `layout` is held, see `boom_twin.kernels.jit.hold`, `views` are of each message."""

    layout: Any
    views: list[memoryview]
    numbers: Array


def _group(parts: Sequence[tuple[Template, Selection]], width: int, turns: int = 0) -> _Group:
    """Of templates and what is filled in, from rows of so many numbers; what CDR aligns to eight bytes is so here too."""
    ends = ORIGIN + np.cumsum([-(-template.size // DOUBLE) * DOUBLE for template, _ in parts])
    starts = [ORIGIN, *ends[:-1].tolist()]
    data, numbers = np.zeros(ends[-1] + ORIGIN, np.uint8), np.zeros(width)
    views = []
    for start, (template, _) in zip(starts, parts, strict=True):
        template.put_into(data[start:])
        views.append(memoryview(data[start : start + template.size]))  # type: ignore[arg-type]
    begins = [start + ORIGIN for start in starts]
    layout = Layout(
        numbers=numbers,
        turns=np.zeros((turns, 3)),
        chosen=np.concatenate([chosen.places for _, chosen in parts]),
        signs=np.concatenate([chosen.signs for _, chosen in parts]),
        places=np.concatenate([at // DOUBLE + each.double_places for at, (each, _) in zip(begins, parts, strict=True)]),
        stamps=np.concatenate([at // WORD + each.stamp_places for at, (each, _) in zip(begins, parts, strict=True)]),
        doubles=data.view("<f8"),
        words=data.view("<i4"),
    )
    return _Group(hold(layout), views, numbers)


class RowEncoder:
    """Writes the messages of `ReportRows`.

    Parameters
    ----------
    chain : Chain
    outputs : sequence of (Output, Template, Selection)
        Of prediction and estimate, in the order in which a report gives them.
    residuals : sequence of (Template, int)
        Of every stream, and how many fields it has: values, normalised values and deviations of all channels.

    Attributes
    ----------
    numbers : ndarray, shape (all,)
        Of what was encoded last, see `boom_twin.messages.prediction_numbers.number_names`.
    """

    def __init__(
        self,
        chain: Chain,
        outputs: Sequence[tuple[Output, Template, Selection]],
        residuals: Sequence[tuple[Template, int]],
    ) -> None:
        joints = len(chain.lengths)
        width = len(number_names(joints))
        self._chain, self._keys = hold(chain), [output for output, _, _ in outputs]
        self._group = _group([(template, chosen) for _, template, chosen in outputs], width, joints + 1)
        self.numbers = self._group.numbers
        self._residuals = [_group([(template, Selection.of_all(count))], count) for template, count in residuals]
        one, table, layout = np.zeros(1), np.zeros((1, 1)), self._group.layout
        self._write = write_messages.for_types_of(self._chain, one, 0, one, 0, layout)
        self._write_residuals = write_residuals.for_types_of(table, table, 0, 0, layout)

    def fill(self, rows: ReportRows, is_wanted: Callable[[Output], bool]) -> list[tuple[Output, bytes]]:
        """The messages of prediction and estimate that are wanted; `rows` have a prediction."""
        wanted = [each for each in zip(self._keys, self._group.views, strict=True) if is_wanted(each[0])]
        if not wanted:
            return []
        self._write(self._chain, rows.row, rows.pins, rows.estimated, rows.stamp, self._group.layout)
        return [(key, bytes(view)) for key, view in wanted]

    def fill_residuals(self, rows: ReportRows) -> list[bytes]:
        """The messages of residuals."""
        found = []
        for row, (code, stamp) in enumerate(zip(rows.streams, rows.stamps, strict=True)):
            group = self._residuals[code]
            self._write_residuals(rows.values, rows.sigmas, row, stamp, group.layout)
            found.append(bytes(group.views[0]))
        return found
