"""Readings that come as JSON over UDP go to the twin, into a session and onto the live page, without ROS.

    python examples/live_source.py --port 5005 --out out/live

A packet holds the time and readings in SI units, by the names of channels:

    {"stamp_ns": 1700000000000000000, "cylinder_1": 0.63, "cylinder_2": 0.17, "joint_1": 1.04, "tip_imu_x": -9.7}

For another source, such as a CAN bus or MQTT, replace `packets`: yield a dict for every cycle.
The packet {"end": true} or Ctrl-C ends the session. `boom_twin replay out/live --out out/replay` then replays it.
"""

import argparse
import json
import socket

from boom_twin import LivePage, SessionWriter, Twin, load_scene
from boom_twin.errors import UsageError


def packets(source):
    """Yield the readings of every packet until the end."""
    while True:
        try:
            found = json.loads(source.recv(65_536))
        except ValueError as error:
            print(f"left out: no JSON ({error})")
            continue
        if not isinstance(found, dict):
            print(f"left out: {found!r} is no object")
            continue
        if "end" in found:
            return
        yield found


def run(source, scene, out, page_port=None):
    """Give all readings of a socket to a twin, a session and a page; return the last report with a prediction."""
    last, twin = None, Twin(scene)
    with SessionWriter(out, scene, origin="UDP, examples/live_source.py") as session, LivePage(twin, port=page_port) as page:
        print(f"open {page.address}", flush=True)
        try:
            for readings in packets(source):
                stamp_ns = readings.pop("stamp_ns", None)
                try:
                    report = page.update(readings, stamp_ns=stamp_ns)
                    session.write(readings, stamp_ns=stamp_ns)
                except UsageError as error:
                    print(f"left out: {error}")
                    continue
                last = last if report.prediction is None else report
        except KeyboardInterrupt:
            print("stopped")
    return last


def main():
    """Listen at a port of this machine."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=5005)
    parser.add_argument("--scene", help="scene file; without it, the default scene")
    parser.add_argument("--out", default="out/live", help="folder of the session, new or empty")
    args = parser.parse_args()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as source:
        source.bind(("127.0.0.1", args.port))
        last = run(source, load_scene(args.scene), args.out)
    print(f"tip at {last.prediction.tip_position} m" if last else "nothing was predicted")


if __name__ == "__main__":
    main()
