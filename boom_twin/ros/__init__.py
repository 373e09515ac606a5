"""The live side: everything that needs rclpy, and the only place that imports it."""
