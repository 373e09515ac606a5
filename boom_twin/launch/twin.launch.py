"""The twin beside a rig: node, TF of the boom, on request RViz and a recording.

ros2 launch boom_twin twin.launch.py scene:=my_boom.yaml rviz:=true record:=sessions/first
"""

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from boom_twin.messages.urdf import urdf
from boom_twin.scene import load_scene
from boom_twin.system.child_process import python_command

CONFIG = PathJoinSubstitution([FindPackageShare("boom_twin"), "msg_config"])
ARGUMENTS = [
    DeclareLaunchArgument("scene", default_value="", description="scene file of the boom; empty: the default scene"),
    DeclareLaunchArgument(
        "params_file",
        default_value=PathJoinSubstitution([CONFIG, "twin.yaml"]),
        description="parameters of the node; `scene` above wins",
    ),
    DeclareLaunchArgument("mapping", default_value="", description="names and units of the rig's own sensors; empty: as usual"),
    DeclareLaunchArgument("namespace", default_value="", description="of the node and of all its topics, for several booms"),
    DeclareLaunchArgument("use_sim_time", default_value="false", description="time from /clock instead of the machine's"),
    DeclareLaunchArgument("rviz", default_value="false", description="start RViz"),
    DeclareLaunchArgument(
        "rviz_config", default_value=PathJoinSubstitution([CONFIG, "boom_twin.rviz"]), description="what RViz shows"
    ),
    DeclareLaunchArgument("record", default_value="", description="new folder to record the session into; empty: none"),
]


def generate_launch_description() -> LaunchDescription:
    """The arguments above, and what they start."""
    return LaunchDescription(
        [*ARGUMENTS, twin(), OpaqueFunction(function=state_publisher), rviz(), OpaqueFunction(function=recorder)]
    )


def twin() -> Node:
    """The node; it configures and activates itself."""
    own = {
        "scene": ParameterValue(LaunchConfiguration("scene"), value_type=str),
        "mapping": ParameterValue(LaunchConfiguration("mapping"), value_type=str),
        "use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool),
    }
    return Node(
        package="boom_twin",
        executable="twin_node",
        name="boom_twin",
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[LaunchConfiguration("params_file"), own],
    )


def state_publisher(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """TF of the undeflected boom, driven by the twin's joint states."""
    scene = LaunchConfiguration("scene").perform(context)
    description = ParameterValue(urdf(load_scene(scene or None)), value_type=str)
    sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=LaunchConfiguration("namespace"),
            parameters=[{"robot_description": description, "use_sim_time": sim_time}],
            remappings=[("joint_states", "boom_twin/joint_states")],
        )
    ]


def rviz() -> Node:
    """RViz, if it is asked for."""
    return Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", LaunchConfiguration("rviz_config")],
        parameters=[{"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )


def recorder(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """The recorder, if a folder is given; beside the node, with all that the node is given."""
    given = {
        "--out": LaunchConfiguration("record").perform(context),
        "--scene": LaunchConfiguration("scene").perform(context),
        "--params": LaunchConfiguration("params_file").perform(context),
        "--mapping": LaunchConfiguration("mapping").perform(context),
    }
    namespace = LaunchConfiguration("namespace").perform(context).strip("/")
    command = python_command("boom_twin.cli.main", "record")
    command += [part for option, value in given.items() if value for part in (option, value)]
    command += ["--ros-args", "-r", f"__ns:=/{namespace}"] if namespace else []
    return [ExecuteProcess(cmd=command, name="record", output="screen")] if given["--out"] else []
