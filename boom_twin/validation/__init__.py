"""Checks of the twin: virtual rig, reference models, studies."""
