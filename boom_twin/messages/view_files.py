"""The views of RViz, Foxglove and PlotJuggler in ``msg_config`` for a boom in a namespace, with a prefix of its frames."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from .topic_table import FRAME, load_topics

FOLDER = Path(str(files("boom_twin") / "msg_config"))
RVIZ, FOXGLOVE, PLOTJUGGLER = (FOLDER / name for name in ("boom_twin.rviz", "foxglove.json", "plotjuggler.xml"))
VIEWS = (RVIZ, FOXGLOVE, PLOTJUGGLER)
DESCRIPTION = "/robot_description"  # topic of robot_state_publisher
TF_PREFIX = "TF Prefix:"  # key of the frame prefix in RViz's display of a robot model


def view_text(text: str, namespace: str = "", frame_prefix: str = "") -> str:
    """Return the text of a view with the namespace and the frame prefix of a boom.

    Parameters
    ----------
    text : str
        Text of one of `VIEWS`, or of a similar file.
    namespace : str
        ROS namespace of the twin. Quoted absolute names are put into it; relative ones, as RViz's, follow its own namespace.
    frame_prefix : str
        As the parameter of twin and robot_state_publisher: ``front/``.
    """
    usual, there = load_topics(), load_topics().in_namespace(namespace)
    space = namespace.strip("/")
    names = {topic.absolute: there.inputs[key].absolute for key, topic in usual.inputs.items()}
    names |= {topic.absolute: there.outputs[key].absolute for key, topic in usual.outputs.items()}
    names[DESCRIPTION] = f"/{space}{DESCRIPTION}" if space else DESCRIPTION
    longest_first = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    text = re.sub(rf'(?<=[";])({longest_first})(?=[/.";\[])', lambda found: names[found[0]], text)
    text = re.sub(rf"(?<![\w/]){FRAME}\b", f"{frame_prefix}{FRAME}", text)
    return re.sub(rf'{TF_PREFIX} ""', f'{TF_PREFIX} "{frame_prefix}"', text)
