"""Whether the messages of a file are written as Jazzy defines them, before any of them is decoded."""

from __future__ import annotations

from collections.abc import Container

from mcap.records import Schema
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import TypesysError, get_types_from_msg

from ..errors import BagError
from .survey import McapFile
from .typestore import jazzy


def check_encoding(file: McapFile, topics: Container[str]) -> None:
    """Refuse what is not CDR, or was written with another definition of a message than Jazzy's.

    Raises
    ------
    BagError
        Names the file, the topic, what was found and what is read.
    """
    for channel in file.channels.values():
        if channel.topic not in topics:
            continue
        place = f"{file.path}: topic {channel.topic}"
        if channel.message_encoding != "cdr":
            raise BagError(f"{place}: message encoding {channel.message_encoding!r}: only cdr is read. Use ROS 2.")
        for name, (_, fields) in _parsed(place, file.schemas[channel.schema_id]).items():
            known = jazzy().fielddefs.get(name)
            if known is not None and list(known[1]) != list(fields):
                raise BagError(f"{place}: {name} is defined otherwise than in Jazzy. Convert the bag's messages.")


def _parsed(place: str, schema: Schema) -> Typesdict:
    """The types in a schema; none where the recorder did not know the definition and left it empty."""
    if schema.encoding != "ros2msg":
        raise BagError(f"{place}: schema encoding {schema.encoding!r}: only ros2msg is read. Record with ROS 2.")
    try:
        return get_types_from_msg(schema.data.decode(), schema.name) if schema.data else {}
    except (TypesysError, UnicodeDecodeError) as error:
        raise BagError(f"{place}: its definition cannot be parsed ({error}). Record the session again.") from error
