"""The live page: what the twin says and how it is, for a browser. No ROS here; the feed from topics is in `boom_twin.ros`."""
