"""The twin: `Twin.update(sample)` gives a `Report`. No ROS, no files, no clock."""
