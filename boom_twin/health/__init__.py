"""Alarms: of sensors by themselves, and of channels that deviate from the prediction."""
