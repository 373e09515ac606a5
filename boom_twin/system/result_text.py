"""Results as text: short summaries for a terminal (`repr`) and notebooks, and JSON without numbers that are not finite."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, is_dataclass
from html import escape
from io import StringIO
from math import isfinite
from typing import Any

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


def numbers(values: Any, factor: float = 1.0) -> str:
    """Return numbers as text with four significant digits, separated by commas."""
    values = values.tolist() if hasattr(values, "tolist") else values
    values = values if isinstance(values, Iterable) else [values]
    return ", ".join(f"{factor * value:.4g}" for value in values)


def data_frame(columns: Mapping[str, Any]) -> Any:
    """Return the columns as a ``pandas.DataFrame``; UsageError if pandas is not installed."""
    try:
        from pandas import DataFrame
    except ImportError as error:
        remedy = 'Run `pip install "boom_twin[notebook]"`, or take columns().'
        raise UsageError(f"to_frame needs pandas ({error}). {remedy}") from None
    return DataFrame(dict(columns))


def csv_text(columns: Mapping[str, Any]) -> str:
    """Return the text of a CSV file of `columns`, arrays of shape (rows,), with their names as its header."""
    import numpy as np

    text = StringIO(newline="")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return text.getvalue()


def json_text(value: Any, indent: int | None = None, separators: tuple[str, str] | None = None) -> str:
    """Return the JSON text of mappings, lists, arrays, dataclass instances and plain values."""
    return json.dumps(_plain(value), indent=indent, separators=separators, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if isfinite(value) else None
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
