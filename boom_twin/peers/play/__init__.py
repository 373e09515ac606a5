"""A boom part on a cylinder whose rod pin has play: an independent model, by SciPy between touch and release."""
