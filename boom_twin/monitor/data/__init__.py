"""Data of the live page: feeds, tables, status, spectrum."""
