"""Templates of encoded messages: every number in its place, and none but those."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boom_twin.messages.cdr_encoder import NumberFields, Template, stamped
from boom_twin.messages.type_store import jazzy, new_message

MARKER = "visualization_msgs/msg/Marker"


def marker(fields: NumberFields) -> Any:
    """Holes of both widths, made in another order than they stand in."""
    msg = new_message(MARKER)
    stamped(msg.header)
    msg.ns, msg.color.g = "odd", fields.single()
    msg.scale.z, msg.pose.position.y, msg.pose.orientation.w = fields.double(), fields.double(), -0.0
    msg.color.r = fields.single()
    return msg


def test_numbers_come_in_the_order_of_their_fields() -> None:
    template = Template([(MARKER, marker(fields := NumberFields()))], fields)
    for stamp, doubles, singles in (
        (1_999_999_999, [0.1, np.nan], [0.5, 0.25]),
        (2**31 * 10**9 - 1, [-np.inf, 5e-324], [1.0, 0.0]),
    ):
        (data,) = template.fill(np.array([stamp]), np.array([doubles]), singles)
        msg = jazzy().deserialize_cdr(data.tobytes(), MARKER)
        assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == divmod(stamp, 10**9)
        np.testing.assert_array_equal([msg.scale.z, msg.pose.position.y], doubles)
        assert [msg.color.g, msg.color.r] == singles
        assert (msg.ns, msg.color.b, msg.pose.position.x) == ("odd", 0.0, 0.0)


def test_a_placeholder_that_is_in_no_message_is_refused() -> None:
    fields = NumberFields()
    msg = marker(fields)
    fields.double()
    with pytest.raises(ValueError, match="2 of 3 placeholders"):
        Template([(MARKER, msg)], fields)
