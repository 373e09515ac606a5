"""The live node: parameters, services, diagnostics."""
