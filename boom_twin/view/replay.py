"""All pictures of one replay."""

from __future__ import annotations

from pathlib import Path

from .orbits import orbits_picture
from .posture import posture_picture
from .records import History, Truth
from .residuals import residual_picture
from .spectrum import has_spectrum, spectrum_picture
from .tip import tip_picture


def replay_pictures(
    directory: Path, history: History, truth: Truth | None = None, *, session: str = "session", note: str = ""
) -> list[Path]:
    """Draw what was replayed.

    Parameters
    ----------
    directory : Path
        Where the PNG files go; made if it is not there.
    history : History
    truth : Truth, optional
        Drawn over the prediction, if known.
    session : str
        Name of the session, for the titles.
    note : str
        Small print on every picture, such as "synthetic session of a virtual rig".

    Returns
    -------
    list of Path
        ``tip.png``, ``residuals.png`` (if there are channels), ``posture.png`` (if there are shapes), ``spectrum.png``
        (from 4 s on), ``orbits.png`` (if there are pins with clearance); none at all if nothing was predicted. The same
        arrays give the same bytes.
    """
    if len(history.stamps_s) == 0:
        return []
    directory.mkdir(parents=True, exist_ok=True)
    tip_picture(directory / "tip.png", session, history, truth, note)
    written = [directory / "tip.png"]
    if history.residual_names:
        written.append(directory / "residuals.png")
        residual_picture(written[-1], session, history, note)
    if history.shapes:
        written.append(directory / "posture.png")
        posture_picture(written[-1], session, history, note)
    if has_spectrum(history):
        written.append(directory / "spectrum.png")
        spectrum_picture(written[-1], session, history, note)
    if history.orbits is not None:
        written.append(directory / "orbits.png")
        orbits_picture(written[-1], f"{session}: journals in their bushes", history.orbits, note)
    return written
