"""RViz alone, for a twin that runs elsewhere.

ros2 launch boom_twin rviz.launch.py
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

CONFIG = PathJoinSubstitution([FindPackageShare("boom_twin"), "msg_config", "boom_twin.rviz"])
ARGUMENTS = [
    DeclareLaunchArgument("rviz_config", default_value=CONFIG, description="what RViz shows"),
    DeclareLaunchArgument("use_sim_time", default_value="false", description="time from /clock instead of the machine's"),
]


def generate_launch_description() -> LaunchDescription:
    """The arguments above, and RViz."""
    sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", LaunchConfiguration("rviz_config")],
        parameters=[{"use_sim_time": sim_time}],
    )
    return LaunchDescription([*ARGUMENTS, rviz])
