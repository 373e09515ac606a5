"""pyOMA-2 as a witness of the natural frequencies of free vibration: another code, another method, the same records."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.test_free_vibration import DT, FREQUENCIES, record

from boom_twin.analysis.free_vibration import Vibration, free_vibrations

ssi = pytest.importorskip("pyoma2.functions.ssi", reason="pyOMA-2 is in the extra peers")

BLOCK_ROWS, ORDER, SEEDS = 60, 14, 20


def by_pyoma(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Hz) and damping ratios by data-driven SSI of `ORDER`, nearest to those that are true."""
    centred = (values - values.mean(axis=0)).T
    hankel, _ = ssi.build_hank(centred, centred, BLOCK_ROWS, "dat")
    observability, a, c, _ = ssi.SSI_fast(hankel, BLOCK_ROWS, ORDER)
    frequencies, dampings = ssi.SSI_poles(observability, a, c, ORDER, DT)[:2]
    own = frequencies[:, -1], dampings[:, -1]
    nearest = [int(np.nanargmin(np.abs(own[0] - frequency))) for frequency in FREQUENCIES]
    return own[0][nearest], own[1][nearest]


def by_twin(values: np.ndarray) -> list[Vibration]:
    found = free_vibrations(DT, values)
    return [min(found, key=lambda each: abs(each.frequency - frequency)) for frequency in FREQUENCIES]


def test_without_noise_both_give_the_closed_form() -> None:
    values = record(0.0, 1)
    frequencies, dampings = by_pyoma(values)
    own = by_twin(values)
    assert frequencies == pytest.approx(FREQUENCIES, rel=1e-4)
    assert [each.frequency for each in own] == pytest.approx(frequencies, rel=1e-4)
    assert [each.damping for each in own] == pytest.approx(dampings, abs=1e-4)


def test_with_noise_both_agree_on_average_and_ours_is_no_less_sure() -> None:
    own, witness = [], []
    for seed in range(SEEDS):
        values = record(0.05, seed)
        own.append([each.frequency for each in by_twin(values)])
        witness.append(by_pyoma(values)[0])
    ours, theirs = np.array(own) / FREQUENCIES - 1.0, np.array(witness) / FREQUENCIES - 1.0
    apart = ours - theirs
    assert (np.abs(apart.mean(axis=0)) < 3.5 * apart.std(axis=0) / np.sqrt(SEEDS)).all()
    assert (ours.std(axis=0) < 1.2 * theirs.std(axis=0)).all(), "no less sure than the witness"
