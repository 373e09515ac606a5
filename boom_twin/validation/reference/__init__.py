"""Independent models of the same boom; none uses an equation of the twin."""
