"""A baseline from recorded healthy sessions, and its file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import StringIO
from pathlib import Path

from ruamel.yaml import YAML

from ..errors import UsageError
from ..health.baseline import Baseline
from ..io.atomic import write_atomic
from ..learn import learn_baseline
from ..records import Sample, Stream
from ..scene.parts import Scene
from ..settings import Settings
from .measured import Measured, read_sessions
from .run import common_mapping

WIDTH = 120
ORDER = tuple(Stream)


def baseline_of(
    bags: Sequence[str | Path],
    scene: Scene,
    settings: Settings | None = None,
    mapping: str | Path | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
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

    Raises
    ------
    UsageError
        Sessions with different mappings, or too short.
    BagError
        A session that cannot be used.
    """
    paths, joints = [Path(bag) for bag in bags], len(scene.joints)
    progress(0.0, "reading")
    topics = common_mapping(paths, Path(mapping) if mapping else None, joints).topics
    sessions = read_sessions(paths, topics, joints)
    mounts = topics.mounts(joints)
    names = [f"{session.name} {session.digest}" for session in sessions]
    return learn_baseline(scene, settings or Settings(), map(_samples, sessions), names, mounts, progress)


def _samples(session: Measured) -> list[Sample]:
    """All samples in the order of stamps, those of strokes first."""
    found = [
        Sample(stream, int(stamp), values)
        for stream, series in session.series.items()
        for stamp, values in zip(series.stamps, series.values, strict=True)
    ]
    return sorted(found, key=lambda sample: (sample.stamp, ORDER.index(sample.stream)))


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
