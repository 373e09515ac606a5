"""``boom_twin response``: what it prints, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import answer, main
from oracle import booms

from boom_twin import frequency_response, load_scene, statics

Capture = pytest.CaptureFixture[str]


def table(path: Path) -> dict[str, np.ndarray]:
    header, *rows = path.read_text().splitlines()
    return dict(zip(header.split(","), np.array([row.split(",") for row in rows], dtype=float).T, strict=True))


def test_response_is_that_of_the_function_and_has_the_natural_frequencies(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "out"
    found = answer(capsys, "response", "--posture", "arch", "--tip", "3,4", "--out", str(out))
    frequencies = np.array(found["frequency_Hz"])
    assert len(frequencies) == 304 and np.all(np.diff(frequencies) > 0.0)
    expected = frequency_response(load_scene(), frequencies, posture="arch", tip_force=(3.0, 4.0)).channels()
    columns = table(out / "response.csv")
    for name, values in expected.items():
        told = np.array(found[f"{name}_amplitude"]) * np.exp(1j * np.array(found[f"{name}_phase_rad"]))
        assert told == pytest.approx(values, rel=1e-9, abs=1e-18)
        assert columns[f"{name}_amplitude"] == pytest.approx(np.abs(values), rel=1e-9, abs=1e-18)
    assert (out / "response.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("load", [("--drive", "2"), ("--pump", "0.43:130")])
def test_lengths_are_those_of_the_boom_at_rest(load: tuple[str, ...], capsys: Capture) -> None:
    rest = statics(None, "arch")
    places = ("--strokes", rest.strokes), ("--lengths", rest.lengths)
    drives, lengths = (
        answer(capsys, "response", f"{name}={','.join(map(repr, each.tolist()))}", *load) for name, each in places
    )
    for key, values in drives.items():
        assert key in ("load", "warnings") or lengths[key] == pytest.approx(values, rel=1e-6, abs=1e-9)
    assert main(["response", "--lengths", "0.6,0.1", *load]) == 1
    assert "lengths = 2 values: the scene has 4 cylinders" in capsys.readouterr().err


def test_map_of_postures(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "out"
    given = ["--map", "horizontal,arch", "--pump", "0.4:50", "--rates", "0.28:0.42:15", "--out", str(out)]
    found = answer(capsys, "response", *given)
    assert found["postures"] == ["horizontal", "arch"]
    assert np.array(found["swing_m"]).shape == (2, 15)
    assert set(found["avoid_posture"]) == set(found["postures"]) and set(found["avoid_harmonic"]) == {3}
    assert list(table(out / "resonance_map.csv")) == ["rate_Hz", *(f"swing_m_{name}" for name in found["postures"])]
    assert main(["response", *given]) == 0  # an earlier response is replaced
    assert "harmonic" in capsys.readouterr().out


def test_play_in_the_pins_is_refused(capsys: Capture, tmp_path: Path) -> None:
    assert main(["scene", "--clearance"]) == 0
    scene = tmp_path / "worn.yaml"
    scene.write_text(capsys.readouterr().out)
    for given in (["--posture", "arch"], ["--posture", "arch", "--pump", "0.4:130"], ["--map", "all", "--pump", "0.4:130"]):
        assert main(["response", str(scene), *given]) == 1
        assert "clearance" in capsys.readouterr().err


@pytest.mark.parametrize(
    "given, told",
    [
        (["--posture", "nowhere"], "posture = 'nowhere'"),
        (["--posture", "arch", "--drive", "9"], "cylinders 1 to 4"),
        (["--posture", "arch", "--tip", "1,2,3"], "two numbers"),
        (["--posture", "arch", "--pump", "0:130"], "rate = 0"),
        (["--posture", "arch", "--load", "nowhere.csv"], "nowhere.csv"),
        (["--map", "all"], "needs --pump"),
        (["--posture", "arch", "--tip", "0,0"], "moves nothing. Give a force"),
        (["--posture", "arch", "--pump", "0.4:130", "--to", "5"], "--to: goes with a frequency response"),
    ],
)
def test_refused(capsys: Capture, given: list[str], told: str) -> None:
    assert main(["response", *given]) == 1
    first, line = capsys.readouterr().err.splitlines()
    assert told in line and first.startswith("scene: default scene")


def test_a_rigid_boom_stays_where_it_is(capsys: Capture, tmp_path: Path) -> None:
    spec = booms.document()
    for joint in spec["joints"]:
        joint["cylinder"] = {key: value for key, value in joint["cylinder"].items() if key not in ("k", "d")}
    (tmp_path / "rigid.yaml").write_text(json.dumps(spec | {"modes": 0}))
    given = "response", str(tmp_path / "rigid.yaml"), "--posture", "arch"
    found = answer(capsys, *given)
    assert max(found["tip_y_m_amplitude"]) == max(found["joint_1_rad_amplitude"]) == 0.0
    assert max(found["cylinder_force_1_N_amplitude"]) > 1.0
    assert answer(capsys, *given, "--pump", "0.4:130")["tip_swing_m"] == 0.0
    assert main([*given]) == 0
    assert "nothing in this model can vibrate" in capsys.readouterr().out


def test_without_damping_no_amplitude_is_made_up_at_a_resonance(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "undamped.yaml").write_text(json.dumps(booms.undamped()))
    found = answer(capsys, "response", str(tmp_path / "undamped.yaml"), "--posture", "arch", "--to", "3")
    assert len(found["frequency_Hz"]) == 300 and len(found["natural_frequencies_Hz"]) == 2
    assert max(found["tip_y_m_amplitude"]) < 0.1
    assert "nothing damps the resonances at 1.06" in found["warnings"][0]
