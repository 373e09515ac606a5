"""What healthy deviations of the parameters explain of the innovations: Bayesian regression, block by block."""

from __future__ import annotations

import numpy as np

from ..records import Array

GATE = 4.5  # deviations
STRAYED = 5.0  # deviations of the prior
LEAST = 1e-3  # of the prior's variance, what must have been learnt for that


class Regression:
    """Parameters that are constant in time, normal before anything is measured; what is measured narrows them.

    Mean and covariance are never changed, but replaced: what was known at a time may be kept.

    Parameters
    ----------
    mean : ndarray, shape (parameters,)
    covariance : ndarray, shape (parameters, parameters)
        Of healthy parameters.
    """

    def __init__(self, mean: Array, covariance: Array) -> None:
        self._prior = mean, covariance
        self.restart()

    def restart(self) -> None:
        """Know no more than before anything was measured."""
        self.mean, self.covariance = self._prior

    @property
    def has_strayed(self) -> bool:
        """Whether what was learnt bit by bit is, all together, more than healthy parameters may be off by."""
        mean, covariance = self._prior
        learnt = np.diag(covariance) - np.diag(self.covariance)
        return bool(np.any((self.mean - mean) ** 2 > STRAYED**2 * np.maximum(learnt, LEAST * np.diag(covariance))))

    def take(self, white: Array, learn: bool) -> tuple[Array, float]:
        """Narrow by whitened innovations, shape (rows, 1 + parameters), what is known.

        Parameters
        ----------
        white : ndarray
            Of one block.
        learn : bool
            False leaves everything as it is. A block with something left beyond `GATE`, which no healthy deviation explains, is
            never learnt from.

        Returns
        -------
        left : ndarray, shape (rows,)
            What is left, of unit variance each.
        spread : float
            Logarithm of the deviations that it had, in all.
        """
        signature = white[:, 1:]
        gain = signature @ self.covariance
        root = np.linalg.cholesky(gain @ signature.T + np.eye(len(white)))
        step = np.linalg.solve(root, np.column_stack([white[:, 0] - signature @ self.mean, gain]))
        left = step[:, 0]
        if learn and np.abs(left).max() < GATE:
            self.mean = self.mean + step[:, 1:].T @ left
            self.covariance = self.covariance - step[:, 1:].T @ step[:, 1:]
        return left, float(np.log(np.diag(root)).sum())
