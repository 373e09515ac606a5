"""A bag through the twin."""
