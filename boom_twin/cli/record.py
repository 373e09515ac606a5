"""`boom_twin record`: record the session topics, or any others, from ROS 2."""

from __future__ import annotations

import time
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..bag.session_model import SessionMetadata
from ..config.settings import DEFAULT_FILE as DEFAULT_PARAMETERS
from ..config.settings import load_settings, load_thresholds
from ..config.yaml_text import with_values
from ..errors import BagError, BoomTwinError
from ..messages.mapping import load_mapping
from ..messages.topic_table import DEFAULT_FILE, Topic, Topics
from ..ros.startup import require_rclpy
from .arguments import add_ros_args, positive, ros_arguments
from .output import tell, tell_oddities, warn

if TYPE_CHECKING:
    from ..ros.bag.subscriptions import RequestedTopic


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder of the session, new or empty")
    purpose = "record these topics instead; without TYPE, that of the first publisher"
    parser.add_argument("--topics", nargs="+", metavar="NAME[:TYPE]", help=purpose)
    parser.add_argument("--duration", type=positive, metavar="S", help="stop after S seconds (default: at Ctrl-C)")
    kept = "scene of the rig, kept in session.yaml (that of the running twin, if it is there)"
    parser.add_argument("--scene", metavar="SCENE", type=Path, help=kept)
    parser.add_argument("--params", metavar="FILE", type=Path, help="ROS parameter file to copy (default: the package's)")
    parser.add_argument("--mapping", metavar="FILE", type=Path, help="mapping to use and copy (default: the package's)")
    parser.add_argument("--note", metavar="TEXT", help="note, kept in session.yaml and the bag")
    parser.add_argument("--rig", metavar="NAME", help="name of the rig, by which `batch` sums up")
    parser.add_argument("--origin", metavar="TEXT", help="origin of the data, kept there too")
    add_ros_args(parser)


def run(args: Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration, and print on stderr what was received."""
    require_rclpy()
    from ..bag.async_writer import Storage
    from ..bag.session_model import incompleteness
    from ..bag.writer import BagWriter
    from ..ros.bag.recorder import Recorder, recorder_node
    from ..ros.bag.subscriptions import resolved, resolved_mapping
    from ..ros.runtime import ros
    from ..ros.startup import on_stop_signal

    signals: list[bool] = []
    on_stop_signal(lambda: signals.append(True))
    known = load_mapping(args.mapping)
    wanted, metadata = _wanted(args, known), _metadata(args)
    given = {"origin": args.origin, "note": args.note, "rig": args.rig}
    if args.out.is_dir() and (reason := incompleteness(args.out)):
        raise BoomTwinError(f"{args.out}: {reason} Record into a new directory.")
    with ros(ros_arguments(args)), recorder_node() as node:
        load_settings(args.params, node.get_namespace())  # raises if they cannot be used
        thresholds = load_thresholds(args.params or DEFAULT_PARAMETERS, node.get_namespace())
        wanted = [resolved(each, node) for each in wanted]
        metadata = replace(metadata, mapping=resolved_mapping(metadata.mapping or "", known, node))
        metadata = replace(metadata, topics={each.name: each.type for each in wanted})
        bag = BagWriter(args.out, {key: text for key, text in given.items() if text})
        metadata.write(args.out)

        def on_twin(answers: Mapping[str, Any]) -> None:
            nonlocal metadata
            more = _with_twin_values(metadata, answers, known.frame, str(args.mapping or ""))
            try:
                more.write(args.out)
                metadata = more
            except BagError as error:
                warn(f"what the running twin told is not kept: {error}")

        storage = Storage(bag, tell)
        end = float("inf") if args.duration is None else time.monotonic() + args.duration
        recorder = Recorder(node, storage, wanted, thresholds, tell)
        counts = recorder.run(lambda: bool(signals) or time.monotonic() >= end, on_twin)
    tell(" received   written  never arrived")
    for count in counts:
        missed = "unknown" if count.missed is None else str(count.missed)
        tell(f"{count.received:9d} {count.written:9d} {missed:>14}  {count.topic}")
    metadata.write(args.out, [asdict(count) for count in counts])
    if metadata.scene is None:
        tell("no scene is kept in session.yaml: none was given by --scene, and no twin told its own")
    if not any(count.received for count in counts):
        remedy = "Check that the publishers run, as the same user, and ROS_DOMAIN_ID. Record into another --out."
        raise BoomTwinError(f"{args.out}: nothing came. {remedy}")
    return 0


def _metadata(args: Namespace) -> SessionMetadata:
    """Return the session metadata known before recording starts. The files that are given must be valid."""
    from ..bag.session_model import scene_from

    scene = None if args.scene is None else scene_from(args.scene)
    if scene is not None:
        tell_oddities(scene.oddities, scene.source)
    return SessionMetadata(
        __version__,
        scene=None if scene is None else scene.text,
        parameters=(args.params or DEFAULT_PARAMETERS).read_text(encoding="utf-8"),
        mapping=(args.mapping or DEFAULT_FILE).read_text(encoding="utf-8-sig"),
        note=args.note,
        origin=args.origin,
        started=datetime.now(UTC),
    )


def _with_twin_values(metadata: SessionMetadata, answers: Mapping[str, Any], frame: str, given_mapping: str) -> SessionMetadata:
    """Return the session metadata with what the running twin reports. Given texts stay, and a difference is reported.

    The prefix that the twin puts before the `frame` of the mapping becomes part of the mapping, so that a replay has it too.
    """
    changes: dict[str, Any] = {"twin": answers["parameters"]} if "parameters" in answers else {}
    if prefix := answers.get("parameters", {}).get("frame_prefix"):
        changes["mapping"] = with_values(metadata.mapping or "", [(("frame",), prefix + frame)])
    own_mapping = answers.get("parameters", {}).get("mapping")
    if own_mapping and (not given_mapping or Path(own_mapping).resolve() != Path(given_mapping).resolve()):
        warn(
            f"the running twin has the mapping {own_mapping}, and session.yaml holds "
            f"{given_mapping or 'the default one'}: a replay would differ. Record with --mapping {own_mapping}"
        )
    own = answers.get("scene")
    if own is not None and metadata.scene is None:
        changes["scene"] = own
    elif own not in (None, metadata.scene):
        warn("the scene of the running twin differs from --scene; session.yaml holds that of --scene")
    return replace(metadata, **changes)


def _wanted(args: Namespace, known: Topics) -> list[RequestedTopic]:
    from ..ros.bag.subscriptions import RequestedTopic, requested_topics

    inputs: dict[str, Topic] = {topic.absolute: topic for topic in known.inputs.values()}
    outputs = {topic.absolute: topic for topic in [*known.outputs.values(), known.events]}
    if args.topics:
        return requested_topics(args.topics, inputs | outputs)
    return [RequestedTopic(name, topic.type, topic) for name, topic in (inputs | outputs).items()]
