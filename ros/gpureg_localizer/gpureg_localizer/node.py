# SPDX-License-Identifier: BSD-3-Clause
"""ROS 2 node: the pose of the next cloud in a map, each time that the service is called."""

import queue

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from .localizer import Localizer


class LocalizerNode(Node):
    def __init__(self):
        super().__init__("gpureg_localizer")
        path = self.declare_parameter("map", "").value
        self.map_frame = self.declare_parameter("map_frame", "map").value
        self.timeout = self.declare_parameter("timeout", 10.0).value  # seconds, for a cloud
        if not path:
            raise ValueError("parameter map: expected a file of `gpureg locate --save-map`")
        self.localizer = Localizer(path)
        self.wanted = None  # where the next cloud goes
        # The last pose also reaches those who subscribe later.
        latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        self.publisher = self.create_publisher(PoseWithCovarianceStamped, "pose", latched)
        # The service waits for the subscription, so they have threads of their own.
        self.create_subscription(
            PointCloud2,
            "points",
            self.on_points,
            qos_profile_sensor_data,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
        self.create_service(
            Trigger,
            "relocalize",
            self.relocalize,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def on_points(self, message):
        wanted, self.wanted = self.wanted, None
        if wanted is not None:
            wanted.put(message)

    def relocalize(self, _, response):
        self.wanted = clouds = queue.SimpleQueue()
        try:
            message = clouds.get(timeout=self.timeout)
            location = self.localizer.locate(message)
        except queue.Empty:
            self.wanted = None
            response.success, response.message = False, f"no cloud within {self.timeout:g} s"
        except Exception as error:  # an answer, whatever the cloud is like
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = location.found, location.text
            if location.found:
                self.publisher.publish(self.pose_of(location, message.header.stamp))
        self.get_logger().info(response.message)
        return response

    def pose_of(self, location, stamp):
        out = PoseWithCovarianceStamped()
        out.header.stamp, out.header.frame_id = stamp, self.map_frame
        position, orientation = out.pose.pose.position, out.pose.pose.orientation
        position.x, position.y, position.z = map(float, location.position)
        orientation.x, orientation.y, orientation.z, orientation.w = map(float, location.quaternion)
        out.pose.covariance = location.covariance.tolist()
        return out


def main():
    rclpy.init()
    try:
        rclpy.spin(LocalizerNode(), executor=MultiThreadedExecutor(2))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
