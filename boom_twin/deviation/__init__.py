"""How a boom deviates from static equilibrium: linearisation at a posture and the Kalman filters of prediction and estimate."""
