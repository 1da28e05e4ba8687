# SPDX-License-Identifier: BSD-3-Clause
"""Finds the pose of a point cloud in a map of gpureg. Without ROS: `gpureg_localizer.localizer`."""
