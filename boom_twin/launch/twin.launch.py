"""The twin beside a rig: node, TF of the boom, on request live page, RViz and a recording.

ros2 launch boom_twin twin.launch.py scene:=my_boom.yaml rviz:=true record:=sessions/first
ros2 launch boom_twin twin.launch.py state_publisher:=false monitor:=true                    # without ROS's C++ packages
ros2 launch boom_twin twin.launch.py namespace:=front frame_prefix:=front/                   # one of several booms
"""

import atexit
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from boom_twin.config.settings import DEFAULT_FILE, read_parameters
from boom_twin.errors import BoomTwinError
from boom_twin.messages.mapping import load_mapping
from boom_twin.messages.urdf import RVIZ, urdf, view_text
from boom_twin.scene import Scene, load_scene
from boom_twin.system.processes import python_command

FLAG = ("true", "false")
FLAG_OR_FILE = (*FLAG, "")
PARAMETERS = {"scene": "", "mapping": "", "frame_prefix": "", "monitor": False, "use_sim_time": False}
"""The node's parameters that are arguments here, with the defaults that hold where `params_file` has none."""
ARGUMENTS = [
    DeclareLaunchArgument("params_file", default_value=str(DEFAULT_FILE), description="parameters of the node"),
    DeclareLaunchArgument(
        "scene", default_value="", description="scene file of the boom; empty: of params_file, or the default"
    ),
    DeclareLaunchArgument("mapping", default_value="", description="names and units of the sensors; empty: of params_file"),
    DeclareLaunchArgument("namespace", default_value="", description="of all nodes and topics, for several booms"),
    DeclareLaunchArgument("frame_prefix", default_value="", description="before every frame: front/; empty: of params_file"),
    DeclareLaunchArgument(
        "use_sim_time", default_value="", choices=FLAG_OR_FILE, description="time from /clock; empty: as in params_file"
    ),
    DeclareLaunchArgument("state_publisher", default_value="true", choices=FLAG, description="start robot_state_publisher: TF"),
    DeclareLaunchArgument(
        "ignore_timestamp", default_value="false", choices=FLAG, description="TF of stamps that were there before, too"
    ),
    DeclareLaunchArgument(
        "monitor", default_value="", choices=FLAG_OR_FILE, description="the live page beside the node; empty: as in params_file"
    ),
    DeclareLaunchArgument("rviz", default_value="false", choices=FLAG, description="start RViz"),
    DeclareLaunchArgument("rviz_config", default_value=str(RVIZ), description="what RViz shows"),
    DeclareLaunchArgument("record", default_value="", description="new folder to record the session into; empty: none"),
]
Given = dict[str, str]
Values = dict[str, Any]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments above and the actions that they start."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=everything)])


def everything(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return all requested actions. Raise an error for a missing package or an invalid file before anything starts."""
    given = {each.name: LaunchConfiguration(each.name).perform(context) for each in ARGUMENTS}
    check_packages(given)
    values = parameters(given)
    scene = load_scene(values["scene"] or None)
    load_mapping(Path(values["mapping"]) if values["mapping"] else None, len(scene.joints))
    found: list[LaunchDescriptionEntity] = [twin(given, values)]
    if given["state_publisher"] == "true":
        found.append(state_publisher(given, values, scene))
    if given["rviz"] == "true":
        found.append(rviz(given, values))
    if given["record"]:
        found.append(recorder(given, values))
    return found


def parameters(given: Given) -> Values:
    """Return the node's parameters: arguments that are given, else those of the file, else the defaults.

    The node gets one set of parameters, because a name with wildcards in the file could win over an argument.
    """
    values = PARAMETERS | read_parameters(Path(given["params_file"]), given["namespace"])
    for name in filter(given.get, PARAMETERS):
        values[name] = given[name] == "true" if name in ("monitor", "use_sim_time") else given[name]
    return values


def check_packages(given: Given) -> None:
    """Raise BoomTwinError if the package of a requested action is missing."""
    needed = {"boom_twin": "source install/setup.bash of its workspace"}
    for name, package in (("state_publisher", "robot_state_publisher"), ("rviz", "rviz2")):
        if given[name] == "true":
            needed[package] = f"install it, or say {name}:=false"
    for package, remedy in needed.items():
        try:
            get_package_prefix(package)
        except PackageNotFoundError:
            raise BoomTwinError(f"package {package} is not in AMENT_PREFIX_PATH: {remedy}") from None


def as_launched(values: Values) -> Values:
    """Return parameters with texts marked as such, because launch would read a text as YAML."""
    return {name: ParameterValue(value, value_type=str) if isinstance(value, str) else value for name, value in values.items()}


def twin(given: Given, values: Values) -> Node:
    """Return the node, which configures and activates itself. The launch ends when the node ends."""
    return Node(
        package="boom_twin",
        executable="twin_node",
        name="boom_twin",
        namespace=given["namespace"],
        output="screen",
        parameters=[as_launched(values)],
        on_exit=Shutdown(reason="the twin has ended"),
    )


def state_publisher(given: Given, values: Values, scene: Scene) -> Node:
    """Return ``robot_state_publisher``, which sends TF up to the deflected tip from the twin's joint states."""
    own = {name: values[name] for name in ("frame_prefix", "use_sim_time")}
    own |= {"robot_description": urdf(scene), "ignore_timestamp": given["ignore_timestamp"] == "true"}
    return Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=given["namespace"],
        parameters=[as_launched(own)],
        remappings=[("joint_states", "boom_twin/joint_states")],
    )


def rviz(given: Given, values: Values) -> Node:
    """Return RViz in the twin's namespace, to which its topics are relative. A copy of its file has the frame prefix."""
    folder = TemporaryDirectory(prefix="boom_twin_")
    atexit.register(folder.cleanup)
    config = Path(folder.name) / "boom_twin.rviz"
    shown = Path(given["rviz_config"]).read_text(encoding="utf-8")
    config.write_text(view_text(shown, given["namespace"], values["frame_prefix"]), encoding="utf-8")
    return Node(
        package="rviz2",
        executable="rviz2",
        namespace=given["namespace"],
        arguments=["-d", str(config)],
        parameters=[{"use_sim_time": values["use_sim_time"]}],
    )


def recorder(given: Given, values: Values) -> ExecuteProcess:
    """Return the recorder beside the node, with the node's scene, parameters, mapping and namespace."""
    options = {"--out": given["record"], "--scene": given["scene"], "--params": given["params_file"]}
    options |= {"--mapping": values["mapping"], "--namespace": given["namespace"]}
    command = python_command("boom_twin.cli.main", "record")
    command += [part for option, value in options.items() if value for part in (option, value)]
    return ExecuteProcess(cmd=command, name="record", output="screen")
