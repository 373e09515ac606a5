"""The command line in this process: ``main(["replay", ..])`` returns the exit code."""

from __future__ import annotations

import json
from typing import Any

import pytest

from boom_twin.cli.main import main


def answer(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))
