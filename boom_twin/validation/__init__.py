"""Checks of the twin: virtual rig, studies."""
