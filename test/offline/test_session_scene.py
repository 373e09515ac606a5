"""A session carries its scene: which one is taken, and that one of another boom is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import anew, default_text
from drive_twin import note_drives
from health.recorded import ARCH, run
from health.recorded import session as recorded
from oracle import booms
from recordings import SESSION_YAML as FILE_NAME
from recordings import MessageWriter, SessionMetadata, scene_of, write_session
from ros_messages import fill_header, load_topics, new_message

from boom_twin import BagError, Settings, Stream, Twin, load_scene, replay, statics
from boom_twin.bag.session_model import sha256
from boom_twin.monitor.data.bag_feed import bag_feed
from boom_twin.scene.load import DEFAULT_NAME

ORDERS = {3: (0, 1, 2), 4: (0, 1, 2, 3), 5: (0, 1, 1, 2, 3)}
POSTURES = {3: (60, 20, -30), 4: (60, 20, -30, -80), 5: (75, 50, 10, -5, -40)}
START, STEP = 1_700_000_000_000_000_000, 5_000_000


def scene_text(sections: int, closed_longer: float = 0.0) -> str:
    """The default boom with a section more or less; all cylinders longer by so much (m) at the same stroke."""
    spec = booms.document()
    for key in ("sections", "joints"):
        spec[key] = [spec[key][i] for i in ORDERS[sections]]
    spec["postures"] = {"arch": list(POSTURES[sections])}
    for joint in spec["joints"]:
        joint["cylinder"] = joint["cylinder"] | {"closed_length": joint["cylinder"]["closed_length"] + closed_longer}
    return anew(booms.scene_of(spec))


def session(path: Path, text: str, *, keep: bool, rows: int = 300, bias: float = 0.0, strokes: str = "lengths") -> Path:
    """Write a session at rest of the boom of a scene's text, which it keeps or not; joint_1 reads `bias` (rad) too much.

    Its strokes are ``lengths``, or the drives, by the name ``strokes`` of `statics`.
    """
    file = path.with_suffix(".scene.yaml")
    file.write_text(text)
    scene, noise = load_scene(file), np.random.default_rng(1)
    rest = statics(scene, posture="arch")
    read, joints = (np.tile(values, (rows, 1)) for values in (getattr(rest, strokes), rest.joints))
    joints[:, 0] += bias
    joints += noise.normal(0.0, 2e-4, joints.shape)
    write_session(path, START + np.arange(rows) * STEP, read, joints, None, {"origin": "synthetic, a test"})
    if keep:
        SessionMetadata("0", text).write(path)
    return path


FAULTY = "sections: []\n"


@pytest.fixture(scope="module")
def five(tmp_path_factory):
    """A session of five cylinders that keeps its scene."""
    return session(tmp_path_factory.mktemp("five") / "bag", scene_text(5), keep=True)


@pytest.fixture(scope="module")
def four(tmp_path_factory):
    """One of the default boom, that keeps none."""
    return session(tmp_path_factory.mktemp("four") / "bag", scene_text(4), keep=False)


def arguments(bag, out, *more):
    return ["replay", str(bag), "--out", str(out), "--no-pictures", *more]


def without_scene(bag, path):
    """The session as a bare file in a folder of its own, so without what it was made with."""
    path.mkdir()
    (path / "session_0.mcap").write_bytes((bag / "session_0.mcap").read_bytes())
    return path


def test_a_session_of_five_is_replayed_by_its_own_scene(five, tmp_path, capsys):
    assert main(arguments(five, tmp_path / "out", "--json")) == 0
    told = capsys.readouterr()
    summary = json.loads(told.out)
    assert summary == {**summary, "scene": f"{five / FILE_NAME}, scene", "scene_sha256": sha256(scene_text(5))}
    assert f"scene: {five / FILE_NAME}, scene" in told.err
    assert len(summary["joint_residual_rms_rad"]) == 5 and max(summary["joint_residual_rms_rad"]) < 1e-3
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["alarms"] == []
    feed = bag_feed(tmp_path / "out" / "bag", None, Settings())  # a result bag carries it, too
    feed.close()
    assert len(feed.scene().sections) == 5


def test_without_its_scene_it_is_refused(five, tmp_path, capsys):
    bag = without_scene(five, tmp_path / "bare")
    assert main(arguments(bag, tmp_path / "out")) == 1
    (line,) = (line for line in capsys.readouterr().err.splitlines() if line.startswith("boom_twin replay:"))
    assert "/cylinder_strokes names cylinder_5; the scene (default scene) has 4 cylinders" in line and "--scene" in line
    assert not (tmp_path / "out").exists()
    assert main(["info", str(bag)]) == 0
    told = capsys.readouterr().out
    assert "scene      default scene" in told and "missing    /cylinder_strokes names cylinder_5" in told
    with pytest.raises(BagError, match="names cylinder_5"):
        bag_feed(bag, None, Settings())
    note_drives(bag)
    assert main(["calibrate", str(bag), "--out", str(tmp_path / "scene.yaml")]) == 1
    assert "names cylinder_5; the scene has 4 cylinders" in capsys.readouterr().err
    scene = tmp_path / "five.yaml"
    scene.write_text(scene_text(5))
    assert main(["info", str(bag), "--scene", str(scene)]) == 0
    assert f"scene      {scene}" in capsys.readouterr().out


def write_names(path, names, rows=20):
    """Strokes of the names given, at rest."""
    topic = load_topics().inputs[Stream.STROKES]
    with MessageWriter(path, {"strokes": topic}) as bag:
        for row in range(rows):
            msg = new_message(topic.type)
            fill_header(msg.header, 10**18 + row * 5_000_000)
            msg.name, msg.position = names, np.zeros(len(names))
            bag.write("strokes", 10**18 + row * 5_000_000, msg)
    return path


def test_names_that_do_not_match(tmp_path):
    bag = write_names(tmp_path / "bag", ["boom_a", "boom_b", "boom_c", "boom_d"])
    with pytest.raises(BagError, match=r"never names cylinder_1, .*but boom_a, boom_b, boom_c, boom_d;.*--mapping"):
        replay(bag, None, tmp_path / "out")


def test_a_boom_of_as_many_joints_that_does_not_fit_is_refused(tmp_path, capsys):
    other = tmp_path / "other.yaml"
    other.write_text(scene_text(4, closed_longer=0.05))
    assert main(arguments(ARCH, tmp_path / "out", "--scene", str(other), "--duration", "4")) == 1
    told = capsys.readouterr().err
    assert "and the IMU agree with each other" in told and f"The scene ({other}) is of another boom" in told
    assert not (tmp_path / "out" / "summary.json").exists()
    found = run(recorded(4.0), twin=Twin(load_scene(other), health=True))
    assert {(alarm.channel, alarm.kind) for time, alarm in found.states() if time > 3.0} == {("scene", "wiring")}


def test_an_encoder_five_degrees_off_is_a_fault_to_be_found(tmp_path):
    bag = session(tmp_path / "bag", scene_text(4), keep=False, rows=1000, bias=np.radians(5.0), strokes="strokes")
    note_drives(bag)
    alarms = replay(bag, load_scene(), tmp_path / "out").summary["alarms"]
    assert {alarm["channel"] for alarm in alarms} == {"joint_1"}


def test_the_given_scene_comes_first_then_the_sessions_then_the_default(four, five, tmp_path):
    given = tmp_path / "given.yaml"
    given.write_text(default_text() + "# given\n")
    assert scene_of(five, given).source == str(given) and scene_of(five, given).text.endswith("# given\n")
    assert (scene_of(five).source, len(scene_of(five).scene.joints)) == (f"{five / FILE_NAME}, scene", 5)
    assert scene_of(five / "session_0.mcap").scene == scene_of(five).scene
    assert scene_of(four).source == DEFAULT_NAME


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (FAULTY, "session.yaml, scene: "),
        ("a: &a [1]\nb: " + "[*a]" * 3, "not valid YAML"),
        ("sections: !!python/object/apply:os.system ['true']", "session.yaml, scene: "),
    ],
)
def test_a_broken_scene_in_a_session_is_one_line_with_the_remedy(text, words, tmp_path, capsys):
    write_names(tmp_path / "bag", ["cylinder_1"])
    SessionMetadata("0", text).write(tmp_path / "bag")
    for command in (["info", str(tmp_path / "bag")], arguments(tmp_path / "bag", tmp_path / "out")):
        assert main(command) == 1
        told = capsys.readouterr().err
        assert words in told and "Give the scene by --scene." in told and told.count("\n") == 1


def test_a_given_scene_with_other_values_than_the_recorded_one_is_told(five):
    own = scene_of(five).scene
    assert scene_of(five, own.with_(postures={})).oddities == ()
    (told,) = scene_of(five, own.with_(payload=40.0, line_fill=12.0)).oddities
    assert told.kind == "note" and f"differs from the scene of the session ({five / FILE_NAME}, scene), and 1 more" in str(told)
    assert scene_of(five, load_scene()).oddities[0].path == "sections"


def test_a_scene_that_was_changed_is_told(five, tmp_path, capsys):
    bag = without_scene(five, tmp_path / "bag")
    sheet = (five / FILE_NAME).read_text()
    (bag / FILE_NAME).write_text(sheet.replace("gravity", "# by hand\n  gravity", 1) + "baseline: of 0.1.0\n")
    assert main(["info", str(bag)]) == 0
    assert "was changed after the recording" in capsys.readouterr().err
