"""Arrays in and out, names, exceptions, threads."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest
import rotary_sins as rs


def test_arrays_there_and_back(bag, tmp_path) -> None:
    """Columns of a record make the same record again; written and read it is the same to rounding of its positions."""
    record = rs.read(bag)
    assert record.imu["angular_rate"].shape == (len(record), 3)
    assert record.imu["angular_rate"].dtype == np.float64
    assert record.imu["stamp_ns"].dtype == np.int64
    tables = {name: getattr(record, name) for name in ["imu", "joints", "fix", "velocity"]}
    again = rs.Record(**tables)
    assert rs.calibrate(again, model="paper").state.tolist() == (
        rs.calibrate(bag, model="paper").state.tolist()
    )
    again.write(tmp_path / "again.mcap")
    with pytest.raises(rs.BagError, match="already"):
        again.write(tmp_path / "again.mcap")
    third = rs.read(tmp_path / "again.mcap")
    assert np.array_equal(third.imu["specific_force"], record.imu["specific_force"])
    np.testing.assert_allclose(third.fix["position"], record.fix["position"], rtol=1e-15)
    assert third.duration_s == record.duration_s


def test_columns_for_tables(rest) -> None:
    """One array a number, with axis and unit in its name, all of one length, as views."""
    record = rs.read(rest)
    imu = record.imu
    flat = rs.columns(imu)
    assert list(flat)[:4] == [
        "stamp_ns",
        "angular_rate_x_rad_s",
        "angular_rate_y_rad_s",
        "angular_rate_z_rad_s",
    ]
    assert {len(column) for column in flat.values()} == {len(record)}
    assert np.shares_memory(flat["angular_rate_x_rad_s"], imu["angular_rate"])


def test_sample_by_sample(bag) -> None:
    """A record in pieces gives what the whole gives, and tells its phases."""
    whole = rs.read(bag)
    calibrator = rs.Calibrator(model="paper")
    assert calibrator.estimate is None
    phases = []
    for start in range(0, 5400, 600):
        piece = rs.read(bag, start_offset=start, duration=600.0)
        for event in calibrator.push(piece):
            if event["event"] == "phase_changed":
                phases.append(event["to"])
    assert phases[:3] == ["coarse_alignment", "fine_alignment", "calibrating"]
    assert calibrator.estimate is not None and calibrator.phase == phases[-1]
    found = calibrator.finish()
    # The piece's ends share a sample, which is refused as repeated.
    np.testing.assert_allclose(
        found.gyroscope_drift, rs.calibrate(whole, model="paper").gyroscope_drift, rtol=1e-9
    )


def test_errors_and_their_inverse() -> None:
    """What errors do to a steady motion, their inverse takes out, each sample by itself and as a stream."""
    errors = rs.SensorErrors(
        gyroscope_drift=[5e-8, -4e-8, 3e-8],
        accelerometer_bias=1e-3,
        gyroscope_matrix=[[1e-5, 2e-5, 3e-5], [4e-5, 5e-5, 6e-5], [7e-5, 8e-5, 9e-5]],
        accelerometer_quadratic=[5e-7, 0, 0],
    )
    assert errors.gyroscope_matrix[0, 2] == 3e-5
    assert errors.named["gyroscope_installation_xz_rad"] == 3e-5
    assert errors.accelerometer_bias.tolist() == [1e-3] * 3
    rate, force = np.full((4, 3), 0.01), np.tile([0.1, 0.2, 9.8], (4, 1))
    reported = errors.corrupt(rate, force)
    assert np.abs(reported[1] - force).max() > 9e-4
    for back in [errors.correct(*reported), errors.compensator().apply(0.01, *reported)]:
        np.testing.assert_allclose(back[0], rate, rtol=0, atol=1e-15)
        np.testing.assert_allclose(back[1], force, rtol=0, atol=1e-12)
    assert errors == rs.SensorErrors(**{
        name: getattr(errors, name)
        for name in ["gyroscope_drift", "accelerometer_bias", "gyroscope_matrix", "accelerometer_quadratic"]
    })


def test_schemes_and_states() -> None:
    """Schemes are objects with a time line, and states have names with units."""
    assert "eight-position" in rs.scheme_names()
    scheme = rs.Scheme("eight-position")
    assert len(scheme.rotations) == 10
    timeline = scheme.timeline(5272.0)
    assert [t["position"] for t in timeline if t["kind"] == "dwell"][:5] == list("ABCDA")
    assert timeline[1] == {"kind": "rotation", "start_s": 500.0, "end_s": 538.0, "position": "B"}
    own = rs.Scheme.from_yaml(
        "rotations: [{axis: x, angle_deg: 180}, {axis: x, angle_deg: -180}]\ndwell_s: 60", name="mine"
    )
    assert own.name == "mine" and own != scheme
    record, _ = rs.simulate(own, hours=0.05, rate_hz=10.0)
    assert np.abs(record.joints["position"][:, 0]).max() == pytest.approx(np.pi, abs=1e-3)
    names = [state["name"] for state in rs.states()]
    assert "gyroscope_drift_z_rad_s" in names and len(set(names)) == len(names) > 40


def test_settings_are_named(rest) -> None:
    """Keyword arguments are the settings; what is not known, or means nothing, is named."""
    settings = rs.calibration_settings()
    assert settings["model"] == "Whole" and settings["coarse_alignment_s"] == 300.0
    found = rs.align(rest, coarse_alignment_s=120.0, prior={"gyroscope_drift_rad_s": 1e-7})
    assert found.phase == "fine_alignment"
    for call, words in [
        (lambda: rs.align(rest, coarse_alignment=1.0), "coarse_alignment is not known"),
        (lambda: rs.align(rest, prior={"drift": 1.0}), "prior.drift is not known"),
        (lambda: rs.align(rest, antenna={"arm_m": [1.0, 2.0]}), "antenna.arm_m has 2 numbers, expected 3"),
        (lambda: rs.align(rest, coarse_alignment_s=-1.0), "coarse_alignment_s is -1"),
        (lambda: rs.calibrate(rest, model="big"), "whole or paper"),
        (lambda: rs.calibrate(rest, reference="stars"), "expected one of moored"),
        (lambda: rs.calibrate(rest, thresholds={"colour": 1.0}), "colour"),
        (lambda: rs.simulate(hours=0.1, sensor="brick"), "brick"),
        (lambda: rs.allan(rest, confidence=2.0), "confidence is 2"),
    ]:
        with pytest.raises(rs.SettingError, match=words):
            call()


def test_exceptions_are_the_librarys_own(tmp_path, rest) -> None:
    """Each kind has its class below one base, and says what was wrong."""
    with pytest.raises(rs.BagError, match="none.mcap"):
        rs.read(tmp_path / "none.mcap")
    with pytest.raises(rs.SchemeError, match="expected one of eight-position"):
        rs.Scheme("waltz")
    with pytest.raises(rs.AlignmentError, match="rest.mcap"):
        rs.calibrate(rest, position=None, coarse_alignment_min_s=3000.0, coarse_alignment_s=4000.0)
    with pytest.raises(rs.SettingError, match="angular_rate: expected float64"):
        rs.Record(imu={"stamp_ns": np.arange(3), "angular_rate": np.zeros((3, 2)), "specific_force": np.zeros((3, 3))})
    with pytest.raises(rs.SettingError, match="imu has no column colour"):
        rs.Record(imu={"stamp_ns": np.arange(3), "colour": np.zeros(3)})
    with pytest.raises(rs.RotarySinsError):
        rs.Calibration.read(tmp_path / "none.yaml")
    for kind in [rs.BagError, rs.SettingError, rs.AlignmentError, rs.SchemeError]:
        assert issubclass(kind, rs.RotarySinsError)


def test_the_interpreter_is_free(bag) -> None:
    """While the library works, other threads of Python go on."""
    done = threading.Event()

    def work() -> None:
        for _ in range(3):
            rs.calibrate(bag, model="whole")
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    turns = 0
    while not done.is_set():
        turns += 1
        time.sleep(0)
    thread.join()
    # A library that keeps the interpreter lets through no more than a turn a call.
    assert turns > 100
