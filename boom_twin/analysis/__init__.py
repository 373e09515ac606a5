"""Statics, modes, simulation and batches of a compiled boom."""
