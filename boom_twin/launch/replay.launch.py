"""A recorded session played into the live twin, on the session's clock.

ros2 launch boom_twin replay.launch.py bag:=bags/arch_session rate:=2.0
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription, Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir

from boom_twin.child_process import python_command

ARGUMENTS = [
    DeclareLaunchArgument("bag", description="session to play: rosbag2 directory or .mcap file"),
    DeclareLaunchArgument("rate", default_value="1.0", description="session time over real time"),
    DeclareLaunchArgument("start", default_value="0.0", description="begin so many seconds into the session"),
    DeclareLaunchArgument("wait", default_value="120.0", description="seconds to wait for the node; the first start compiles"),
    DeclareLaunchArgument("scene", default_value="", description="scene file of the boom; empty: the default scene"),
    DeclareLaunchArgument("rviz", default_value="true", description="start RViz"),
]


def generate_launch_description() -> LaunchDescription:
    """The arguments above, the twin on simulated time, and the player; all ends with the session."""
    return LaunchDescription([*ARGUMENTS, twin(), player()])


def twin() -> IncludeLaunchDescription:
    """``twin.launch.py`` on the session's clock."""
    passed = [(name, LaunchConfiguration(name)) for name in ("scene", "rviz")]
    source = PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/twin.launch.py"])
    return IncludeLaunchDescription(source, launch_arguments=[*passed, ("use_sim_time", "true")])


def player() -> ExecuteProcess:
    """The session's inputs and its clock, once the node listens."""
    options = [part for name in ("rate", "start", "wait") for part in (f"--{name}", LaunchConfiguration(name))]
    command = [*python_command("boom_twin.cli.main", "play"), LaunchConfiguration("bag"), "--clock", *options]
    return ExecuteProcess(cmd=command, name="play", output="screen", on_exit=Shutdown(reason="the session has been played"))
