"""Reduced models: what can be left out of a scene, and what that costs."""
