"""Session bags: reading, writing, inspecting and recovering rosbag2 directories of MCAP files."""
