"""Package boom_twin for pip and for colcon (ament_python)."""

from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).parent


def files(folder: str) -> list[str]:
    """Paths of all files right in a folder."""
    return sorted(str(path.relative_to(HERE)) for path in (HERE / folder).iterdir() if path.is_file())


setup(
    name="boom_twin",
    version="0.2.0",
    description="Digital twin of a concrete placing boom: transfer-matrix model, ROS 2 node, replay of MCAP sessions",
    long_description=(HERE / "README.md").read_text(encoding="utf-8") if (HERE / "README.md").exists() else "",
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    author="boom_twin developers",
    packages=find_packages(include=["boom_twin", "boom_twin.*"]),
    package_data={
        "boom_twin": [
            "py.typed",
            "alarms.json",
            "texts.json",
            *(f"msg_config/*.{end}" for end in ("yaml", "rviz", "json", "txt", "xml")),
            "examples/*.yaml",
            "monitor/page/*",
            "report/templates/*.html",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", ["msg_config/resource/boom_twin"]),
        ("share/boom_twin", ["package.xml"]),
        ("share/boom_twin/msg_config", files("msg_config")),
        ("share/boom_twin/launch", files("boom_twin/launch")),
    ],
    python_requires=">=3.11",
    classifiers=[f"Programming Language :: Python :: 3.{minor}" for minor in (11, 12, 13)],
    install_requires=[  # the lowest versions have no flaw that is known and met here: docs/security.md says why each
        "numpy>=2.0,<3",
        "scipy>=1.13,<2",
        "numba>=0.62.1,<0.69",
        "pydantic>=2.7,<3",
        "ruamel.yaml>=0.18,<1",
        "mcap>=1.5,<2",
        "rosbags>=0.11.9,<0.12",
        "zstandard>=0.22,<1",
        "lz4>=4.3.3,<5",
        "matplotlib>=3.9.1,<4",
        "jinja2>=3.1.6,<4",
    ],
    extras_require={
        "ros": ["ros-jazzy-rclpy[fastrtps]>=7.1,<8", "ros-jazzy-common-interfaces>=5.3,<6"],
        "test": [
            "pytest>=9.0.3,<10",
            "pytest-xdist>=3.6,<4",
            "hypothesis>=6.100,<7",
            "ruff>=0.6,<1",
            "mypy>=1.11,<3",
            "import-linter>=2.0,<3",
            "aiohttp>=3.14.4,<4",
            "playwright>=1.56,<2",
            "rainflow>=3.2,<4",
            "pandas>=2.2,<4",
            "nbclient>=0.10,<1",
            "nbformat>=5.10,<6",
            "ipykernel>=6.29,<8",
        ],
        "peers": ["exudyn>=1.13,<2", "pyOMA-2>=1.4,<2"],
        "modal": ["pyOMA-2>=1.4,<2"],
        "monitor": ["aiohttp>=3.14.4,<4"],
        "batch": [
            "dask>=2025.5,<2027",
            "distributed>=2025.5,<2027",
            "pyarrow>=18,<27",
        ],
        "import": ["pyarrow>=18,<27", "tzdata>=2025.1"],
        "fatigue": ["rainflow>=3.2,<4"],
        "notebook": ["pandas>=2.2,<4", "nbclient>=0.10,<1", "nbformat>=5.10,<6", "ipykernel>=6.29,<8"],
        "docs": [
            "mkdocs>=1.6.1,<2",
            "mkdocs-material>=9.8.1,<10",
            "mkdocstrings>=1.0.8,<2",
            "mkdocstrings-python>=2.0.11,<3",
            "ruff>=0.6,<1",  # breaks long signatures into lines
        ],
    },
    # where `ros2 run` looks; pip puts scripts into bin/ all the same
    options={"install": {"install_scripts": "$base/lib/boom_twin"}, "develop": {"script_dir": "$base/lib/boom_twin"}},
    entry_points={"console_scripts": ["boom_twin = boom_twin.cli.main:main", "twin_node = boom_twin.ros.node.main:main"]},
)
