"""What gives a single sensor away: each fault found in its time, nothing found on clean readings."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import default_text
from ruamel.yaml import YAML

from boom_twin import SceneWarning, load_scene, statics
from boom_twin import Stream as Channels
from boom_twin.health.sensor_check import SensorCheck, sensor_ranges

from .recorded import look

SIGMA, RESOLUTION, PERIOD, ROWS = 1.745e-4, 8.727e-5, 0.005, 20
LOW, HIGH = np.full(4, -1.0), np.full(4, 1.0)


class Stream:
    """Blocks of 0.1 s of four channels: a slow motion, noise, rounding, then what the test does to them."""

    def __init__(self, seed: int, sigma: float = SIGMA, resolution: float = RESOLUTION, fastest: float = 0.0) -> None:
        self.rng, self.sigma, self.resolution, self.block = np.random.default_rng(seed), sigma, resolution, 0
        self.check = SensorCheck(SIGMA, RESOLUTION, LOW, HIGH, fastest)

    def look(self, change=lambda times, raw: raw, motion=lambda times: 0.2 * np.sin(0.5 * times), kept=slice(None)):
        stamps = (self.block * ROWS + np.arange(ROWS)) * PERIOD
        expected = np.tile(motion(stamps)[:, None], (1, 4))
        read = expected + self.rng.normal(0.0, self.sigma, expected.shape)
        raw = change(stamps, np.round(read / self.resolution) * self.resolution if self.resolution else read)
        self.block += 1
        return look(self.check, self.block - 1, stamps[kept], raw[kept], expected[kept])

    def rounded(self, values):
        """Readings of constant `values` (4,)."""
        read = values + self.rng.normal(0.0, self.sigma, (ROWS, 4))
        return np.round(read / self.resolution) * self.resolution

    def found(self, blocks: int, **options) -> dict[tuple[str, int], float]:
        """First time (s from now) of every kind and channel."""
        found: dict[tuple[str, int], float] = {}
        for k in range(blocks):
            for kind, flags in self.look(**options).flags.items():
                for channel in np.flatnonzero(flags).tolist():
                    found.setdefault((kind, channel), (k + 1) * ROWS * PERIOD)
        return found


def only(found, kind, channel, within):
    assert set(found) == {(kind, channel)}
    assert found[kind, channel] <= within


def started(seed: int, **options) -> Stream:
    stream = Stream(seed, **options)
    assert stream.found(20) == {}
    return stream


RESTING = {"motion": lambda times: np.full_like(times, 0.3)}


@pytest.mark.parametrize(
    ("made", "blocks", "looked"),
    [
        *(({"seed": seed, "fastest": fastest}, 1250, {}) for seed in range(4) for fastest in (0.0, 0.5)),
        ({"seed": 11, "resolution": 0.0}, 500, {}),
        ({"seed": 12, "sigma": 1e-7}, 300, RESTING),  # a rounded reading repeats while the boom rests
        ({"seed": 2, "sigma": 0.0, "resolution": 0.0}, 300, RESTING),  # so do those of a model at rest
    ],
)
def test_clean_readings_give_nothing(made, blocks, looked):
    """10^5 readings of each of four channels in all."""
    assert Stream(**made).found(blocks, **looked) == {}


@pytest.mark.parametrize(("sigma", "resolution"), [(SIGMA, 1.5e-3), (0.3 * SIGMA, 3.8e-4), (SIGMA, 6e-4)])
def test_a_read_out_that_is_coarser_than_stated_gives_nothing(sigma, resolution):
    """The boom rests for two minutes where some sensors dither between two steps and others stand in the middle of one."""
    rests = np.full(4, 0.3) + resolution * np.array([0.0, 0.5, 0.2, -0.4])
    stream = Stream(31, sigma=sigma, resolution=resolution)
    stream.found(20)  # a move, in which all show their step
    assert stream.found(1200, motion=lambda times: np.zeros_like(times), change=lambda _, raw: stream.rounded(rests)) == {}


@pytest.mark.parametrize(("expects", "kinds"), [(0.0, {"range"}), (1.5, set())])
def test_a_reading_out_of_range_where_the_model_is_too_shows_a_wrong_range(expects, kinds):
    """Readings are 1.5 of a range that ends at 1."""
    stream = started(5)

    def change(times, raw):
        raw[:, 3] += 1.5 - expects
        return raw

    found = stream.found(10, change=change, motion=lambda times: np.full_like(times, expects))
    assert {kind for kind, _ in found} - {"jump"} == kinds


def test_stuck():
    stream, last = started(1), []

    def change(times, raw):
        last.append(raw[0, 2])
        raw[:, 2] = last[0]
        return raw

    only(stream.found(10, change=change), "stuck", 2, 1.0)


def test_all_stuck():
    """As of a driver that sends its last message again and again. They had noise before."""
    stream, last = started(1), []

    def change(times, raw):
        last.append(raw[0].copy())
        raw[:] = last[0]
        return raw

    assert set(stream.found(10, motion=lambda times: np.full_like(times, 0.3), change=change)) >= {
        ("stuck", i) for i in range(4)
    }
    found = [stream.look(motion=lambda times: np.full_like(times, 0.3), change=change) for _ in range(100)]
    assert all(each.flags["stuck"].all() for each in found)


@pytest.mark.parametrize("times", [3.5, 5.0, 10.0])
def test_noisy(times):
    """Much noise looks like spikes and jumps, too; of this sensor alone."""

    def change(_, raw):
        raw[:, 1] += stream.rng.normal(0.0, times * SIGMA, ROWS)
        return raw

    stream = started(3)
    found = stream.found(20, change=change)
    assert found["noise", 1] <= 1.0 and {channel for _, channel in found} == {1}


def test_haste_is_no_noise_at_fifty_hertz_and_noise_is():
    """A cylinder that goes 0.2 m in 1.6 s and back, again and again, while the others stand still."""
    rng, sigma = np.random.default_rng(8), 2e-5
    check = SensorCheck(sigma, 5e-6, LOW, HIGH, 0.5)

    def at(block, scale):
        stamps = 0.1 * block + 0.02 * np.arange(5)
        share = np.abs((stamps / 1.6 + 1.0) % 2.0 - 1.0)
        moving = 0.2 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        readings = np.column_stack([moving, *([np.full(5, 0.3)] * 3)]) + rng.normal(0.0, scale * sigma, (5, 4))
        return look(check, block, stamps, readings)

    for block in range(400):
        found = at(block, 1.0)
        assert found.flags == {}
    found = [at(block, np.array([4.0, 1.0, 1.0, 1.0])) for block in range(400, 440)]
    assert all(each.flags["noise"].tolist() == [True, False, False, False] for each in found[-20:])


@pytest.mark.parametrize("are_of_readings", [True, False])
def test_uneven_stamps_of_a_fast_cylinder_are_no_noise(are_of_readings):
    """0.6 m/s: 0.15 ms are five times the noise, whether the readings were taken then, or evenly and stamped late."""
    rng, sigma = np.random.default_rng(9), 2e-5
    check = SensorCheck(sigma, 5e-6, LOW, HIGH, 0.5)
    for block in range(400):
        even = 0.1 * block + 0.001 + 0.0049 * np.arange(20)
        stamps = even + rng.uniform(-2.5e-4, 2.5e-4, 20)
        moving = 0.3 * np.sin(2.0 * (stamps if are_of_readings else even))
        readings = np.column_stack([moving, *([np.full(20, 0.3)] * 3)]) + rng.normal(0.0, sigma, (20, 4))
        found = look(check, block, stamps, readings)
        assert found.flags == {}


def test_a_little_more_noise_is_not_noisy():
    quiet = started(4)
    assert quiet.found(200, change=lambda times, raw: raw + quiet.rng.normal(0.0, SIGMA, raw.shape)) == {}


def test_all_noisier_than_stated_is_no_fault_but_told():
    """A data sheet that is wrong: at 50 Hz, where a second has few readings, one of four sensors often seemed faulty."""
    check, rng = SensorCheck(SIGMA, 0.0, LOW, HIGH, 0.0), np.random.default_rng(21)

    def noisy(block, scale):
        stamps = 0.1 * block + 0.02 * np.arange(5)
        found = look(check, block, stamps, rng.normal(0.0, 1.0, (5, 4)) * scale)
        return found.flags.get("noise", np.zeros(4, dtype=bool))

    assert not any(noisy(block, 2.2 * SIGMA).any() for block in range(1200))
    assert check.noise == pytest.approx(2.2, rel=0.15)
    found = np.array([noisy(block, SIGMA * np.array([2.2, 2.2, 11.0, 2.2])) for block in range(1200, 1240)])
    assert found[-10:, 2].all() and not found[:, [0, 1, 3]].any()
    found = np.array([noisy(block, 30.0 * SIGMA) for block in range(1240, 1280)])  # all are wild: no data sheet is so wrong
    assert found[-10:].all()


@pytest.mark.parametrize("place", [0, 7, 18, 19])
def test_a_spike_anywhere_in_a_block(place):
    def change(times, raw):
        if stream.block == 20:
            raw[place, 3] += 0.02
        return raw

    stream = started(5)
    only(stream.found(10, change=change), "spikes", 3, 0.2)


@pytest.mark.parametrize("place", [0, 1, 10, 18, 19])
def test_a_jump_anywhere_in_a_block(place):
    def change(times, raw):
        raw[times > (20 * ROWS + place - 0.5) * PERIOD, 0] += 0.01
        return raw

    stream = started(6)
    sizes = [stream.look(change).jumped for _ in range(4)]
    assert np.sum(sizes, axis=0) == pytest.approx([0.01, 0.0, 0.0, 0.0], abs=6.0 * SIGMA)
    assert np.count_nonzero(sizes) == 1, "told once"


def test_motion_of_the_model_is_no_jump():
    """A step of measured and expected alike, and one of the expected alone, are the model's own."""
    stream = started(7)
    assert stream.found(10, motion=lambda times: np.where(times > 2.23, 0.3, 0.1)) == {}
    stream = started(8)
    found = stream.found(10, motion=lambda times: np.where(times > 2.23, 0.3, 0.1), change=lambda times, raw: raw * 0.0 + 0.1)
    assert not any(kind == "jump" for kind, _ in found)


