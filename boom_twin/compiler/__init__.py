"""Compiler from a scene to a boom: the place of every number in memory."""
