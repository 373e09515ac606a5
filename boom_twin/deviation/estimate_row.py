"""Row of an estimate: what the filter writes of the tip at one instant, and where each quantity stands in it."""

WIDTH = 22
TIP, ACCELERATION, FORCE, TIP_COVARIANCE, ACCELERATION_COVARIANCE, FORCE_VARIANCE = 0, 3, 6, 8, 14, 20
"""First places in a row: x, y, angle of the tip (3); their second derivatives (3); load (2); covariances of the first two,
upper triangles by rows (6 each); variances of the load (2). SI."""
VARIANCES = [0, 3, 5]  # places of the variances in such a triangle
