"""Writer process of a replay: encodes reports and writes the result bag."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from itertools import groupby
from pathlib import Path

from ..bag.writer import RESULT_CHUNK_SIZE, SessionWriter
from ..config.settings import Settings
from ..errors import BoomTwinError
from ..messages.report_encoder import ReportEncoder
from ..messages.topic_table import Output, Topic, Topics
from ..scene.schema import Scene
from ..twin.blocks import ReportBlock, report_block
from ..types import Report
from .process_pipe import END, Pipe, received, say_ready

BATCH = 200  # single reports in one pickle
Packed = ReportBlock | Report


def pack(reports: Iterable[Report], joints: int) -> list[Packed]:
    """Return reports as blocks, without what a bag does not hold: events, status.

    A report with a change stays by itself.
    """
    packed: list[Packed] = []
    for has_change, run in groupby(reports, lambda report: report.change is not None):
        found = list(run)
        packed += found if has_change else [report_block(found, joints)]
    return packed


class ReportWriter:
    """Replay's end of the pipe to the writer process.

    Parameters
    ----------
    process : Pipe
        From `started`.
    notes : mapping of str to str
        Kept in the bag.
    topics : Topics
        How its topics and the frame of its outputs are named.
    scene : Scene
        What the reports are about.
    settings : Settings
        How it is drawn.

    Raises
    ------
    BagError
        From any method: the bag could not be written; says why.
    """

    def __init__(self, process: Pipe, notes: Mapping[str, str], topics: Topics, scene: Scene, settings: Settings) -> None:
        self._reports: list[Report] = []
        self._joints = len(scene.joints)
        self._pipe = process
        self._pipe.send((dict(notes), topics, scene, settings))

    @staticmethod
    def started(directory: Path, lock: int) -> Pipe:
        """Return the pipe of the process, which begins its imports.

        Parameters
        ----------
        directory : Path
            Of the bag; must be new or empty.
        lock : int
            Descriptor that the process keeps open, see `boom_twin.system.result_folder.UnfinishedResult`.
        """
        return Pipe(__name__, str(directory), inherited=[lock])

    def wait_ready(self) -> None:
        """Wait until the process can begin."""
        self._pipe.wait_ready()

    def put(self, item: ReportBlock | Report) -> None:
        """Write what `item` holds, in its turn; the stamps of the samples become the log times."""
        if isinstance(item, Report):
            for report in item.all:
                self._reports.append(report)
                if len(self._reports) == BATCH:
                    self._send_reports()
        else:
            self._send_reports()
            self._pipe.send([item])

    def close(self) -> None:
        """Send the rest; returns when the bag is complete."""
        self._send_reports()
        self._pipe.send(END)
        self._pipe.finish()

    def _send_reports(self) -> None:
        if self._reports:
            self._pipe.send(pack(self._reports, self._joints))
            self._reports.clear()

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
        outputs: dict[str, Topic] = {key: topic for key, topic in topics.outputs.items() if key is not Output.DIAGNOSTICS}
        encoder = ReportEncoder(scene, settings, topics.frame)
        with SessionWriter(directory, outputs, notes, chunk_size=RESULT_CHUNK_SIZE) as writer:
            say_ready()
            for batch in items:
                for item in batch:
                    _write(item, encoder, writer)
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
    except OSError as error:
        print(f"{directory}: {error.strerror or error}. Free some space, or give another folder.", file=sys.stderr)
    return 1


def _write(item: Packed, encoder: ReportEncoder, writer: SessionWriter) -> None:
    if isinstance(item, Report):
        for key, data in encoder.fill(item):
            writer.write_encoded(key, item.stamp, data)
    else:
        writer.write_block(encoder.fill_block(item))


if __name__ == "__main__":
    code = main(Path(sys.argv[1]))
    sys.stderr.flush()
    os._exit(code)  # the replay waits for this end; taking the interpreter apart lasts as long as 1 s of session
