"""The command line in this process: ``main(["replay", ..])`` returns the exit code."""

from __future__ import annotations

from boom_twin.cli.main import main

__all__ = ["main"]
