"""What residuals mean: detection, inference, alarms."""
