"""Pages of HTML from the templates of this folder. A page needs nothing but itself."""

from __future__ import annotations

from base64 import b64encode
from math import isfinite
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup


def render(template: str, **values: Any) -> str:
    """Return the page that a template makes of `values`. Texts are escaped, except `Markup`."""
    loader = FileSystemLoader(Path(__file__).parent / "templates")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters |= {"cell": _cell, "data": _data_address}
    return environment.get_template(template).render(values)


def _cell(value: object) -> Markup:
    """Return the cell of a table: numbers right-aligned with 4 significant digits, None and NaN as a dash."""
    if value is None or (isinstance(value, float) and not isfinite(value)):
        return Markup('<td class="n">-</td>')
    if isinstance(value, float | int):
        return Markup('<td class="n">{}</td>').format(f"{value:.4g}" if isinstance(value, float) else value)
    return Markup("<td>{}</td>").format(value)


def _data_address(path: Path) -> str:
    return f"data:image/png;base64,{b64encode(path.read_bytes()).decode()}"
