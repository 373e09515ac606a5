"""A recorded session played into the live twin, on the session's clock.

ros2 launch boom_twin replay.launch.py bag:=bags/arch_session rate:=2.0
"""

import atexit
from pathlib import Path
from tempfile import TemporaryDirectory

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    Shutdown,
    TimerAction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir

from boom_twin.bag.advice import publishable
from boom_twin.bag.reader import scan
from boom_twin.bag.session_model import kept
from boom_twin.config.settings import DEFAULT_FILE, read_parameters
from boom_twin.system.processes import python_command

FLAG = ("true", "false")
ARGUMENTS = [
    DeclareLaunchArgument("bag", description="session to play: rosbag2 directory or .mcap file"),
    DeclareLaunchArgument("rate", default_value="1.0", description="session time over real time"),
    DeclareLaunchArgument("start", default_value="0.0", description="begin so many seconds into the session"),
    DeclareLaunchArgument("wait", default_value="120.0", description="seconds to wait for the node; the first start compiles"),
    DeclareLaunchArgument("params_file", default_value=str(DEFAULT_FILE), description="parameters of the node"),
    DeclareLaunchArgument(
        "scene", default_value="", description="scene file of the boom; empty: of params_file, or that of the session"
    ),
    DeclareLaunchArgument(
        "mapping", default_value="", description="names and units of sensors; empty: of params_file, or those of the session"
    ),
    DeclareLaunchArgument(
        "namespace", default_value="", description="of all nodes; topics of a session that was recorded in one stay in that"
    ),
    DeclareLaunchArgument("frame_prefix", default_value="", description="before every frame: front/; empty: of params_file"),
    DeclareLaunchArgument("state_publisher", default_value="true", choices=FLAG, description="start robot_state_publisher: TF"),
    DeclareLaunchArgument(
        "monitor", default_value="", choices=(*FLAG, ""), description="the live page beside the node; empty: as in params_file"
    ),
    DeclareLaunchArgument("rviz", default_value="true", choices=FLAG, description="start RViz"),
    DeclareLaunchArgument("record", default_value="", description="new folder to record the session into; empty: none"),
]
PLAYER = ("rate", "start", "wait")  # arguments of the player alone; all but these and ``bag`` are passed to ``twin.launch.py``
KEPT = {"scene": "scene:=FILE", "mapping": "mapping:=FILE"}  # files that the session keeps, and the argument that replaces each


def generate_launch_description() -> LaunchDescription:
    """Return the arguments above, the twin on simulated time and the player. All of them end with the session."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=twin), OpaqueFunction(function=player)])


def twin(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return ``twin.launch.py`` on the session's clock. Scene and mapping default to those of the session."""
    names = [each.name for each in ARGUMENTS if each.name not in ("bag", *PLAYER)]
    given = {name: LaunchConfiguration(name).perform(context) for name in names}
    bag = Path(LaunchConfiguration("bag").perform(context))
    publishable(scan(bag))  # raises if nothing of it can be played
    values = read_parameters(Path(given["params_file"]), given["namespace"])
    files = kept_files(bag, [name for name in KEPT if not given[name] and not values.get(name)])
    source = PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/twin.launch.py"])
    arguments = {**given, **files, "use_sim_time": "true", "ignore_timestamp": "true"}
    return [IncludeLaunchDescription(source, launch_arguments=list(arguments.items()))]


def kept_files(bag: Path, names: list[str]) -> dict[str, str]:
    """Return the files (``scene``, ``mapping``) that the session keeps, as paths that last as long as this process."""
    texts = {name: own.text for name in names if (own := kept(bag, name, KEPT[name])) is not None}
    if not texts:
        return {}
    folder = TemporaryDirectory(prefix="boom_twin_")
    atexit.register(folder.cleanup)
    for name, text in texts.items():
        (Path(folder.name) / f"{name}.yaml").write_text(text, encoding="utf-8")
    return {name: f"{folder.name}/{name}.yaml" for name in texts}


def player(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the player of the session's inputs and clock, which waits for the node and for the recorder, if any."""
    last = 3.0  # time after the end of the session for node and recorder to take the last messages, s
    bag, record = (LaunchConfiguration(name).perform(context) for name in ("bag", "record"))
    options = [part for name in (*PLAYER, "namespace") for part in (f"--{name}", LaunchConfiguration(name).perform(context))]
    command = python_command("boom_twin.cli.main", "play", bag, "--clock", *options)
    command += ["--listeners", "2" if record else "1"]
    over = TimerAction(period=last, actions=[Shutdown(reason="the session has been played")])
    return [ExecuteProcess(cmd=command, name="play", output="screen", on_exit=[over])]
