"""Starts the node: ros2 launch locution_ros locution.launch.py site:=office url:=http://server:7070."""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Site, address and robot as arguments, the rest from the parameter file."""
    usual = PathJoinSubstitution([FindPackageShare("locution_ros"), "config", "locution.yaml"])
    arguments = [
        DeclareLaunchArgument("url", default_value="http://127.0.0.1:7070", description="the server"),
        DeclareLaunchArgument("site", description="the building"),
        DeclareLaunchArgument("robot", default_value="robot", description="name of the robot"),
        DeclareLaunchArgument("params_file", default_value=usual, description="all other parameters"),
    ]
    said = {name: LaunchConfiguration(name) for name in ("url", "site", "robot")}
    node = Node(
        package="locution_ros",
        executable="locution",
        name="locution",
        output="screen",
        parameters=[LaunchConfiguration("params_file"), said],
    )
    return LaunchDescription([*arguments, node])
