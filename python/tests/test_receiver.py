"""The whole receiver, fed event by event."""

import dataclasses
import json
import threading

import numpy as np
import pytest

import cslam

#: Three seconds at rest, then seven in the air.
SWEEPS = 20


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    out = tmp_path_factory.mktemp("recorded") / "flight"
    told = cslam.record(out, "outdoor", world="budget", seed=3, sweeps=SWEEPS)
    assert told["seed"] == 3 and told["samples"] and told["world"] == "budget"
    return out


@pytest.fixture(scope="module")
def flown(directory):
    """A receiver after the flight, the sweeps that it reported, and what it sent."""
    recording = cslam.RecordedFlight(directory)
    receiver = cslam.Receiver.of(recording)
    sweeps, packets = [], b""
    for event in recording:
        receiver.feed(event)
        sweeps += receiver.take_sweeps()
        packets += receiver.take_packets()
    receiver.end()
    return receiver, sweeps + receiver.take_sweeps(), packets + receiver.take_packets()


def test_it_sends_and_maps_what_the_command_does(tmp_path, directory, flown):
    receiver, sweeps, packets = flown
    flight = cslam.fly(directory, tmp_path / "out")
    assert packets == (tmp_path / "out" / "packets.bin").read_bytes() and len(packets) > 500
    assert [swept.sweep for swept in sweeps] == list(range(SWEEPS))
    columns = receiver.map
    ours = columns["position_m"][np.lexsort(columns["position_m"].T)]
    theirs = np.stack([flight.map[axis] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(ours, theirs[np.lexsort(theirs.T)], atol=1e-3)
    assert columns["hits"].sum() == sum(len(swept.point_position_m) for swept in sweeps) > 0
    last = flight.trajectory[-1]
    np.testing.assert_allclose(receiver.pose.position_m, last[1:4], atol=0.1)


def test_what_it_reports_fits_together(flown):
    receiver, sweeps, _ = flown
    assert {swept.link_state for swept in sweeps} >= {"line of sight"}
    started = next(i for i, swept in enumerate(sweeps) if swept.pose is not None)
    assert sweeps[started].los_used and started < 12
    for swept in sweeps:
        n, m = len(swept.path_c_tau_m), len(swept.point_position_m)
        assert swept.path_aoa_body.shape == (n, 3) and len(swept.path_verdict) == len(swept.path_snr_db) == n
        assert swept.point_position_m.shape == (m, 3) and len(swept.point_surface) == len(swept.point_probability) == m
        np.testing.assert_allclose(np.linalg.norm(swept.path_aoa_body, axis=1), 1, atol=1e-6)
    pose = receiver.pose
    assert np.linalg.norm(pose.quaternion_wb) == pytest.approx(1)
    for covariance in (pose.position_covariance_m2, pose.attitude_covariance_rad2, pose.velocity_covariance_m2_per_s2):
        assert (np.linalg.eigvalsh(covariance) > 0).all()
    assert pose.clock_sigma_s > 0


def test_events_are_in_order_and_can_be_read_twice(directory):
    recording = cslam.RecordedFlight(directory)
    kinds = [type(event) for event in recording]
    assert kinds == [type(event) for event in recording]
    assert {cslam.ImuSamples, cslam.MagnetometerSample, cslam.TimingExchange, cslam.SweepSamples, cslam.Beacon} <= set(kinds)
    assert kinds.count(cslam.SweepSamples) == recording.sweeps == SWEEPS
    at = lambda event: np.atleast_1d(event.time_ns)  # noqa: E731
    assert (np.diff(np.concatenate([at(event) for event in recording]).astype(np.int64)) >= 0).all()


def test_samples_that_are_lost_are_missed_and_late_ones_refused(directory):
    recording = cslam.RecordedFlight(directory)
    receiver = cslam.Receiver.of(recording)
    sweeps = [event for event in recording if isinstance(event, cslam.SweepSamples)]
    few = cslam.Recording(sweeps[0].beams.iq[:9], sweeps[0].beams.beams[:9], sweeps[0].beams.exponents[:9])
    assert receiver.sweep(sweeps[0].time_ns, 0, few)
    assert receiver.sweep(sweeps[1].time_ns, 1, sweeps[1].beams, sweeps[1].squint)
    assert not receiver.sweep(sweeps[0].time_ns, 0, sweeps[0].beams)
    receiver.elapse(sweeps[2].time_ns)
    ended = receiver.take_sweeps()
    assert [swept.sweep for swept in ended] == [0, 1] and receiver.take_sweeps() == []
    assert all(swept.pose is None for swept in ended) and receiver.pose is None


def test_a_recorded_sweep_has_its_pilots(directory):
    sweeps = [event for event in cslam.RecordedFlight(directory) if isinstance(event, cslam.SweepSamples)]
    for swept in sweeps:
        pilots = swept.pilots
        assert pilots.codebook == "gmt-72-pilots" and pilots.iq.shape == (24, 32, 512, 2)
        first, second = pilots.beams[0::2], pilots.beams[1::2]
        np.testing.assert_array_equal(second, first + 72)
        assert set(first) <= set(swept.beams.beams)
    at = directory / "pilots-0004"
    np.testing.assert_array_equal(sweeps[4].pilots.iq, cslam.read_sigmf(at).iq)
    assert cslam.read_sigmf(at).codebook == "gmt-72-pilots"


def test_a_recording_without_pilots_is_read_and_missing_ones_are_named(tmp_path, directory):
    told = json.loads((directory / "flight.json").read_text())
    assert told["pilots"] is True
    for file in directory.iterdir():
        if not file.name.startswith(("pilots-", "flight.json")):
            (tmp_path / file.name).symlink_to(file)
    (tmp_path / "flight.json").write_text(json.dumps(told))
    with pytest.raises(ValueError, match="pilots-0000.sigmf-meta: missing, expected the pilots of sweep 0"):
        cslam.RecordedFlight(tmp_path)
    del told["pilots"]
    (tmp_path / "flight.json").write_text(json.dumps(told))
    sweeps = [event for event in cslam.RecordedFlight(tmp_path) if isinstance(event, cslam.SweepSamples)]
    assert len(sweeps) == SWEEPS and all(swept.pilots is None and swept.squint is not None for swept in sweeps)


def packets_of(directory, change):
    """What a receiver sends that is fed the events of a recording after a change."""
    recording = cslam.RecordedFlight(directory)
    receiver = cslam.Receiver.of(recording)
    packets = b""
    for event in recording:
        receiver.feed(change(event) if isinstance(event, cslam.SweepSamples) else event)
        packets += receiver.take_packets()
    receiver.end()
    return packets + receiver.take_packets()


def test_pilots_reach_the_receiver(directory, flown):
    _, sweeps, packets = flown
    # The count of blocks in the health packets is what is left of pilots in a flight that sees its transmitter.
    assert packets_of(directory, lambda event: event) == packets
    assert packets_of(directory, lambda event: dataclasses.replace(event, pilots=None)) != packets


def test_a_sweep_is_taken_with_and_without_pilots(directory):
    event = next(event for event in cslam.RecordedFlight(directory) if isinstance(event, cslam.SweepSamples))
    for told in ((), (event.squint,), (event.squint, event.pilots), (None, event.pilots)):
        receiver = cslam.Receiver()
        assert receiver.sweep(event.time_ns, event.sweep, event.beams, *told)
        receiver.elapse(event.time_ns + 10**9)
        assert [swept.sweep for swept in receiver.take_sweeps()] == [event.sweep]


def test_threads_may_share_a_receiver(directory):
    recording = cslam.RecordedFlight(directory)
    receiver = cslam.Receiver()
    stop = threading.Event()
    seen = []

    def watch():
        while not stop.is_set():
            seen.append(receiver.pose)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        for event in recording:
            receiver.feed(event)
    finally:
        stop.set()
        watcher.join()
    assert receiver.pose is not None and seen


VECTOR = (0.0, 0.0, 0.0)


def one(number):
    """A block of this number, in which nothing is heard."""
    return cslam.Recording(np.zeros((1, 32, 512, 2), np.int16), np.array([number]), np.array([-30]))


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda r: r.imu([1, 2], np.zeros((1, 3)), np.zeros((2, 3))), r"rate_rad_per_s: got shape \[1, 3\], expected \[2, 3\]"),
        (lambda r: r.imu([1], [[0, 0, np.nan]], [VECTOR]), "rate_rad_per_s: a number is not finite"),
        (lambda r: r.imu(0.5, VECTOR, VECTOR), "time_ns: got float64"),
        (lambda r: r.imu(-5, VECTOR, VECTOR), "time_ns: got int64"),
        (lambda r: r.magnetometer(1, [1, 2]), r"field_ut: got shape \[2\], expected \[3\]"),
        (lambda r: r.magnetometer(1.5, VECTOR), "time_ns: got float, expected a whole number"),
        (lambda r: r.timing(1, 2.0), "clock_offset_s: got 2.0, expected -1 to 1"),
        (lambda r: r.timing(1, float("nan")), "clock_offset_s: got nan"),
        (lambda r: r.beacon(1, 0, [0, 0, np.inf]), "position_m: a number is not finite"),
        (lambda r: r.beacon(1, 0, VECTOR, (4.0, 0, 0)), "heading_pitch_roll_rad"),
        (lambda r: r.beacon(1, 0, VECTOR, sweeps_per_stop=0), "sweeps_per_stop: got 0, expected 1 to 65535"),
        (lambda r: r.beacon(1, -1, VECTOR), "sweep: got -1"),
        (lambda r: r.sweep(1, 0, cslam.Recording(np.zeros((1, 32, 512)), np.zeros(1, int), np.zeros(1, int))), "iq: got float64"),
        (lambda r: r.sweep(1, 0, one(0), pilots=one(144)), "beams: got 144, expected 0 to 143"),
        (lambda r: r.sweep(1, 0, one(72), pilots=one(143)), "beams: got 72, expected 0 to 71"),
        (lambda r: r.elapse(2**64), "time_ns: got 18446744073709551616"),
        (lambda r: r.feed("imu"), "event: got str"),
        (lambda r: cslam.Receiver(ground_z_m=float("nan")), "ground_z_m: got nan"),
        (lambda r: cslam.Receiver(earth_field_ut=[0, 0, 1]), "earth_field_ut: got a field of 1 uT"),
        (lambda r: cslam.Receiver(uav=256), "uav: got 256, expected 0 to 255"),
        (lambda r: cslam.Receiver(key=bytes(32)), "key: got 32 bytes, expected 32 that are drawn at random"),
        (lambda r: cslam.RecordedFlight("nowhere"), "nowhere"),
        (lambda r: cslam.record("nowhere", world="perfect"), 'world: got "perfect", expected one of ideal, budget, real'),
        (lambda r: cslam.record("nowhere", "nowhere.json"), "nowhere.json"),
        (lambda r: cslam.record("nowhere", channel="nowhere.jsonl"), "nowhere.jsonl"),
        (lambda r: cslam.record("nowhere", sweeps=0), "sweeps: got 0"),
    ],
)
def test_wrong_arguments_are_refused_by_name(call, words):
    with pytest.raises(ValueError, match=words):
        call(cslam.Receiver())


def test_its_values_are_plain_dataclasses(flown):
    receiver, sweeps, _ = flown
    assert set(dataclasses.asdict(receiver.pose)) == {field.name for field in dataclasses.fields(cslam.Pose)}
    assert dataclasses.asdict(sweeps[-1])["pose"]["resets"] == sweeps[-1].pose.resets
