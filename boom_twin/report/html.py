"""Pieces of an HTML page that needs nothing but itself."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite
from pathlib import Path

STYLE = """
body { font: 15px/1.45 system-ui, Arial, sans-serif; color: #222; max-width: 1080px; margin: 2em auto; padding: 0 1.5em }
h1 { font-size: 1.7em; margin-bottom: .2em } h2 { font-size: 1.25em; margin: 2em 0 .5em; border-bottom: 1px solid #ccc }
h3 { font-size: 1.05em; margin: 1.4em 0 .3em }
table { border-collapse: collapse; margin: .6em 0; font-variant-numeric: tabular-nums }
th, td { padding: .22em .8em; text-align: left; border-bottom: 1px solid #ddd; vertical-align: top } th { background: #f3f5f7 }
td.n { text-align: right } img { width: 100%; height: auto; margin: .5em 0 }
.note { color: #666; font-size: .92em } .well { color: #00694b; font-weight: 600 } .alarm { color: #b44600; font-weight: 600 }
.origin { background: #fff4e5; border-left: 4px solid #d55e00; padding: .5em .9em }
@media print { body { max-width: none; margin: 0; font-size: 11pt } h2, h3 { break-after: avoid } }
@media print { img, tr, .block { break-inside: avoid } }
@page { size: A4; margin: 15mm }
"""


class Html(str):
    """Cell of a table that is HTML already."""


def page(title: str, parts: Iterable[str]) -> str:
    """Return the whole document."""
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{escape(title)}</title>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n'


def heading(text: str, level: int = 2) -> str:
    """Return a headline."""
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of a kind that `STYLE` knows."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table with 4 significant digits, numbers right-aligned, None and NaN as a dash; an empty head is left out."""
    titles = f"<thead><tr>{''.join(f'<th>{escape(title)}</th>' for title in head)}</tr></thead>" if head else ""
    lines = "".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
    return f"<table>{titles}<tbody>{lines}</tbody></table>"


def image(path: Path, told: str) -> str:
    """Return a PNG file as an image within the page; `told` is its alternative text."""
    data = b64encode(path.read_bytes()).decode()
    return f'<img alt="{escape(told)}" src="data:image/png;base64,{data}">'


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and not isfinite(value)):
        return '<td class="n">-</td>'
    if isinstance(value, float | int):
        return f'<td class="n">{value:.4g}</td>' if isinstance(value, float) else f'<td class="n">{value}</td>'
    return f"<td>{value if isinstance(value, Html) else escape(str(value))}</td>"
