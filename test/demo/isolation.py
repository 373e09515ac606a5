"""A ROS domain of its own for a demonstration, test or benchmark, so that it neither feeds a live rig nor is fed by one.

Four things keep them apart: a domain above those that people use, claimed so that no two of these runs share one; discovery on
this computer only; a DDS partition, in which endpoints of other programs match none of these even if they share the domain; and
a look at who is there before anything starts.

UDP ports of DDS: domain d has 7400 + 250 d to 7400 + 250 d + 249, of which 2 to 9 are used by nothing. Valid ids end at 232.
Where Linux hands out its usual ports 32768 to 60999 to programs that ask for any, only domains up to 100 and from 215 on have
ports of their own. The first are those that people use; so it is 215 to 232, and 102 to 214 once those are taken.
"""

from __future__ import annotations

import os
import random
import socket
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ros_messages import Topics, load_topics

from boom_twin import BoomTwinError
from boom_twin.ros.startup import require_rclpy

USUAL, LARGEST = 101, 232
"""The last domain that people use, as the ROS 2 documentation has it, and the last one whose ports exist."""
PORT_BASE, PORT_GAIN, UNUSED_PORT = 7400, 250, 9
"""Ports of a domain, by the RTPS specification, and one of them that is no participant's."""
HANDED_OUT = Path("/proc/sys/net/ipv4/ip_local_port_range")
PARTITION_FILE = Path(__file__).with_name("isolation.xml")
"""Profile of Fast DDS that puts every endpoint of a process into one partition."""
FOREIGN_WAIT = 4.0
"""Seconds within which those who are there are discovered: Fast DDS announces a participant every 3 s."""
_REMOVED = ("ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS")
"""Variables that lead to other computers whatever the domain."""


@dataclass(frozen=True, slots=True)
class Isolation:
    """Claimed ROS domain, until every process that holds the descriptor `lock` has ended.

    `is_open`: other programs in the domain are heard and hear, as it was chosen and has no partition.
    """

    domain: int
    lock: int
    is_open: bool

    def __str__(self) -> str:
        if self.is_open:
            return f"in ROS domain {self.domain}, open to other programs on this computer"
        return f"in ROS domain {self.domain}, closed to other programs (--domain N: one where your own tools can listen)"


def add_domain(parser: ArgumentParser) -> None:
    """Declare the option ``--domain`` of programs that run isolated."""
    text = "ROS domain, 0 to 232, where your own ROS 2 tools can listen (default: any that is free, closed to them)"
    parser.add_argument("--domain", type=int, choices=range(LARGEST + 1), metavar="N", help=text)


@contextmanager
def isolated(domain: int | None = None) -> Iterator[Isolation]:
    """Put this process, and those that it starts, into a claimed domain on this computer only, until the end.

    By default any above `USUAL` that is free; a `domain` that is given has no partition, so that other tools can listen.
    BoomTwinError: none is free, or somebody in it publishes the twin's topics or listens to its inputs.
    """
    require_rclpy()
    claimed, lock = _claim(_preferred() if domain is None else [domain])
    wanted = {"ROS_DOMAIN_ID": str(claimed), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    if domain is None:
        wanted["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(PARTITION_FILE)
    before = {name: os.environ.get(name) for name in (*wanted, *_REMOVED)}
    with lock:
        _set_environment(dict.fromkeys(_REMOVED) | wanted)
        try:
            refuse_foreign(load_topics())
            yield Isolation(claimed, lock.fileno(), domain is not None)
        finally:
            _set_environment(before)


def refuse_foreign(topics: Topics) -> None:
    """Raise BoomTwinError if anybody in this domain publishes one of the topics, or listens to an input.

    To be called before anything of one's own runs, so that all that is found is foreign; rclpy must not be initialised.
    """
    import rclpy

    from boom_twin.ros.runtime import ros

    with ros([]):
        node = rclpy.create_node("boom_twin_isolation")
        end = time.monotonic() + FOREIGN_WAIT
        try:
            while not (found := _foreign(node, topics)) and time.monotonic() < end:
                time.sleep(0.1)
        finally:
            node.destroy_node()
    if found:
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        raise BoomTwinError(f"ROS domain {domain} is in use: {'; '.join(found)}. End it first, or take another domain.")


def _foreign(node: Any, topics: Topics) -> list[str]:
    """Return in words who publishes one of the topics, or listens to an input."""
    from boom_twin.ros.runtime import node_name

    inputs, outputs = topics.inputs.values(), [*topics.outputs.values(), topics.events]
    of = {f"publishes {each.absolute}": node.get_publishers_info_by_topic(each.absolute) for each in [*inputs, *outputs]}
    of |= {f"listens to {each.absolute}": node.get_subscriptions_info_by_topic(each.absolute) for each in inputs}
    return [f"{name} {does}" for does, ends in of.items() for name in sorted(set(map(node_name, ends)))]


def _preferred() -> list[int]:
    """Return the domains above the usual ones, in random order, first those whose ports the system does not hand out."""
    try:
        low, high = map(int, HANDED_OUT.read_text(encoding="ascii").split())
    except (OSError, ValueError):
        low, high = 32768, 65535

    def is_shared(domain: int) -> bool:
        first = PORT_BASE + PORT_GAIN * domain
        return first <= high and first + PORT_GAIN > low

    return sorted(random.sample(range(USUAL + 1, LARGEST + 1), LARGEST - USUAL), key=is_shared)


def _claim(domains: list[int]) -> tuple[int, socket.socket]:
    """Claim the first free domain; return it and the socket that holds it.

    The socket is bound to a port that DDS does not use in that domain. The system frees it at the end.

    A port is used instead of a file because all users see it, and all containers that share the network, as DDS itself.
    """
    for domain in domains:
        lock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            lock.bind(("127.0.0.1", PORT_BASE + PORT_GAIN * domain + UNUSED_PORT))
            return domain, lock
        except OSError as error:
            lock.close()
            reason = error.strerror
    named = f"{domains[0]}" if len(domains) == 1 else f"{min(domains)} to {max(domains)}"
    raise BoomTwinError(f"ROS domain {named} is claimed by another demonstration, test or benchmark ({reason}). Wait for it.")


def _set_environment(values: dict[str, str | None]) -> None:
    for name, value in values.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
