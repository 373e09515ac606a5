"""Replay of recorded sessions through the twin."""
