"""Independent models of the same boom to compare with. None of them uses an equation of the twin."""
