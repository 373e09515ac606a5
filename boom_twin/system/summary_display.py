"""Short texts of results, for a terminal (`repr`) and for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from ..errors import UsageError


class SummaryDisplay:
    """Base of results that shows `summary_rows` as a line (`repr`) or as a small table in a notebook."""

    __slots__ = ()

    def summary_rows(self) -> Mapping[str, str]:
        """Return the most important values as texts, by name."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({'; '.join(f'{name} {text}' for name, text in self.summary_rows().items())})"

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in self.summary_rows().items())
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


def numbers(values: Any, factor: float = 1.0, digits: int = 4) -> str:
    """Return numbers as text with `digits` significant digits, separated by commas."""
    return ", ".join(f"{factor * value:.{digits}g}" for value in np.atleast_1d(values).tolist())


def data_frame(columns: Mapping[str, Any]) -> Any:
    """Return the columns as a ``pandas.DataFrame``; UsageError if pandas is not installed."""
    try:
        from pandas import DataFrame
    except ImportError as error:
        remedy = 'Run `pip install "boom_twin[notebook]"`, or take columns().'
        raise UsageError(f"to_frame needs pandas ({error}). {remedy}") from None
    return DataFrame(dict(columns))
