"""Elements: beam, rigid body, cylinder, linkage, pin contact."""
