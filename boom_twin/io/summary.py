"""The metadata of a bag that has been written: its files and topics, added up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import bagmeta
from .recorded import Recorded


def file_information(path: str, first: int, last: int, count: int) -> bagmeta.FileInformation:
    """One file: name, first and last log time (ns), messages."""
    start, duration = bagmeta.Start(nanoseconds_since_epoch=first), bagmeta.Duration(nanoseconds=last - first)
    return bagmeta.FileInformation(path=path, starting_time=start, duration=duration, message_count=count)


def metadata_of(
    files: Sequence[bagmeta.FileInformation],
    topics: Sequence[Recorded],
    counts: Mapping[int, int],
    notes: Mapping[str, str],
    distro: str,
) -> bagmeta.BagMetadata:
    """The metadata of a whole bag; `counts` are messages by place in `topics`."""
    filled = [file for file in files if file.message_count]
    first = min((file.starting_time.nanoseconds_since_epoch for file in filled), default=0)
    last = max((file.starting_time.nanoseconds_since_epoch + file.duration.nanoseconds for file in filled), default=0)
    return bagmeta.BagMetadata(
        version=bagmeta.VERSION,
        storage_identifier="mcap",
        duration=bagmeta.Duration(nanoseconds=last - first),
        starting_time=bagmeta.Start(nanoseconds_since_epoch=first),
        message_count=sum(file.message_count for file in files),
        topics_with_message_count=[_topic_count(topic, counts[key]) for key, topic in enumerate(topics)],
        relative_file_paths=[file.path for file in files],
        files=list(files),
        custom_data=dict(notes) or None,
        ros_distro=distro,
    )


def _topic_count(topic: Recorded, count: int) -> bagmeta.TopicCount:
    return bagmeta.TopicCount(
        topic_metadata=bagmeta.TopicMetadata(
            name=topic.topic,
            type=topic.type,
            serialization_format=topic.encoding,
            offered_qos_profiles=topic.qos,
            type_description_hash=topic.type_hash,
        ),
        message_count=count,
    )
