"""Compiled numerics of the boom's mechanics."""
