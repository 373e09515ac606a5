"""Row of an estimate: what the filter writes of the tip and of the modes at one instant, and where each quantity stands."""

MODES = 6  # natural modes that a row has room for; NaN where the boom has fewer below `boom_twin.deviation.predictor.HIGHEST`
WIDTH = 43
TIP, VELOCITY, ACCELERATION, FORCE, COORDINATES, RATES = 0, 3, 6, 9, 11, 17
"""First places in a row: x, y, angle of the tip (3); their first (3) and second derivatives (3); load (2); modal coordinates
(6) and their rates (6). SI; modal mass 1 kg."""
TIP_COVARIANCE, VELOCITY_COVARIANCE, ACCELERATION_COVARIANCE, FORCE_VARIANCE = 23, 29, 35, 41
"""First places of covariances, upper triangles by rows (6 each); variances of the load (2)."""
VARIANCES = [0, 3, 5]  # places of the variances in such a triangle
