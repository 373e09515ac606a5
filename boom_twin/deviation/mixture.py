"""Interacting models (H. Blom and Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): mixing and weighing."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .states import ALL_VALVES, BURST, ESTIMATE, IS_OLD, OPEN, PREDICTION, VALVES, all_states, whole

MODELS = BURST + 1  # of a mixture
LEAST_CHANCE = 1e-60  # of a model, so that none is 0: the rates let it grow again, but for a load while a valve is open
OPENS, CLOSES = 0.3, 1.0  # 1/s, rates at which valves open, and are closed again
MEMORY = 0.1  # s, in which valves that opened are remembered, see `interact`
COMES, STAYS = 0.2, 1.0  # 1/s, rates at which a load comes while all valves are closed, and is usual again


@inner
def copy_model(f, source, target, size):
    """Copy state and covariance of a model."""
    for i in range(size):
        f.x[target, i] = f.x[source, i]
        for k in range(size):
            f.p[target, i, k] = f.p[source, i, k]


@inner
def first_model(mixture):
    """Return the first of the `MODELS` of a mixture."""
    return VALVES if mixture == PREDICTION else ALL_VALVES


@inner
def interact(f, mixture, size, h, memory):
    """Mix the models of a mixture before a step of `h` (s), by the rates at which valves and load change.

    No sudden load is expected while a valve is open: another that opens explains the same lengths, and is far likelier.

    That a valve has opened shows only after some tenths of a second. Until then the models of closed valves take the motion
    for a load. So the model of open valves stands for all openings within `memory` (s) and keeps the state of the earliest: of
    the state of closed valves it takes a share of h / `memory` at most.
    """
    first, switch, coming = first_model(mixture), f.switch, COMES
    for i in range(f.is_open.shape[1]):
        if f.is_open[mixture, i] == 1:
            coming = 0.0
    opens, closes = 1.0 - math.exp(-OPENS * h), 1.0 - math.exp(-CLOSES * h)
    comes, stays = 1.0 - math.exp(-coming * h), 1.0 - math.exp(-STAYS * h)
    switch[VALVES, VALVES], switch[VALVES, OPEN], switch[VALVES, BURST] = 1.0 - opens - comes, opens, comes
    switch[OPEN, VALVES], switch[OPEN, OPEN], switch[OPEN, BURST] = closes, 1.0 - closes, 0.0
    switch[BURST, VALVES], switch[BURST, OPEN], switch[BURST, BURST] = stays, opens, 1.0 - stays - opens
    for target in range(MODELS):
        f.likely[target] = 0.0
        for source in range(MODELS):
            f.likely[target] += f.chances[first + source] * switch[source, target]
        for source in range(MODELS):
            f.shares[target, source] = f.chances[first + source] * switch[source, target] / f.likely[target]
    kept = min(h / max(memory * (1.0 - f.shares[OPEN, OPEN]), 1e-300), 1.0)
    f.shares[OPEN, VALVES] *= kept
    f.shares[OPEN, BURST] *= kept
    f.shares[OPEN, OPEN] = 1.0 - f.shares[OPEN, VALVES] - f.shares[OPEN, BURST]
    two, three = apart(f, first, size)
    one, other, last, shares, width = f.p[first], f.p[first + 1], f.p[first + 2], f.shares, whole(size)
    for i in range(size):
        by_one, by_two, by_three = one[i], other[i], last[i]
        a, b = between(shares[0], two[i], three[i])
        c, d = between(shares[1], two[i], three[i])
        e, g = between(shares[2], two[i], three[i])
        for k in range(width):
            x, y, z, second, third = by_one[k], by_two[k], by_three[k], two[k], three[k]
            by_one[k] = shares[0, 0] * x + shares[0, 1] * y + shares[0, 2] * z + (a * second + b * third)
            by_two[k] = shares[1, 0] * x + shares[1, 1] * y + shares[1, 2] * z + (c * second + d * third)
            by_three[k] = shares[2, 0] * x + shares[2, 1] * y + shares[2, 2] * z + (e * second + g * third)
    for target in range(MODELS):
        f.chances[first + target] = f.likely[target]
    for i in range(size):
        mean = f.x[first, i]
        for target in range(MODELS):
            f.x[first + target, i] = mean + shares[target, 1] * two[i] + shares[target, 2] * three[i]


@inner
def apart(f, first, size):
    """Write the states of the second and of the third model of a mixture less that of the first; return these."""
    two, three = f.rows[0], f.rows[1]
    for i in range(whole(size)):
        two[i], three[i] = f.x[first + 1, i] - f.x[first, i], f.x[first + 2, i] - f.x[first, i]
    return two, three


@inner
def between(shares, two, three):
    """Return the weights of both of `apart` in the row of the covariance among the models' means whose state they have there.

    With d_0 = 0, the covariance sum w d d^T - (sum w d) (sum w d)^T has these rows.
    """
    return (
        shares[1] * ((1.0 - shares[1]) * two - shares[2] * three),
        shares[2] * ((1.0 - shares[2]) * three - shares[1] * two),
    )


@inner
def mix_means(f, mixture, size):
    """Write the mean of a mixture; return what `apart` does."""
    first, mean = first_model(mixture), f.mean[mixture]
    two, three = apart(f, first, size)
    for i in range(size):
        mean[i] = f.x[first, i] + f.chances[first + 1] * two[i] + f.chances[first + 2] * three[i]
    return two, three


@kernel
def mix(f, mixture, size):
    """Write mean and covariance of a mixture."""
    two, three = mix_means(f, mixture, size)
    f.status[IS_OLD] *= mixture != ESTIMATE
    first, spread, width = first_model(mixture), f.spread[mixture], whole(size)
    shares = f.chances[first : first + MODELS]
    for i in range(size):
        to_two, to_three = between(shares, two[i], three[i])
        line, by_one, by_two, by_three = spread[i], f.p[first, i], f.p[first + 1, i], f.p[first + 2, i]
        for k in range(width):
            line[k] = (
                shares[0] * by_one[k] + shares[1] * by_two[k] + shares[2] * by_three[k] + to_two * two[k] + to_three * three[k]
            )


@inner
def renew_estimate(p, f):
    """Write the covariance of the estimate if readings have corrected its models since."""
    if f.status[IS_OLD] == 1:
        mix(f, ESTIMATE, all_states(p))


@inner
def weigh_models(f, mixture):
    """Update the probabilities of a mixture's models by their likelihoods; return the log likelihood of the mixture."""
    first = first_model(mixture)
    most, total = f.likely[first], 0.0
    for k in range(1, MODELS):
        most = max(most, f.likely[first + k])
    for k in range(MODELS):
        f.chances[first + k] = max(f.chances[first + k] * math.exp(f.likely[first + k] - most), LEAST_CHANCE)
        total += f.chances[first + k]
    for k in range(MODELS):
        f.chances[first + k] /= total
    return most + math.log(total)
