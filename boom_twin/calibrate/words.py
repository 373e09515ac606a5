"""A calibration in words and as a flat object."""

from __future__ import annotations

import math
from typing import Any

from .run import Calibration, Estimate

SHOWN = {"rad": (180.0 / math.pi, "deg"), "m": (1e3, "mm")}
"""Factor and unit in which zeros are shown."""


def as_text(found: Calibration) -> list[str]:
    """A table, what the sessions do not tell, and how the twin does on what was held out."""
    rows = [("", "before", "now", "95 % interval", ""), *(_row(estimate) for estimate in found.estimates)]
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines += [f"{group}" for group in found.groups]
    lines += ["", f"held out: {found.held_out}; residual rms over what is expected (1 is right)"]
    channels = zip(found.before.names, found.before.spread.tolist(), found.after.spread.tolist(), strict=True)
    lines += [f"  {name:10s} {before:8.2f} before  {after:6.2f} now" for name, before, after in channels]
    return [*lines, f"fit: residuals {found.misfit:.2f} of what noise explains, {found.passes} passes", *found.remarks]


def as_object(found: Calibration) -> dict[str, Any]:
    """Keys of the flat object; SI."""
    values: dict[str, Any] = {}
    for estimate in found.estimates:
        name = estimate.unknown.name
        values |= {f"{name}_before": estimate.unknown.present, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
        values[name] = estimate.value if estimate.told else None
    for kind, judged in (("before", found.before), ("after", found.after)):
        spread = zip(judged.names, judged.spread.tolist(), strict=True)
        values |= {f"held_out_{kind}_{name}": value for name, value in spread}
    return values | {
        "told": [estimate.unknown.name for estimate in found.estimates if estimate.told],
        "not_told": [str(group) for group in found.groups],
        "held_out": found.held_out,
        "misfit": found.misfit,
        "passes": found.passes,
        "remarks": list(found.remarks),
    }


def shown(estimate: Estimate) -> tuple[float, str]:
    """Factor from SI, and unit, in which a parameter is shown."""
    unit = estimate.unknown.kind.unit
    return SHOWN.get(unit, (1.0, unit)) if estimate.unknown.channel else (1.0, unit)


def _row(estimate: Estimate) -> tuple[str, str, str, str, str]:
    factor, unit = shown(estimate)
    values = (estimate.unknown.present, estimate.value, estimate.low, estimate.high)
    before, now, low, high = (factor * value for value in values)
    interval = f"{low:.4g} to {high:.4g} {unit}"
    if not estimate.told:
        return estimate.unknown.name, f"{before:.4g}", "as before", interval, "cannot be told"
    change = f"{100.0 * (now / before - 1.0):+.1f} %" if estimate.unknown.kind.relative else ""
    return estimate.unknown.name, f"{before:.4g}", f"{now:.4g}", interval, change
