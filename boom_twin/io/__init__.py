"""To and from messages and bags; reads message objects of rclpy and of rosbags alike, imports no rclpy."""
