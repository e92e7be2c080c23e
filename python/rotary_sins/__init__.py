"""Self-calibration of a dual-axis rotary strapdown inertial navigation system.

Everything here is what the command line ``rotary-sins`` does, with the same numbers to the last bit: bags in and out
(:func:`read`, :class:`Record`), :func:`simulate`, :func:`align`, :func:`calibrate` (and :class:`Calibrator`, sample by
sample), :func:`smooth`, :func:`navigate`, :func:`observability`, :func:`bound`, :func:`allan`, :class:`SensorErrors` with its inverse,
:class:`Scheme`, and the :func:`states` by name. Arrays are ``float64``, rows of samples (n, 3), in SI units; stamps are
integer nanoseconds. The interpreter is free while the library works.
"""

from ._rotary_sins import (
    AlignmentError,
    BagError,
    Calibration,
    Calibrator,
    Compensator,
    Estimate,
    Record,
    RotarySinsError,
    Scheme,
    SchemeError,
    SensorErrors,
    SettingError,
    align,
    allan,
    bound,
    calibrate,
    calibration_settings,
    navigate,
    navigation_settings,
    observability,
    read,
    scheme_names,
    simulate,
    simulation_settings,
    smooth,
    states,
)

__all__ = [
    "AlignmentError",
    "BagError",
    "Calibration",
    "Calibrator",
    "Compensator",
    "Estimate",
    "Record",
    "RotarySinsError",
    "Scheme",
    "SchemeError",
    "SensorErrors",
    "SettingError",
    "align",
    "allan",
    "bound",
    "calibrate",
    "calibration_settings",
    "columns",
    "navigate",
    "navigation_settings",
    "observability",
    "read",
    "scheme_names",
    "simulate",
    "simulation_settings",
    "smooth",
    "states",
]

from .columns import columns
