"""The package gives the numbers of the command line, to the last bit."""

from pathlib import Path

import numpy as np
import pytest
import rotary_sins as rs


@pytest.mark.parametrize("model", ["paper", "whole"])
@pytest.mark.parametrize("in_memory", [False, True])
def test_calibrate(bag, rotary_sins, model, in_memory) -> None:
    """Every estimate, sigma and covariance of a calibration, from the bag and from its record in memory."""
    said = rotary_sins.json("calibrate", bag, "--model", model, status=None)
    found = rs.calibrate(rs.read(bag) if in_memory else bag, model=model)
    assert found.phase == said["phase"]
    for name in ["gyroscope_drift", "accelerometer_bias"]:
        unit = "rad_s" if name == "gyroscope_drift" else "m_s2"
        assert getattr(found, name).tolist() == said[f"{name}_{unit}"]
        assert getattr(found, f"{name}_std").tolist() == said[f"{name}_std_{unit}"]
    assert found.misalignment_std.tolist() == said["misalignment_std_rad"]
    assert found.attitude_xyzw.tolist() == said["attitude_xyzw"]
    assert found.state_names == said["state_names"]
    assert found.state.tolist() == said["state"]
    assert found.covariance.ravel().tolist() == said["covariance"]
    assert found.unobservable == said["unobservable"]
    assert found.verdict["converged"] == said["verdict"]["converged"]
    assert found.verdict["reasons"] == said["verdict"]["reasons"]
    assert (found.samples, found.gaps, found.stamp_ns) == (
        said["samples"],
        said["gaps"],
        said["stamp_ns"],
    )
    assert found.is_good == (said["verdict"]["converged"] and said["verdict"]["consistent"])


def test_align(bag, rest, rotary_sins) -> None:
    """Heading, roll and pitch at rest, and up to the first turn of the table."""
    for path in [bag, rest]:
        said = rotary_sins.json("align", path)
        found = rs.align(path)
        assert found.stamp_ns == said["stamp_ns"]
        assert found.attitude_xyzw.tolist() == said["attitude_xyzw"]
        for name in ["heading", "roll", "pitch"]:
            assert np.degrees(found.vehicle[f"{name}_rad"]) == pytest.approx(said[f"{name}_deg"], rel=1e-15)


def test_navigate(bag, rest, rotary_sins, tmp_path) -> None:
    """Position errors with a calibration that the command line wrote, and with the one in memory."""
    file = tmp_path / "calibration.yaml"
    rotary_sins("calibrate", bag, "--output", file, status=None)
    said = rotary_sins.json("navigate", rest, "--calibration", file)
    said.pop("warnings")
    assert rs.navigate(rest, rs.Calibration.read(file)) == said
    assert rs.navigate(rest, rs.calibrate(bag).calibration) == said


def test_simulate(rotary_sins, tmp_path) -> None:
    """The same samples, in memory and in a bag, of a sensor that is drawn and a ship that lies askew."""
    path = tmp_path / "cli.mcap"
    rotary_sins(
        *["simulate", "--hours", "0.2", "--rate", "20", "--seed", "7", "--sensor", "ring-laser"],
        *["--heading-deg", "-30", "--output", path],
    )
    ours = tmp_path / "python" / "cli.mcap"
    record, errors = rs.simulate(
        hours=0.2,
        rate_hz=20.0,
        seed=7,
        sensor="ring-laser",
        plant={"ship": {"heading_rad": -30.0 * (np.pi / 180.0)}},
        output=ours,
    )
    assert ours.read_bytes() == path.read_bytes()
    for sensor in ["imu", "joints", "fix", "velocity"]:
        theirs = getattr(rs.read(path), sensor)
        for name, column in getattr(record, sensor).items():
            assert np.array_equal(column, theirs[name]), (sensor, name)
    assert errors.accelerometer_delay_s != 0.0


def test_observability(rotary_sins) -> None:
    """Ranks, degrees and the covariance bound of a scheme."""
    said = rotary_sins.json("observability", "--scheme", "eight-position-yz", "--hours", "2")
    found = rs.observability("eight-position-yz", hours=2.0)
    assert found["degrees"].tolist() == said["degrees"]
    assert found["bound_sigma"].tolist() == said["bound_sigma"]
    assert [r["rank"] for r in found["ranks"]] == [r["rank"] for r in said["ranks"]]
    bound = rs.bound("eight-position-yz", hours=2.0)
    assert bound["sigma"].tolist() == said["bound_sigma"]
    assert bound["state_names"] == said["state_names"]


def test_allan(rest, rotary_sins) -> None:
    """Deviations, bands and the noises in them."""
    said = rotary_sins.json("allan", rest)
    found = rs.allan(rest)
    assert found["tau_s"].tolist() == said["tau_s"]
    assert found["parameters"] == said["parameters"]
    for ours, theirs in zip(found["axes"], said["axes"], strict=True):
        assert ours["white_noise"] == theirs["white_noise"]
        for key in ["deviation", "lower", "upper", "degrees_of_freedom"]:
            assert ours[key].tolist() == theirs[key]
    assert rs.allan(rs.read(rest))["axes"][0]["deviation"].tolist() == said["axes"][0]["deviation"]


def test_smooth(bag, rotary_sins, tmp_path) -> None:
    record = tmp_path / "smoothed.mcap"
    said = rotary_sins.json("calibrate", bag, "--smoothed", record, status=None)
    found, epochs = rs.smooth(bag)
    assert found.state.tolist() == said["state"]
    count = said["smoothed"]["epochs"]
    assert {name: column.shape for name, column in epochs.items()} == {
        "stamp_ns": (count,),
        "attitude_xyzw": (count, 4),
        "velocity_m_s": (count, 3),
        "position": (count, 3),
        "misalignment_std_rad": (count, 3),
        "velocity_std_m_s": (count, 3),
    }
    # The last epoch is the filter's; the first knows the azimuth nearly as well, which the filter had to 10 deg there.
    assert epochs["stamp_ns"][-1] == said["stamp_ns"]
    assert abs(abs(epochs["attitude_xyzw"][-1] @ said["attitude_xyzw"]) - 1) < 1e-12
    assert (epochs["misalignment_std_rad"][:, 2] < 3 * said["misalignment_std_rad"][2]).all()


def test_passes(bag, rotary_sins) -> None:
    said = rotary_sins.json("calibrate", bag, "--model", "paper", "--passes", "2", status=None)
    assert rs.calibrate(bag, model="paper", passes=2).state.tolist() == said["state"]
