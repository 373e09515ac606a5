"""Interacting models (H. Blom and Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): mixing and weighing."""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .rows import clear
from .states import ALL_VALVES, BURST, OPEN, PREDICTION, VALVES

OPENS, CLOSES = 0.3, 1.0  # 1/s, rates at which valves open, and are closed again
COMES, STAYS = 0.2, 1.0  # 1/s, rates at which a load comes, and is usual again


@inner
def copy_model(f, source, target, size):
    """Copy state and covariance of a model."""
    for i in range(size):
        f.x[target, i] = f.x[source, i]
        for k in range(size):
            f.p[target, i, k] = f.p[source, i, k]


@inner
def models_of(mixture):
    """Return the first model of a mixture, and how many it has."""
    return (VALVES, ALL_VALVES - VALVES) if mixture == PREDICTION else (ALL_VALVES, 4)


@inner
def interact(f, mixture, size, h):
    """Mix the models of a mixture before a step of `h` (s): valves and load change independently of each other.

    Without a model of open valves under a new load, one in which all are open stands for it.
    """
    first, count = models_of(mixture)
    switch = f.switch
    for source in range(count):
        clear(switch[source], count)
        turns = 1.0 - math.exp(-(CLOSES if source % 2 == OPEN else OPENS) * h)
        changes = 1.0 - math.exp(-(STAYS if source >= BURST else COMES) * h)
        for target in range(4):
            valves = 1.0 - turns if source % 2 == target % 2 else turns
            load = 1.0 - changes if source // 2 == target // 2 else changes
            switch[source, target if target < count else OPEN] += valves * load
    for target in range(count):
        new = 0.0
        for source in range(count):
            new += f.chances[first + source] * switch[source, target]
        f.likely[target] = new
        mean, spread = f.mixed_x[target], f.mixed_p[target]
        clear(mean, size)
        for i in range(size):
            clear(spread[i], size)
        for source in range(count):
            add_mean(f, first + source, f.chances[first + source] * switch[source, target] / new, mean, size)
        for source in range(count):
            share = f.chances[first + source] * switch[source, target] / new
            add_spread(f, first + source, share, mean, spread, size)
    for target in range(count):
        f.chances[first + target] = f.likely[target]
        for i in range(size):
            f.x[first + target, i] = f.mixed_x[target, i]
            for k in range(size):
                f.p[first + target, i, k] = f.mixed_p[target, i, k]


@inner
def add_mean(f, model, share, mean, size):
    """Add a share of a model's state to a mean."""
    for i in range(size):
        mean[i] += share * f.x[model, i]


@inner
def add_spread(f, model, share, mean, spread, size):
    """Add a share of a model's covariance, and of its state's spread about the mean, to a covariance."""
    if share < 1e-12:
        return
    for i in range(size):
        apart = share * (f.x[model, i] - mean[i])
        for k in range(size):
            spread[i, k] += share * f.p[model, i, k] + apart * (f.x[model, k] - mean[k])


@inner
def mix(f, mixture, size):
    """Write mean and covariance of a mixture."""
    first, count = models_of(mixture)
    mean, spread = f.mean[mixture], f.spread[mixture]
    clear(mean, size)
    for i in range(size):
        clear(spread[i], size)
    for k in range(count):
        add_mean(f, first + k, f.chances[first + k], mean, size)
    for k in range(count):
        add_spread(f, first + k, f.chances[first + k], mean, spread, size)


@inner
def weigh_models(f, mixture):
    """Update the probabilities of a mixture's models by their likelihoods; return the log likelihood of the mixture."""
    first, count = models_of(mixture)
    most, total = f.likely[first], 0.0
    for k in range(1, count):
        most = max(most, f.likely[first + k])
    for k in range(count):
        f.chances[first + k] = max(f.chances[first + k] * math.exp(f.likely[first + k] - most), 1e-9)
        total += f.chances[first + k]
    for k in range(count):
        f.chances[first + k] /= total
    return most + math.log(total)
