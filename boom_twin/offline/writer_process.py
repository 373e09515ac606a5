"""Writer process of a replay: encodes reports and writes the result bag."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from operator import attrgetter
from pathlib import Path

import numpy as np

from ..bag.writer import SessionWriter
from ..config.settings import Settings
from ..errors import BoomTwinError
from ..messages.report_encoder import ReportEncoder
from ..messages.topic_table import Output, Topic, Topics
from ..scene.schema import Scene
from ..types import Change, Health, Prediction, Report, Residuals, Stream
from .process_pipe import END, Pipe, received, say_ready

BATCH = 200  # reports in one pickle
Rows = list[tuple[str, int, tuple[str, ...], bytes, bytes]]
Rare = tuple[Change | None, Health | None]
Numbers = tuple[float, ...]
Arrays = list[bytes | None]
Packed = tuple[int, Numbers | None, Arrays, Rows, Rare]

NUMBERS = ("tip_angle", "tip_angular_velocity", "tip_angular_acceleration")
ARRAYS = (
    "tip_position", "tip_displacement", "tip_velocity", "tip_acceleration", "joints", "strokes", "cylinder_forces", "shape",
    "undeflected", "pins", "clearances", "moments",
)  # fmt: skip
COLUMNS = {"shape": 2, "undeflected": 2, "pins": 4, "clearances": 4}
"""Of the arrays of a prediction that are tables."""
_numbers_of, _arrays_of = attrgetter(*NUMBERS), attrgetter(*ARRAYS)


def pack(report: Report) -> Packed:
    """A report as plain numbers and bytes; events and status are not written to a bag, and left out."""
    residuals = [(r.stream.value, r.stamp, r.names, r.values.tobytes(), r.sigmas.tobytes()) for r in report.residuals]
    p, rare = report.prediction, (report.change, report.health)
    if p is None:
        return report.stamp, None, [], residuals, rare
    arrays = [None if array is None else array.tobytes() for array in _arrays_of(p)]
    return report.stamp, _numbers_of(p), arrays, residuals, rare


def unpack(packed: Packed) -> Report:
    """What `pack` was given, less what it leaves out."""
    stamp, numbers, arrays, rows, (change, health) = packed
    residuals = tuple(
        Residuals(Stream(stream), at, names, np.frombuffer(values), np.frombuffer(sigmas))
        for stream, at, names, values, sigmas in rows
    )
    prediction = None if numbers is None else _prediction(stamp, numbers, arrays)
    return Report(stamp, True, prediction, residuals, change=change, health=health)


def _prediction(stamp: int, numbers: Numbers, arrays: Arrays) -> Prediction:
    found = {name: None if data is None else np.frombuffer(data) for name, data in zip(ARRAYS, arrays, strict=True)}
    for name, columns in COLUMNS.items():
        if (flat := found[name]) is not None:
            found[name] = flat.reshape(-1, columns)
    return Prediction(stamp=stamp, **dict(zip(NUMBERS, numbers, strict=True)), **found)  # type: ignore[arg-type]


class ReportWriter:
    """The replay's end of the pipe.

    Parameters
    ----------
    directory : Path
        Of the bag; must be new or empty.
    notes : mapping of str to str
        Kept in the bag.
    topics : Topics
        How its topics are named.
    scene : Scene
        What the reports are about.
    settings : Settings
        How it is drawn.
    lock : int
        Descriptor that the process keeps open, see `boom_twin.system.result_folder.UnfinishedResult`.

    Raises
    ------
    BagError
        From any method: the bag could not be written; says why.
    """

    def __init__(
        self, directory: Path, notes: Mapping[str, str], topics: Topics, scene: Scene, settings: Settings, lock: int
    ) -> None:
        self._batch: list[Packed] = []
        self._pipe = Pipe(__name__, str(directory), inherited=[lock])
        self._pipe.send((dict(notes), topics.outputs, scene, settings))

    def wait_ready(self) -> None:
        """Until the process can begin."""
        self._pipe.wait_ready()

    def put(self, report: Report) -> None:
        """Write what `report` holds, in its turn; its stamp becomes the log time."""
        if report.prediction is None and not report.residuals and report.change is None:
            return
        self._batch.append(pack(report))
        if len(self._batch) == BATCH:
            self._pipe.send(self._batch)
            self._batch = []

    def close(self) -> None:
        """Send the rest; returns when the bag is complete."""
        self._pipe.send(self._batch)
        self._pipe.send(END)
        self._pipe.finish()

    def stop(self) -> None:
        """End the process; the bag stays incomplete."""
        self._pipe.stop()


def main(directory: Path) -> int:
    """Write everything that comes down the pipe; exit code 1 with the reason on stderr if that fails.

    A bag gets its end and its metadata only after the end of the pipe was sent.
    """
    items = received(sys.stdin.buffer)
    try:
        notes, topics, scene, settings = next(items)
        outputs: dict[str, Topic] = {key: topic for key, topic in topics.items() if key is not Output.DIAGNOSTICS}
        encoder = ReportEncoder(scene, settings)
        with SessionWriter(directory, outputs, notes) as writer:
            say_ready()
            for batch in items:
                for packed in batch:
                    report = unpack(packed)
                    for key, data in encoder.fill(report):
                        writer.write_encoded(key, report.stamp, data)
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
    except OSError as error:
        print(f"{directory}: {error.strerror or error}. Free some space, or give another folder.", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
