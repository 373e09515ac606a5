"""From a scene to a compiled boom: where every number sits in memory."""
