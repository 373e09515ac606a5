"""Commissioning check: identify name, unit, sign, zero and mount of every sensor of a rig from readings."""
