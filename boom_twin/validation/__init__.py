"""What the twin is checked against: virtual rig, reference models, studies."""
