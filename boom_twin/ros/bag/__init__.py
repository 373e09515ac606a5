"""Recording and playing bags over ROS."""
