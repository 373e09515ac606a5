"""YAML text and settings."""
