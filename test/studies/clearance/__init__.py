"""Effects, convergence and cost of clearance."""
