"""Alarms about single sensors, about channels that deviate from the prediction, and about faults of the boom."""
