"""How often a live sensor may repeat a reading before it is taken for frozen."""

from __future__ import annotations

import math


def readings_of_frozen(sigma: float, resolution: float, false_alarm: float) -> float:
    """Equal readings in a row that white noise gives with a probability below `false_alarm`.

    Noise of standard deviation s, read out in steps of q, repeats a reading with a probability of at most

        p = erf(q / (2 sqrt(2) s)),

    reached by a sensor that stands still in the middle of a step; N equal readings have p^(N - 1). A sensor that is coarse
    against its noise needs many (q = 7 s: 4e4; q = 10 s: 4e7, for a probability of 1e-9); one without noise cannot be told
    from a frozen one.

    Parameters
    ----------
    sigma, resolution : float
        Of the sensor, in its unit; the rule is as good as these. A sensor that is filtered repeats more often.
    false_alarm : float
        Probability for each reading.

    Returns
    -------
    float
        N >= 2; infinite without noise.
    """
    if sigma == 0.0:
        return math.inf
    missed = math.erfc(resolution / (2.0 * math.sqrt(2.0) * sigma))
    if missed == 0.0:
        return math.inf
    return 2.0 if missed == 1.0 else max(2.0, 1.0 + math.ceil(math.log(false_alarm) / math.log1p(-missed)))
