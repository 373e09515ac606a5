"""Writer process of a replay: encodes reports and writes the result bag."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..bag.writer import SessionWriter
from ..config.settings import Settings
from ..errors import BoomTwinError
from ..messages.report_encoder import ReportEncoder
from ..messages.topic_table import Output, Topic, Topics
from ..scene.schema import Scene
from ..types import Array, Change, Health, Prediction, Report, Residuals, Stream
from .process_pipe import END, Pipe, received, say_ready

BATCH = 200  # reports in one pickle
Rows = list[tuple[str, int, tuple[str, ...], bytes, bytes]]
Rare = tuple[Change | None, Health | None]
Packed = tuple[int, bytes | None, tuple[bytes, bytes, bytes] | None, Rows, Rare]


def pack(report: Report) -> Packed:
    """A report as plain numbers and bytes; events and status are not written to a bag, and left out."""
    residuals = [(r.stream.value, r.stamp, r.names, r.values.tobytes(), r.sigmas.tobytes()) for r in report.residuals]
    p, rare = report.prediction, (report.change, report.health)
    if p is None:
        return report.stamp, None, None, residuals, rare
    turn = np.array([p.tip_angle, p.tip_angular_velocity, p.tip_angular_acceleration])
    tip = (p.tip_position, p.tip_displacement, p.tip_velocity, p.tip_acceleration, turn)
    numbers = b"".join(part.tobytes() for part in (*tip, p.joints, p.strokes, p.cylinder_forces))
    if p.shape is None or p.undeflected is None or p.pins is None:
        return report.stamp, numbers, None, residuals, rare
    return report.stamp, numbers, (p.shape.tobytes(), p.undeflected.tobytes(), p.pins.tobytes()), residuals, rare


def unpack(packed: Packed) -> Report:
    """What `pack` was given, less what it leaves out."""
    stamp, numbers, lines, rows, (change, health) = packed
    residuals = tuple(
        Residuals(Stream(stream), at, names, np.frombuffer(values), np.frombuffer(sigmas))
        for stream, at, names, values, sigmas in rows
    )
    prediction = None if numbers is None else _prediction(stamp, np.frombuffer(numbers), lines)
    return Report(stamp, True, prediction, residuals, change=change, health=health)


def _prediction(stamp: int, row: Array, lines: tuple[bytes, bytes, bytes] | None) -> Prediction:
    n = (len(row) - 11) // 3
    line, undeflected, pins = (None, None, None) if lines is None else map(_table, lines, (2, 2, 4))
    turn, velocity, acceleration = row[8:11].tolist()
    joints, strokes, forces = row[11:].reshape(3, n)
    return Prediction(
        stamp=stamp,
        tip_position=row[0:2],
        tip_displacement=row[2:4],
        tip_velocity=row[4:6],
        tip_acceleration=row[6:8],
        tip_angle=turn,
        tip_angular_velocity=velocity,
        tip_angular_acceleration=acceleration,
        joints=joints,
        strokes=strokes,
        cylinder_forces=forces,
        shape=line,
        undeflected=undeflected,
        pins=pins,
    )


def _table(data: bytes, columns: int) -> Array:
    return np.frombuffer(data).reshape(-1, columns)


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
        outlet = ReportEncoder(scene, settings)
        with SessionWriter(directory, outputs, notes) as writer:
            say_ready()
            for batch in items:
                for packed in batch:
                    report = unpack(packed)
                    for key, data in outlet.fill(report):
                        writer.write_encoded(key, report.stamp, data)
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
    except OSError as error:
        print(f"{directory}: {error.strerror or error}. Free some space, or give another folder.", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
