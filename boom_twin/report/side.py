"""One of two sessions that are compared: its figures and its alarms."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import BagError
from ..io.incomplete import incompleteness
from ..io.session_model import baseline_of
from ..io.writer import FILE_NAME as RESULT
from ..offline.replay import Replay
from ..pictures import history_of
from ..received import holds_file, open_received
from ..scene.parts import Scene
from ..settings import Settings
from ..view import History
from .quantities import Quantity, quantities, read, write
from .vibration import Hold, holds


@dataclass(frozen=True)
class Side:
    """What is known of one session.

    Attributes
    ----------
    name : str
    scene : str
        Digest of its scene.
    quantities : list of Quantity
    alarms : list of dict
        As in ``summary.json``.
    incomplete : str
        Why the session is not whole, in words; empty if nothing says that it is not.
    """

    name: str
    scene: str
    quantities: list[Quantity]
    alarms: list[dict[str, Any]]
    incomplete: str = ""


def worked_out(
    result: Replay, scene: Scene, settings: Settings, baseline: Path | None, folder: Path
) -> tuple[History, list[Hold], Path]:
    """History and stretches of standing still of a replay; its figures are written into `folder`, as the path says."""
    history = history_of(result.recording, scene)
    still = holds(history, scene)
    usual = baseline_of(result.session.path, baseline).baseline
    found = quantities(result.recording, history, still, scene, settings, usual)
    return history, still, write(folder, scene, found)


def side_of(path: Path, replayed: Callable[[Path], Path]) -> Side:
    """One side from a replay folder, or from a session, of which `replayed` makes a replay folder.

    Raises
    ------
    BagError
        The session cannot be replayed, or the folder is incomplete, lacks figures or has none that can be read.
    """
    if holds_file(path / "summary.json") and (told := incompleteness(path)):
        raise BagError(f"{path}: {told}")
    folder = path if holds_file(path / "summary.json") else replayed(path)
    scene, found = read(folder)
    try:
        with open_received(folder / "summary.json") as file:
            summary = json.load(file)
        alarms, told = list(summary["alarms"]), summary["output_sha256"]
        incomplete = str(summary.get("session_incomplete", ""))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(f"{folder / 'summary.json'}: {error}. Replay the session again with `boom_twin replay`.") from None
    bag = folder / "bag" / RESULT
    if bag.is_file() and hashlib.sha256(bag.read_bytes()).hexdigest() != told:
        raise BagError(f"{folder}: summary.json is not of the bag beside it. Replay the session again with `boom_twin replay`.")
    return Side(path.resolve().name, scene, found, alarms, incomplete)
