"""Accuracy by sensors: more of them never make it worse, and what is stated is what the twin's own filter comes to."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import EXACT, default_text, strokes_of_posture

from boom_twin import Sample, Settings, Stream, Twin, load_scene, statics
from boom_twin.deviation.accuracy import TipAccuracy, accuracy_at
from boom_twin.deviation.channels import READS_COORDINATE
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.scene.schema import Scene
from boom_twin.types import Place
from boom_twin.validation.rig.faults import wrong_by

SCENE = load_scene()
ARCH = strokes_of_posture(SCENE, "arch")
Z_FOLD = load_scene(str(files("boom_twin") / "examples" / "five_section_z_fold.yaml"))
TIP = Place()
SETS = ([], [Stream.ANGLES], [Stream.ANGLES, Stream.IMU], [Stream.ANGLES, Stream.IMU, Stream.IMU])


@pytest.fixture(scope="module")
def found() -> list[TipAccuracy]:
    return [accuracy_at(SCENE, ARCH, chosen, EXACT) for chosen in SETS]


def test_more_sensors_are_never_worse(found: list[TipAccuracy]) -> None:
    for fewer, more in pairwise(found):
        for before, after in zip(fewer, more, strict=True):
            assert (after <= before * 1.1).all()
    assert np.hypot(*found[2].acceleration) < 0.25 * np.hypot(*found[1].acceleration), "an IMU tells how it accelerates"


def test_it_is_what_a_twin_comes_to() -> None:
    """The same sensors on a twin whose size of the unknown load is held, after 10 s of readings of a boom at rest."""
    stated, twin = accuracy_at(SCENE, ARCH, [Stream.ANGLES]), Twin(SCENE)
    rng, rest, estimates = np.random.default_rng(1), statics(SCENE, strokes=ARCH), []
    for k in range(4000):
        report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, rest.lengths + 2e-5 * rng.normal(size=4)))
        assert report.estimate is not None
        twin._boom.filters.load2[:] = twin._boom.filters.noise.usual_load**2
        twin.update(Sample(Stream.ANGLES, 5_000_000 * k, rest.joints + 1.745e-4 * rng.normal(size=4)))
        estimates.append(report.estimate.tip_covariance[[0, 3, 5]])
    assert np.sqrt(np.mean(estimates[2000:], axis=0)) == pytest.approx(stated.tip, rel=0.15)  # learnt noise adds to it


def tip_at_rest(
    scene: Scene, settings: Settings, lengths: np.ndarray, point: np.ndarray | None = None, place: Place = TIP
) -> tuple[np.ndarray, np.ndarray]:
    """Return x, y, angle of the tip and their variances after 3 s of these lengths, and of positions of a point at 10 Hz."""
    twin = Twin(scene, settings, places={"points": place})
    for k in range(600):
        report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, lengths))
        if point is not None and k % 20 == 0:
            twin.update(Sample(Stream.POINT, 5_000_000 * k, point))
    assert report.estimate is not None
    return report.estimate.tip, np.array(report.estimate.tip_covariance[[0, 3, 5]])


@pytest.mark.parametrize(("scene", "posture"), [(SCENE, "arch"), (SCENE, "high"), (Z_FOLD, "arch"), (Z_FOLD, "folded")])
def test_stated_deviation_contains_errors_of_the_scene(scene: Scene, posture: str) -> None:
    """Sixty rigs 2 % wrong, at rest. Errors beyond twice that are not drawn: the others have 0.88 of the deviation."""
    strokes, off = strokes_of_posture(scene, posture), []
    for seed in range(60):
        wrong = statics(wrong_by(scene, 0.02, seed), strokes)
        off.append(wrong.tip - statics(scene, lengths=wrong.lengths).tip)
    lengths = statics(scene, strokes).lengths
    added = tip_at_rest(scene, Settings(), lengths)[1] - tip_at_rest(scene, EXACT, lengths)[1]
    assert (added > 0.0).all()
    found = np.sqrt(np.mean(np.square(off), axis=0))
    assert found == pytest.approx(0.88 * np.sqrt(added[:2]), rel=0.3, abs=1e-4)


@pytest.mark.parametrize(("section", "share"), [(5, 1.0), (5, 0.5), (4, 0.5)])
def test_a_measured_point_on_the_last_section_shows_what_the_scene_has_wrong(section: int, share: float) -> None:
    """Ten rigs 2 % wrong, of which a total station measures a point: at the tip, and further in."""
    strokes, errors, size = strokes_of_posture(Z_FOLD, "arch"), [], Z_FOLD.sections[section - 1].length
    place = Place() if share == 1.0 else Place(section, share * size)
    for seed in range(10):
        wrong = wrong_by(Z_FOLD, 0.02, seed)
        rest = statics(wrong, strokes)
        rig = BoomPredictor(wrong, Settings(), places={"points": place})
        rig.start(rest.lengths)
        (site,) = {int(row.site) for row in rig.posture.channels if row.kind == READS_COORDINATE}
        point = rig.posture.read[5 + 3 * site : 7 + 3 * site].copy()
        tip, variances = tip_at_rest(Z_FOLD, Settings(), rest.lengths, point, place)
        errors.append((tip - rig.posture.read[5:8]) / np.sqrt(variances))  # the tip is the first site
    along, angle = np.sqrt(np.mean(np.square(errors)[:, :2])), np.sqrt(np.mean(np.square(errors)[:, 2]))
    assert 0.4 < along < 1.2
    assert 0.4 < angle < 1.1
    assert np.sqrt(variances[1]) < 4e-3 if section == 5 else np.sqrt(variances[1]) > 10e-3


@pytest.mark.parametrize(("off", "low", "high"), [(0.0, 0.0, 1e-3), (4e-3, 0.08, 0.2), (30e-3, 0.6, 1.5)])
def test_a_transducer_that_an_angle_sensor_contradicts_is_stated(off: float, low: float, high: float) -> None:
    """Cylinder 2 reads too much. The error is within what is stated, which is small without a contradiction.

    Of 30 mm the commissioning check leaves the angle sensor out. The stroke may still be the one that is wrong.
    """
    twin, rng, rest = Twin(SCENE, EXACT, health=True), np.random.default_rng(2), statics(SCENE, strokes=ARCH)
    strokes = rest.lengths + off * np.eye(4)[1]
    for k in range(1000):
        report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, strokes + 2e-5 * rng.normal(size=4)))
        twin.update(Sample(Stream.ANGLES, 5_000_000 * k, rest.joints + 1.745e-4 * rng.normal(size=4)))
    assert report.estimate is not None
    stated = np.sqrt(report.estimate.tip_covariance[[0, 3]])
    assert low <= np.hypot(*stated) < high
    assert (np.abs(report.estimate.tip[:2] - rest.tip) < 2.5 * stated).all()
    assert np.hypot(*(statics(SCENE, lengths=strokes).tip - rest.tip)) < 1.6 * max(np.hypot(*stated), 1e-3)


def test_a_contradiction_is_stated_at_once() -> None:
    """The transducer of cylinder 1 begins to read 2 mm too much. At no instant is the tip off by more than five deviations."""
    twin, rng, rest = Twin(SCENE, EXACT), np.random.default_rng(3), statics(SCENE, strokes=ARCH)
    errors, stated = [], []
    for k in range(600):
        strokes = rest.lengths + 2e-3 * min(max(k - 400, 0) / 20, 1.0) * np.eye(4)[0]
        report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, strokes + 2e-5 * rng.normal(size=4)))
        twin.update(Sample(Stream.ANGLES, 5_000_000 * k, rest.joints + 1.745e-4 * rng.normal(size=4)))
        assert report.estimate is not None
        errors.append(report.estimate.tip[:2] - rest.tip)
        stated.append(np.sqrt(report.estimate.tip_covariance[[0, 3]]))
    assert np.hypot(*stated[399]) < 1e-3
    assert (np.hypot(*np.transpose(errors)) < 5.0 * np.hypot(*np.transpose(stated))).all()


def test_the_command_states_every_selection_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "one_posture.yaml"
    scene.write_text(re.sub(r"  (horizontal|high|low): .*\n", "", default_text()))
    assert main(["check", str(scene), "--sensors", "angles, imu,imu", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    keys = [key.removeprefix("accuracy_arch:") for key in found if key.startswith("accuracy_arch:")]
    assert keys == ["strokes only", "angles", "imu", "angles,imu", "imu,imu", "angles,imu,imu"]
    assert main(["check", "--sensors", "angles,radar"]) == 1
    assert "'radar' is no sensor" in capsys.readouterr().err
