"""Built by colcon as an ament_python package."""

from setuptools import setup

NAME = "locution_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/locution.launch.py"]),
        (f"share/{NAME}/config", ["config/locution.yaml"]),
    ],
    install_requires=["setuptools", "locution-client"],
    zip_safe=True,
    maintainer="The Locution developers",
    maintainer_email="locution@locution.dev",
    description="Sends scans and odometry to a Locution server, and brings its map and the robot's place in it back",
    license="MIT",
    entry_points={"console_scripts": [f"locution = {NAME}.node:main"]},
)
