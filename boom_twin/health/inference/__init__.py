"""Inference of faults from residuals: sensitivities, whitening filter, hypothesis test."""
