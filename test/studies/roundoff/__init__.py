"""Exact solution of one time step: the reference for digits lost to round-off."""
