"""Simulated ship, table and IMU; the scheme is run, calibrated and navigated on. Nothing real is needed.

    ros2 launch rotary_sins demo.launch.py speed:=20.0 scheme:=eight-position

Everything ends where the simulation ends, or where a node does.
"""

import pathlib
import runpy
import types

from launch import LaunchDescription
from launch.actions import OpaqueFunction, Shutdown

suite = types.SimpleNamespace(**runpy.run_path(str(pathlib.Path(__file__).with_name("suite.py"))))

# Argument: type of its value, what it is. Empty: as the parameter files say.
ARGUMENTS = {
    **suite.COMMON,
    "speed": (float, "Simulated seconds a second"),
    "heading_deg": (float, "Heading of the ship"),
    "scheme": (str, "Name or YAML file"),
}


def start(context):
    given = suite.given(context, ARGUMENTS)

    def node(name, *arguments, **parameters):
        return suite.node(name, given, *arguments, ours=parameters, on_exit=Shutdown(reason=f"{name} has ended"))

    return [
        node("imu_simulator", "speed", "heading_deg"),
        # The table is simulated: nobody has to be asked before it turns.
        node("scheme_sequencer", "scheme", use_sim_time=True, autostart=True),
        node("self_calibrator", use_sim_time=True),
        node("navigation_compensator", use_sim_time=True),
    ]


def generate_launch_description():
    return LaunchDescription([*suite.declared(ARGUMENTS), OpaqueFunction(function=start)])
