"""Checks of a scene beyond single values."""
