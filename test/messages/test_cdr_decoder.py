"""Messages read from their bytes against the same messages decoded."""

from __future__ import annotations

from typing import Any

import pytest
from ros_messages import TYPES, SampleDecoder, decode, encoded, joint_state, stamp_of

from boom_twin import Stream
from boom_twin.messages.cdr_decoder import CdrDecoder
from boom_twin.types import SENSORS


class Wire:
    """Decoder that counts the messages that it decodes whole."""

    def __init__(self, stream: Stream) -> None:
        self.stream, self.whole = stream, 0
        self.decoder = CdrDecoder(TYPES[stream], self._decode, SENSORS[stream].field)

    def _decode(self, data: bytes, type_name: str) -> Any:
        self.whole += 1
        return decode(data, type_name)

    def check(self, data: bytes) -> Any:
        """Compare what an intake makes of a message, with and without decoding all of it."""
        decoded = decode(data, TYPES[self.stream])
        stamp, msg = self.decoder.read(data)
        assert stamp == stamp_of(decoded)
        mine, theirs = SampleDecoder(4), SampleDecoder(4)
        ours, other = mine.put(self.stream, stamp, msg), theirs.put(self.stream, stamp, decoded)
        assert mine.oddities == theirs.oddities
        assert (ours and ours.values.tobytes()) == (other and other.values.tobytes())
        return msg


def test_a_message_that_is_not_whole_is_refused_and_the_next_one_read() -> None:
    """Lengths behind the numbers count too: else a recording is taken that can never be replayed."""
    wire = Wire(Stream.STROKES)
    data = encoded(joint_state(["cylinder_1", "cylinder_2"], [1.0, 2.0], 7))
    wire.check(data)
    velocity = len(data) - 8
    long = [data[:place] + b"\xff\xff\xff\x7f" + data[place + 4 :] for place in (velocity, velocity + 4)]
    for broken in (*(data[:cut] for cut in (0, 3, 8, 11, 20, 40, 60)), *long):
        with pytest.raises(Exception):  # noqa: B017 - whatever the decoder raises
            wire.decoder.read(broken)
        wire.check(data)


def test_names_that_are_not_utf_8_have_question_marks() -> None:
    """Layouts known or not, and many names of one message; numbers that happen to have the same bytes stay."""
    wire = Wire(Stream.STROKES)
    for k in range(3):
        sent = joint_state(["cylinder_1", "Druck_X", "X", "cylinder_2"], [0.1, 9.0, 9.0, 0.2], k + 1, "Rahmen X")
        msg = wire.check(encoded(sent).replace(b"X\0", b"\xfc\0"))
        assert list(msg.name) == ["cylinder_1", "Druck_?", "?", "cylinder_2"] and list(msg.position) == [0.1, 9.0, 9.0, 0.2]
    assert wire.whole == 1
