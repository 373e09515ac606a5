"""Encode all messages of one sample from the rows of the compiled update, in one call of compiled code."""

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
    """Messages that are written together. `layout` is held, see `boom_twin.kernels.jit.hold`; `views` has a view of each."""

    layout: Any
    views: list[memoryview]
    numbers: Array


def _group(parts: Sequence[tuple[Template, Selection]], width: int, turns: int = 0) -> _Group:
    """Return the group of messages of templates, filled from rows of `width` numbers. Doubles of CDR stay aligned."""
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
    """Encoder of the messages of `ReportRows`.

    Parameters
    ----------
    chain : Chain
    outputs : sequence of (Output, Template, Selection)
        Outputs of prediction and estimate, in the order of a report.
    residuals : sequence of (Template, int)
        Template of every stream, and its number of fields: values, normalised values and deviations of all channels.

    Attributes
    ----------
    numbers : ndarray, shape (all,)
        Numbers that were encoded last, see `boom_twin.messages.prediction_numbers.number_names`.
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
        """Return the wanted messages of prediction and estimate. `rows` must have a prediction."""
        wanted = [each for each in zip(self._keys, self._group.views, strict=True) if is_wanted(each[0])]
        if not wanted:
            return []
        self._write(self._chain, rows.row, rows.pins, rows.estimated, rows.stamp, self._group.layout)
        return [(key, bytes(view)) for key, view in wanted]

    def fill_residuals(self, rows: ReportRows) -> list[bytes]:
        """Return the messages of residuals."""
        found = []
        for row, (code, stamp) in enumerate(zip(rows.streams, rows.stamps, strict=True)):
            group = self._residuals[code]
            self._write_residuals(rows.values, rows.sigmas, row, stamp, group.layout)
            found.append(bytes(group.views[0]))
        return found
