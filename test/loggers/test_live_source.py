"""A source in Python feeds the twin, the recorder and the live page."""

from __future__ import annotations

import asyncio
import json
import socket
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from urllib.parse import urlsplit

import numpy as np
import pytest
from aiohttp import ClientSession
from loggers.logger_files import readings

from boom_twin import BoomTwinError, LivePage, Sample, Stream, Twin, load_scene, replay

CHANNELS = {"cylinder_strokes": "cylinder_{}", "joint_angles": "joint_{}", "tip_imu": "tip_imu_{}"}


@pytest.fixture
def example() -> ModuleType:
    spec = spec_from_file_location("live_source", Path(__file__).parents[2] / "examples" / "live_source.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_example_of_a_live_source_predicts_records_and_replays(
    example: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found, count = readings(1.0), 100  # as many packets as the system keeps for a socket that is not read yet
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as source, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        source.bind(("127.0.0.1", 0))
        rig.connect(source.getsockname())
        for row in range(count):
            packet = {"stamp_ns": int(found["cylinder_strokes"][0][row])}
            for name, channel in CHANNELS.items():
                ends = "xz" if name == "tip_imu" else range(1, 5)
                packet |= {channel.format(end): value for end, value in zip(ends, found[name][1][row], strict=True)}
            rig.send(json.dumps(packet).encode())
        for odd in (b"no JSON", b"\xff", b"[1]", b'{"stamp_ns": 1, "zylinder_1": 0.6}', b'{"cylinder_1": 0.6}'):
            rig.send(odd)
        rig.send(b'{"end": true}')
        last = example.run(source, load_scene(), tmp_path / "live", page_port=0)
    told = capsys.readouterr().out
    assert "open http://127.0.0.1:" in told and told.count("left out: ") == 5 and "Did you mean cylinder_1?" in told
    done = replay(tmp_path / "live", None, tmp_path / "out", health=False, with_bag=False)
    assert (done.summary["samples"], done.summary["events"]) == (count, {})
    assert last.prediction.tip_position[0] == pytest.approx(done.columns()["tip_x_m"][-1], abs=1e-12)


def test_the_page_shows_what_the_twin_of_this_process_predicts() -> None:
    strokes, imu = readings(1.0)["cylinder_strokes"], readings(1.0)["tip_imu"]

    async def seen(address: str) -> tuple[dict[str, list[str]], list[str]]:
        """Tables and groups of lamps that the page tells."""
        origin = address.rstrip("/")
        async with ClientSession() as client:
            assert "<title>" in await (await client.get(address)).text()
            async with client.ws_connect(f"{origin}/socket", headers={"Origin": origin}) as socket:
                tables, groups = dict[str, list[str]](), list[str]()
                while not ({"displacement", "force"} <= tables.keys() and groups):
                    message = await socket.receive()
                    told = json.loads(message.data) if isinstance(message.data, str) else {}
                    if told.get("kind") == "layout":
                        tables = {table["name"]: table["columns"] for table in told["tables"]}
                    if told.get("kind") == "state":
                        groups = [group["name"] for group in told["groups"] if group["lamps"]]
                return tables, groups

    with LivePage(Twin(load_scene()), port=0) as page:
        for stamp, values, force in zip(strokes[0].tolist(), strokes[1], imu[1], strict=True):
            report = page.update({"cylinder_strokes": values, "tip_imu": force}, stamp_ns=stamp)
        assert page.update(Sample(Stream.STROKES, stamp + 5_000_000, values)).prediction is not None
        tables, groups = asyncio.run(asyncio.wait_for(seen(page.address), 120.0))
        port = urlsplit(page.address).port
        with pytest.raises(BoomTwinError, match=f"cannot listen on 127.0.0.1:{port}"), LivePage(Twin(load_scene()), port=port):
            pass
    assert np.isfinite(report.prediction.tip_position).all() and tables["displacement"] == ["x_m", "z_m"]
    assert "model" in groups
