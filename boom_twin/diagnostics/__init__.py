"""States for ``/diagnostics`` (REP-107), judged without ROS."""
