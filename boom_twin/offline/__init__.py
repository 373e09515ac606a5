"""A recorded session through the twin."""
