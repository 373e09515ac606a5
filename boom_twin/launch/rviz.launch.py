"""RViz alone, for a twin that runs elsewhere.

ros2 launch boom_twin rviz.launch.py
ros2 launch boom_twin rviz.launch.py namespace:=front frame_prefix:=front/
"""

import atexit
from pathlib import Path
from tempfile import TemporaryDirectory

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from boom_twin.messages.urdf import RVIZ, view_text

ARGUMENTS = [
    DeclareLaunchArgument("rviz_config", default_value=str(RVIZ), description="what RViz shows"),
    DeclareLaunchArgument("namespace", default_value="", description="of the twin"),
    DeclareLaunchArgument("frame_prefix", default_value="", description="before the name of every frame: front/"),
    DeclareLaunchArgument(
        "use_sim_time",
        default_value="false",
        choices=("true", "false"),
        description="time from /clock instead of the machine's",
    ),
]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments above and RViz."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=rviz)])


def rviz(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return RViz in the twin's namespace, to which its topics are relative. A copy of its file has the frame prefix."""
    given = {each.name: LaunchConfiguration(each.name).perform(context) for each in ARGUMENTS}
    folder = TemporaryDirectory(prefix="boom_twin_")
    atexit.register(folder.cleanup)
    config = Path(folder.name) / "boom_twin.rviz"
    shown = Path(given["rviz_config"]).read_text(encoding="utf-8")
    config.write_text(view_text(shown, given["namespace"], given["frame_prefix"]), encoding="utf-8")
    node = Node(
        package="rviz2",
        executable="rviz2",
        namespace=given["namespace"],
        arguments=["-d", str(config)],
        parameters=[{"use_sim_time": given["use_sim_time"] == "true"}],
    )
    return [node]
