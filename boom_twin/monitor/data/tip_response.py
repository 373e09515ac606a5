"""Response of the tip to loads in the posture that is shown.

The first one on a computer compiles for half a minute, which is done in a child process, so that the page goes on.
"""

from __future__ import annotations

import asyncio
from asyncio.subprocess import DEVNULL
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from ...analysis.frequency_response import UPWARD, linearised_boom
from ...analysis.posture_modes import PresentPosture
from ...errors import BoomTwinError
from ...kernels.jit import could_be_kept
from ...kernels.transfer.frequency_response import harmonic_response
from ...scene.kinematics import strokes_of_posture
from ...scene.load import load_scene
from ...scene.schema import Scene
from ...system.child_process import python_command
from ...types import Array

FREQUENCIES = np.geomspace(0.25, 30.0, 400)
"""Hz, of the responses."""
MILLIMETRE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class TipResponses:
    """Amplitude of the tip's acceleration under harmonic loads."""

    loads: tuple[str, ...] = ()  # in words
    frequencies: Array = field(default_factory=lambda: np.zeros(0))  # (k,), Hz
    accelerations: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (k, loads), both directions together, m/s^2
    trouble: str = ""  # why there are none


class ResponseList(PresentPosture[TipResponses]):
    """Frequency response of the tip to 1 N at the tip, and to 1 mm of every cylinder's drive."""

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self._scene = scene

    def _work_out(self, strokes: Array) -> TipResponses:
        try:
            boom = linearised_boom(self._scene, strokes)
            drives = range(boom.plan.joints)
            loads = [boom.load(UPWARD), *(MILLIMETRE * boom.load(drive=i) for i in drives)]
            columns = [np.linalg.norm(boom.respond(FREQUENCIES, load).tip_acceleration, axis=1) for load in loads]
        except BoomTwinError as error:
            return TipResponses(trouble=str(error))
        names = ("1 N at the tip, up", *(f"1 mm of cylinder {i + 1}" for i in drives))
        return TipResponses(names, FREQUENCIES, np.column_stack(columns))


class ResponseCompiler:
    """Compilation in a child process, once for all viewers, of what responses need and this computer has not compiled yet.

    A compiler in a thread of the server would leave it little of the interpreter's lock. A viewer that goes away meanwhile
    does not stop it, or a page that is opened and closed again would never have responses.
    """

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None

    async def finish(self) -> None:
        """Wait until the compilation is done, and start it if needed."""
        self._task = self._task or asyncio.create_task(_compile_beside())
        await asyncio.shield(self._task)

    def close(self) -> None:
        """Stop the compilation, if it runs."""
        if self._task is not None:
            self._task.cancel()


async def _compile_beside() -> None:
    if not could_be_kept(harmonic_response):
        return
    process = await asyncio.create_subprocess_exec(*python_command(__name__), stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL)
    try:
        await process.wait()
    finally:
        with suppress(ProcessLookupError):
            process.kill()


if __name__ == "__main__":
    example = load_scene()
    ResponseList(example).at(strokes_of_posture(example, next(iter(example.postures))).tolist())
