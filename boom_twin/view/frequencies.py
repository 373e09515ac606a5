"""Picture of natural frequencies through a session: the model's, and those that were measured."""

from __future__ import annotations

from pathlib import Path

from ..records import Array
from .style import BLUE, ORANGE, picture


def frequency_picture(
    path: Path, session: str, times: Array, model: Array, measured: list[tuple[float, float]], note: str
) -> None:
    """Write it.

    Parameters
    ----------
    path : Path
    session : str
        Its name.
    times, model : ndarray, shape (k,), (k, modes)
        s, and the model's frequencies (Hz) then.
    measured : list of (float, float)
        Time (s) and frequency (Hz).
    note : str
    """
    with picture(path, f"{session}: natural frequencies", note, (16.0, 6.0)) as figure:
        axes = figure.add_subplot()
        lines = axes.semilogy(times, model, color=BLUE)
        if lines:
            lines[0].set_label("model, in the posture of the moment")
        if measured:
            axes.plot(*zip(*measured, strict=True), "o", color=ORANGE, markersize=8, label="measured")
        axes.set_xlim(times[0], max(times[-1], times[0] + 1e-3))
        axes.set_ylabel("frequency, Hz")
        axes.set_xlabel("time since first sample, s")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
