"""The virtual rig's boom in Exudyn."""
