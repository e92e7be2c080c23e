"""Columns for tables of other libraries, none of which is imported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

_PARTS = {
    "angular_rate": ("rad_s", "xyz"),
    "specific_force": ("m_s2", "xyz"),
    "angular_rate_variance": ("rad2_s2", "xyz"),
    "specific_force_variance": ("m2_s4", "xyz"),
}


def columns(table: Mapping[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """One array a number, from a table of a :class:`Record` such as ``record.imu``.

    ``pandas.DataFrame(columns(record.imu))`` and ``polars.DataFrame(columns(record.imu))`` take what comes back. A column (n, 3)
    becomes three, by axis and with their unit: ``angular_rate_x_rad_s``; others are numbered. They are views, no copies.
    """
    flat: dict[str, npt.NDArray[Any]] = {}
    for name, values in table.items():
        array = np.asarray(values)
        if array.ndim == 1:
            flat[name] = array
            continue
        unit, axes = _PARTS.get(name, ("", "0123456789"))
        for k in range(array.shape[1]):
            parts = [name, axes[k], unit] if unit else [name, axes[k]]
            flat["_".join(parts)] = array[:, k]
    return flat
