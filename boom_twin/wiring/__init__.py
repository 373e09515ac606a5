"""Commissioning check: which name, unit, sign, zero and mount every sensor of a rig has, told from its readings."""
