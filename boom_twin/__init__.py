"""A digital twin of a concrete placing boom by the transfer-matrix method."""

__version__ = "0.1.0"
