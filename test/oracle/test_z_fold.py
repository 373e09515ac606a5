"""The packaged Z-fold boom, with mirrored linkages and oil, against Exudyn; oil by itself."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

pytest.importorskip("exudyn")

from default_boom import examine_text, example_text, strokes_of_posture

from boom_twin import simulate
from boom_twin.validation import rig
from boom_twin.validation.rig.faults import changes, parse, with_faults

OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.5e9, "cap_line": 1e-3, "rod_line": 1e-3}


def z_fold():
    return examine_text(example_text("five_section_z_fold"), "example")[0]


def test_it_is_what_it_says():
    scene, oddities = examine_text(example_text("five_section_z_fold"), "example")
    assert oddities == [] and len(scene.sections) == 5 and scene.reach == pytest.approx(36.0)
    assert [joint.side for joint in scene.joints] == [None, None, "right", None, "right"]
    assert sum(joint.cylinder.oil is not None for joint in scene.joints) == 3
    sizes = {3: (0.17, 0.09, 1e-3), 4: (0.10, 0.06, 5e-4)}  # of its comment: bore, rod, lines
    for i, (bore, rod, line) in sizes.items():
        most = scene.joints[i].cylinder.max_stroke
        assert scene.joints[i].cylinder.k == pytest.approx(formula(0.5 * most, most, bore, rod, line, 1.4e9), rel=5e-3)


def test_motion_is_that_of_exudyn():
    """A move of 4.2 m at the tip, then it swings freely."""
    scene = z_fold()
    first = strokes_of_posture(scene, "arch")
    moves = [rig.Move(i, 0.0, 1.5, first[i] + change) for i, change in ((0, -0.06), (1, 0.03), (2, 0.04))]
    drive = rig.Programme(tuple(first), tuple(moves))
    rows, _ = rig.move(rig.at_rest(scene, first, 8, nodally_exact=True), drive, 2.5, 2e-3, 2e-3)
    found = simulate(scene, rows["t"], drive(rows["t"])[0], dt=1e-3)
    assert np.ptp(rows["tip"][:, 1]) > 4.0
    assert np.linalg.norm(found.tip[:, :2] - rows["tip"], axis=1).max() < 2e-3
    forces = rows["forces"]
    assert found.cylinder_forces == pytest.approx(forces, abs=5e-3 * np.abs(forces).max())


def one_section(**cylinder):
    """Section 1 of the default boom on its cylinder, in which `cylinder` changes keys; 2 t at its tip."""
    spec = booms.document()
    own = {key: value for key, value in (spec["joints"][0]["cylinder"] | cylinder).items() if value is not None}
    spec |= {"sections": spec["sections"][:1], "joints": [spec["joints"][0] | {"cylinder": own}], "tip": {"payload": 2000.0}}
    return booms.scene_of(spec | {"postures": {}})


def formula(stroke, max_stroke=0.79, bore=0.1, rod=0.07, line=1e-3, modulus=1.5e9):
    """k (N/m), as the contract writes it."""
    cap, ring = np.pi / 4 * bore**2, np.pi / 4 * (bore**2 - rod**2)
    return modulus * (cap**2 / (line + cap * stroke) + ring**2 / (line + ring * (max_stroke - stroke)))


@pytest.mark.parametrize("stroke", [0.12, 0.4, 0.7])
def test_oil_is_exudyn_s_spring_of_that_stiffness(stroke):
    """At rest, and shaken there: Exudyn has a plain spring with the number."""
    drive = rig.Programme((stroke,), (rig.Move(0, 0.0, 0.1, stroke + 1e-3),))
    rows = rig.simulate(one_section(k=formula(stroke + 1e-3)), drive, 1.0, step=1e-3)
    found = simulate(one_section(k=None, oil=OIL), rows["t"], drive(rows["t"])[0], dt=1e-3)
    swing = np.ptp(rows["tip"], axis=0).max()
    assert swing > 5e-3 and np.linalg.norm(found.tip[:, :2] - rows["tip"], axis=1).max() < 0.01 * swing


def test_oil_stiffens_and_softens_as_the_boom_moves():
    drive = rig.Programme((0.05,), (rig.Move(0, 0.0, 1.0, 0.5),))
    rows = rig.simulate(one_section(k=None, oil=OIL), drive, 1.5, step=1e-3)
    tips = [
        simulate(scene, rows["t"], drive(rows["t"])[0], dt=1e-3).tip[:, :2]
        for scene in (one_section(k=None, oil=OIL), one_section(k=formula(0.05)))
    ]
    off, constant = (np.linalg.norm(tip - rows["tip"], axis=1).max() for tip in tips)
    assert off < 1e-3 and constant > 5e-3


def test_a_softer_spring_of_oil_in_the_rig():
    """From the start, and coming on while the boom moves, which ends as if it had been there."""
    healthy = one_section(k=None, oil=OIL, d=2e6)  # so much that it comes to rest
    soft = with_faults(healthy, [parse("cylinder_1.k:softer:0.3")])
    strokes = np.array([0.3])
    compression = [rig.statics(scene, strokes, elements=4)["joints"][0] for scene in (healthy, soft)]
    rigid = rig.statics(one_section(k=None, d=None), strokes, elements=4)["joints"][0]
    assert compression[1] - rigid == pytest.approx((compression[0] - rigid) / 0.7, rel=2e-3)
    start, coming = changes(healthy, [parse("cylinder_1.k:softer:0.3@0.2+0.2")])
    moving = rig.Programme((0.3,), (rig.Move(0, 0.0, 0.8, 0.45),))
    ends = [rig.simulate(scene, moving, 8.0, step=4e-3, output_step=4e-3, elements=4, changes=change)
            for scene, change in ((start, coming), (soft, []))]  # fmt: skip
    assert ends[0]["joints"][0, 0] == pytest.approx(compression[0], abs=1e-9)
    last = slice(-100, None)
    assert ends[0]["joints"][last, 0] == pytest.approx(ends[1]["joints"][last, 0], abs=2e-5)
