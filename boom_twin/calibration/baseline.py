"""Write the file of a baseline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import StringIO
from pathlib import Path

from ruamel.yaml import YAML

from ..bag.time_window import WHOLE, TimeWindow
from ..config.settings import Settings
from ..errors import UsageError
from ..health.baseline import Baseline
from ..scene.schema import Scene
from ..system.atomic_files import write_atomic

WIDTH = 120


def baseline_of(
    bags: Sequence[str | Path],
    scene: Scene,
    settings: Settings | None = None,
    mapping: str | Path | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
    window: TimeWindow = WHOLE,
) -> Baseline:
    """What model and sensors are off by in sessions in which all was well.

    Parameters
    ----------
    bags : sequence of path
        Recorded sessions of one rig, with moves, a minute or more in all.
    settings : Settings, optional
        Noise of the sensors; the package's own by default.
    mapping : path, optional
        Of topics and sensors; by default as the sessions were recorded.
    progress : callable, optional
        Told the share done and what comes next.
    window : TimeWindow, optional
        The part of each session that is used.

    Raises
    ------
    UsageError
        Always: what was learnt for the inference of causes is of no use without it.
    """
    raise UsageError("a baseline is not learnt: no cause is inferred that it would serve. Leave --baseline out.")


def write_baseline(baseline: Baseline, path: Path, credit: str, force: bool) -> None:
    """Write the file that `boom_twin.health.baseline.load_baseline` reads; `credit` tells when and by what.

    Raises
    ------
    UsageError
        The file is there already, and `force` is false.
    """
    if path.exists() and not force:
        raise UsageError(f"{path} is there already. Give another name, or --force.")
    values = baseline.model_dump() | {"description": f"learnt {credit}"}
    text, yaml = StringIO(), YAML(typ="safe", pure=True)
    yaml.width, yaml.default_flow_style = WIDTH, None
    yaml.dump({key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}, text)
    path.parent.mkdir(parents=True, exist_ok=True)
    head = "# What boom_twin takes for healthy on one rig; SI units. Do not edit mean and covariance.\n"
    write_atomic(path, head + text.getvalue())
