"""What responses need is compiled once in a child process, whoever looks meanwhile."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest

from boom_twin.monitor.data import tip_response
from boom_twin.monitor.data.tip_response import ResponseCompiler

COMPILER = "import pathlib, sys, time; time.sleep(0.6); open(sys.argv[1], 'a').write('compiled ')"


def test_a_page_that_is_closed_stops_no_compiler_and_the_end_of_the_server_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "done"
    monkeypatch.setattr(tip_response, "could_be_kept", lambda kernel: True)
    monkeypatch.setattr(tip_response, "python_command", lambda module: [sys.executable, "-c", COMPILER, str(file)])

    async def look() -> None:
        compiler, stopped = ResponseCompiler(), ResponseCompiler()
        ending = asyncio.create_task(stopped.finish())
        for _ in range(3):
            viewer = asyncio.create_task(compiler.finish())
            await asyncio.sleep(0)
            viewer.cancel()
            await asyncio.wait([viewer])
        stopped.close()
        await asyncio.wait([ending])
        assert ending.cancelled()
        for _ in range(2):
            await compiler.finish()
            assert file.read_text() == "compiled "

    asyncio.run(look())
