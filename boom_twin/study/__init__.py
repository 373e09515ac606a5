"""Comparisons of methods and models on a scene, written as JSON, tables and pictures (`boom_twin study`)."""
