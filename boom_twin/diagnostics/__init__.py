"""Statuses for ``/diagnostics`` (REP-107), without ROS."""
