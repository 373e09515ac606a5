"""The transfer-matrix method: sweeps, substructures, time step."""
