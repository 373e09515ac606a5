"""What responses need is compiled once, whoever looks meanwhile."""

from __future__ import annotations

import asyncio
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from boom_twin.monitor.data import tip_response
from boom_twin.monitor.data.tip_response import ResponseCompiler

COMPILER = "import pathlib, sys, time; time.sleep(0.6); open(sys.argv[1], 'a').write('compiled ')"


@pytest.fixture
def done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file that a process writes in place of compiling."""
    file = tmp_path / "done"
    monkeypatch.setattr(tip_response, "could_be_kept", lambda kernel: True)
    monkeypatch.setattr(tip_response, "python_command", lambda module: [sys.executable, "-c", COMPILER, str(file)])
    return file


def test_a_page_that_is_closed_meanwhile_stops_no_compiler(done: Path) -> None:
    async def look() -> None:
        compiler = ResponseCompiler()
        for _ in range(3):
            viewer = asyncio.create_task(compiler.finish())
            await asyncio.sleep(0.1)
            viewer.cancel()
            with suppress(asyncio.CancelledError):
                await viewer
        await compiler.finish()
        assert done.read_text() == "compiled "
        await compiler.finish()
        assert done.read_text() == "compiled "

    asyncio.run(look())


def test_a_server_that_ends_stops_it(done: Path) -> None:
    async def look() -> None:
        compiler = ResponseCompiler()
        viewer = asyncio.create_task(compiler.finish())
        await asyncio.sleep(0.1)
        compiler.close()
        with pytest.raises(asyncio.CancelledError):
            await viewer
        await asyncio.sleep(1.5)
        assert not done.exists()

    asyncio.run(look())
