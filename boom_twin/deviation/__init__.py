"""Deviation of a boom from static equilibrium: linearisation at a posture, Kalman filters of prediction and estimate."""
