# SPDX-License-Identifier: BSD-3-Clause
"""ros2 launch gpureg_localizer localizer.launch.py map:=building.gpureg points:=/lidar/points"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    def text(name):  # a file that is called 1 is no number
        return ParameterValue(LaunchConfiguration(name), value_type=str)

    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="file of `gpureg locate --save-map`"),
            DeclareLaunchArgument("map_frame", default_value="map"),
            DeclareLaunchArgument("points", default_value="points"),
            Node(
                package="gpureg_localizer",
                executable="localizer",
                output="screen",
                parameters=[{"map": text("map"), "map_frame": text("map_frame")}],
                remappings=[("points", LaunchConfiguration("points"))],
            ),
        ]
    )
