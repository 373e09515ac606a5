"""The twin beside a rig: node, TF of the boom, on request live page, RViz and a recording.

ros2 launch boom_twin twin.launch.py scene:=my_boom.yaml rviz:=true record:=sessions/first
ros2 launch boom_twin twin.launch.py state_publisher:=false monitor:=true                    # without ROS's C++ packages
ros2 launch boom_twin twin.launch.py namespace:=front frame_prefix:=front/                   # one of several booms
"""

from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription, OpaqueFunction, Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from boom_twin.config.settings import DEFAULT_FILE, read_parameters
from boom_twin.errors import BoomTwinError
from boom_twin.messages.mapping import load_mapping
from boom_twin.messages.urdf import urdf
from boom_twin.messages.view_files import RVIZ
from boom_twin.scene import Scene, load_scene
from boom_twin.system.child_process import python_command
from boom_twin.system.result_folder import check_lasting

FLAG = ("true", "false")
ARGUMENTS = [
    DeclareLaunchArgument("scene", default_value="", description="scene file of the boom; empty: the default scene"),
    DeclareLaunchArgument(
        "params_file", default_value=str(DEFAULT_FILE), description="parameters of the node; the arguments here win"
    ),
    DeclareLaunchArgument("mapping", default_value="", description="names and units of the rig's own sensors; empty: as usual"),
    DeclareLaunchArgument("namespace", default_value="", description="of all nodes and topics, for several booms"),
    DeclareLaunchArgument("frame_prefix", default_value="", description="before the name of every frame: front/"),
    DeclareLaunchArgument(
        "use_sim_time", default_value="false", choices=FLAG, description="time from /clock instead of the machine's"
    ),
    DeclareLaunchArgument("state_publisher", default_value="true", choices=FLAG, description="start robot_state_publisher: TF"),
    DeclareLaunchArgument(
        "ignore_timestamp", default_value="false", choices=FLAG, description="TF of stamps that were there before, too"
    ),
    DeclareLaunchArgument("monitor", default_value="false", choices=FLAG, description="the live page beside the node"),
    DeclareLaunchArgument("rviz", default_value="false", choices=FLAG, description="start RViz"),
    DeclareLaunchArgument("rviz_config", default_value=str(RVIZ), description="what RViz shows"),
    DeclareLaunchArgument("record", default_value="", description="new folder to record the session into; empty: none"),
]
Given = dict[str, str]


def generate_launch_description() -> LaunchDescription:
    """The arguments above, and what they start."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=everything)])


def everything(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """All that is asked for; what cannot be found or used is told before anything starts."""
    given = {each.name: LaunchConfiguration(each.name).perform(context) for each in ARGUMENTS}
    check_packages(given)
    scene = load_scene(given["scene"] or None)
    load_mapping(path(given["mapping"]), len(scene.joints))
    read_parameters(Path(given["params_file"]))
    found: list[LaunchDescriptionEntity] = [twin(given)]
    if is_set(given, "state_publisher"):
        found.append(state_publisher(given, scene))
    if is_set(given, "rviz"):
        Path(given["rviz_config"]).read_bytes()
        found.append(rviz(given))
    if given["record"]:
        found.append(recorder(given))
    return found


def check_packages(given: Given) -> None:
    """Raise BoomTwinError if a package is missing that something asked for is in."""
    needed = {"boom_twin": "source install/setup.bash of its workspace"}
    for name, package in (("state_publisher", "robot_state_publisher"), ("rviz", "rviz2")):
        if is_set(given, name):
            needed[package] = f"install it, or say {name}:=false"
    for package, remedy in needed.items():
        try:
            get_package_prefix(package)
        except PackageNotFoundError:
            raise BoomTwinError(f"package {package} is not in AMENT_PREFIX_PATH: {remedy}") from None


def path(text: str) -> Path | None:
    """Of an argument that may be empty."""
    return Path(text) if text else None


def is_set(given: Given, name: str) -> bool:
    """Whether a flag is true."""
    return given[name] == "true"


def twin(given: Given) -> Node:
    """The node; it configures and activates itself. Without it nothing else goes on."""
    own = {name: ParameterValue(given[name], value_type=str) for name in ("scene", "mapping", "frame_prefix")}
    own |= {name: is_set(given, name) for name in ("monitor", "use_sim_time")}
    return Node(
        package="boom_twin",
        executable="twin_node",
        name="boom_twin",
        namespace=given["namespace"],
        output="screen",
        parameters=[given["params_file"], own],
        on_exit=Shutdown(reason="the twin has ended"),
    )


def state_publisher(given: Given, scene: Scene) -> Node:
    """TF up to the deflected tip, driven by the twin's joint states."""
    texts = {"frame_prefix": given["frame_prefix"], "robot_description": urdf(scene)}
    own = {name: ParameterValue(text, value_type=str) for name, text in texts.items()}
    own |= {name: is_set(given, name) for name in ("ignore_timestamp", "use_sim_time")}
    return Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=given["namespace"],
        parameters=[own],
        remappings=[("joint_states", "boom_twin/joint_states")],
    )


def rviz(given: Given) -> IncludeLaunchDescription:
    """RViz, as ``rviz.launch.py`` starts it."""
    source = PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/rviz.launch.py"])
    names = ("rviz_config", "namespace", "frame_prefix", "use_sim_time")
    return IncludeLaunchDescription(source, launch_arguments=[(name, given[name]) for name in names])


def recorder(given: Given) -> ExecuteProcess:
    """The recorder beside the node, with all that the node is given."""
    check_lasting(Path(given["record"]))
    options = {
        "--out": given["record"],
        "--scene": given["scene"],
        "--params": given["params_file"],
        "--mapping": given["mapping"],
        "--namespace": given["namespace"],
    }
    command = python_command("boom_twin.cli.main", "record")
    command += [part for option, value in options.items() if value for part in (option, value)]
    return ExecuteProcess(cmd=command, name="record", output="screen")
