"""Two components of demo_nodes_cpp in an isolated container: ros2 launch cie_rclcpp components.launch.py spec:=FILE

The container is the one changed line of a launch file that loads components: its package and its executable.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("spec", default_value="", description="the scheduling spec; empty: none"),
        ComposableNodeContainer(
            name="container", namespace="", package="cie_rclcpp", executable="cie_component_container",
            additional_env={"CIE_SPEC": LaunchConfiguration("spec")},
            composable_node_descriptions=[
                ComposableNode(package="demo_nodes_cpp", plugin="demo_nodes_cpp::Talker", name="talker"),
                ComposableNode(package="demo_nodes_cpp", plugin="demo_nodes_cpp::Listener", name="listener"),
            ])])
