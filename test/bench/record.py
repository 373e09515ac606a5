"""Records of long benches: figures with machine, date and commit in out/bench, from which measured.py makes the page."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

from boom_twin.validation.study.report import write_json

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "out" / "bench"


def git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True).stdout.strip()


def commit() -> str:
    """Return the commit of the tree, with a plus sign if files that the page does not come from differ from it."""
    made = [":!docs/measured.md", ":!docs/measured.json", ":!README.md"]
    try:
        name = git("rev-parse", "--short=8", "HEAD")
        return name + "+" * bool(git("status", "--porcelain", "--untracked-files=no", "--", ".", *made))
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def keep(name: str, figures: dict[str, Any]) -> None:
    """Write the figures of a bench into out/bench/NAME.json."""
    write_json(FOLDER / f"{name}.json", {"commit": commit(), "figures": figures})
