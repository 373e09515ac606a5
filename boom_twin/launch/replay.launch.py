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

from boom_twin.bag.advice import publishable
from boom_twin.bag.reader import scan
from boom_twin.bag.session_model import kept
from boom_twin.config.settings import DEFAULT_FILE, read_parameters
from boom_twin.system.processes import python_command

ARGUMENTS = [
    DeclareLaunchArgument("bag", description="session to play: rosbag2 directory or .mcap file"),
    DeclareLaunchArgument("rate", default_value="1.0", description="session time over real time"),
    DeclareLaunchArgument("start", default_value="0.0", description="begin so many seconds into the session"),
    DeclareLaunchArgument("wait", default_value="120.0", description="seconds to wait for the node; the first start compiles"),
    DeclareLaunchArgument("rviz", default_value="true", choices=("true", "false"), description="start RViz"),
]
"""Arguments beside those of ``twin.launch.py``, and one that has another default there."""
PLAYER = ("rate", "start", "wait")  # arguments of the player
KEPT = {"scene": "scene:=FILE", "mapping": "mapping:=FILE"}  # files that the session keeps, and the argument that replaces each


def generate_launch_description() -> LaunchDescription:
    """Return the arguments above, the twin on simulated time and the player. All of them end with the session."""
    twin = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(Path(__file__).with_name("twin.launch.py"))))
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=prepare), twin, OpaqueFunction(function=player)])


def prepare(context: LaunchContext) -> None:
    """Set what ``twin.launch.py`` is given: the session's clock, and by default the scene and mapping of the session."""
    given = context.launch_configurations
    bag = Path(given["bag"])
    publishable(scan(bag))  # raises if nothing of it can be played
    values = read_parameters(Path(given.get("params_file", DEFAULT_FILE)), given.get("namespace", ""))
    given.update(kept_files(bag, [name for name in KEPT if not given.get(name) and not values.get(name)]))
    given.update(use_sim_time="true", ignore_timestamp="true")


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
    given = context.launch_configurations
    options = [part for name in (*PLAYER, "namespace") for part in (f"--{name}", given[name])]
    command = python_command("boom_twin.cli.main", "play", given["bag"], "--clock", *options)
    command += ["--listeners", "2" if given["record"] else "1"]
    over = TimerAction(period=last, actions=[Shutdown(reason="the session has been played")])
    return [ExecuteProcess(cmd=command, name="play", output="screen", on_exit=[over])]
