"""ROS messages without ROS: CDR in and out, topics, sensor mapping, URDF."""
