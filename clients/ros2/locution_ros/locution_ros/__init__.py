"""A robot with ROS 2 as a client of a Locution server."""
