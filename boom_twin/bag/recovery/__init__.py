"""Recovery of damaged MCAP files."""
