"""How the boom behaves: compiled numerics."""