def test_a_fast_move_of_a_drive_is_no_jump():
    """Against its own bound, where there is no model: 0.3 m/s passes, 5 mm between two readings do not."""
    stream = Stream(9, fastest=0.5)

    def look(change):
        return stream.look(change, motion=lambda times: 0.0 * times)

    for _ in range(30):
        findings = look(lambda times, raw: raw + 0.3 * np.clip(times - 1.0, 0.0, 1.0)[:, None])
        assert not findings.jumped.any()
    sizes = [look(lambda times, raw: raw + 0.3 + 0.005 * (times > 3.04)[:, None]).jumped for _ in range(3)]
    assert np.sum(sizes, axis=0) == pytest.approx(np.full(4, 0.005), abs=6.0 * SIGMA)


@pytest.mark.parametrize(("share", "within"), [(0.3, 1.5), (1.0, 0.6)])
def test_dropout_of_one_channel(share, within):
    def change(times, raw):
        raw[stream.rng.random(ROWS) < share, 1] = np.nan
        return raw

    stream = started(11)
    only(stream.found(20, change=change), "dropout", 1, within)


def test_dropout_of_the_whole_stream():
    found = started(12).found(10, kept=slice(0, 0))
    assert set(found) == {("dropout", channel) for channel in range(4)}
    assert max(found.values()) <= 0.7
    assert set(Stream(1).found(10, kept=slice(0, 0))) == set(), "a stream that never began is not there"


def test_range():
    stream = Stream(13)
    found = stream.found(5, change=lambda times, raw: raw + np.array([0.0, 0.0, 1.5, 0.0]))
    only(found, "range", 2, 0.1)


def test_an_encoder_at_the_end_of_its_range_may_read_the_sag_beyond_it():
    """Joint 2 of the default boom stretched out, if it turned upwards only: it sags to -0.92 degrees, and is no fault."""
    boom = YAML(typ="safe", pure=True).load(default_text())
    boom["joints"][1]["range_deg"], boom["postures"] = [0.0, 10.0], {"horizontal": [0, 0, 0, 0]}
    with pytest.warns(SceneWarning, match="expected at least 25 deg"):
        scene = load_scene(boom)
    low, high = sensor_ranges(scene, [None] * 4)[Channels.ANGLES]
    sag = statics(scene, "horizontal").joints[1]
    assert sag < -0.016 and low[1] < 2.0 * sag, "swinging it goes as far again"
    assert high[1] == pytest.approx(np.radians(15.0))
