"""The package: what it gives, and what it says of wrong arguments."""

import json
import os
import subprocess
import threading

import numpy as np
import pytest

import cslam


@pytest.fixture(scope="module")
def link():
    return cslam.Scene("outdoor").trace([0, 0, 1.5], [56, 2, 6])[0]


@pytest.fixture(scope="module")
def sweep(link):
    return cslam.synth(link)


@pytest.fixture(scope="module")
def paths(sweep):
    return cslam.Estimator().estimate(sweep.iq, sweep.beams, sweep.exponents)


def test_a_first_result():
    assert "reflected at" in cslam.demo()


def test_columns_fit_each_other(paths):
    n = len(paths)
    assert n > 0
    columns = paths.to_dict()
    shapes = {name: column.shape for name, column in columns.items()}
    assert shapes == {
        "c_tau_m": (n,),
        "aoa_body": (n, 3),
        "aod_world": (n, 3),
        "aod_sigma_rad": (n,),
        "snr_db": (n,),
        "beam": (n,),
        "covariance": (n, 3, 3),
    }
    np.testing.assert_allclose(np.linalg.norm(paths.aoa_body, axis=1), 1, atol=1e-6)
    assert (np.linalg.eigvalsh(paths.covariance) > 0).all()
    assert len(str(paths).splitlines()) == n + 1


def test_measured_paths_are_the_traced_ones(link, paths):
    for length in paths.c_tau_m:
        assert np.min(np.abs(link.c_tau_m - length)) < 0.2


def test_order_and_memory_of_beams_do_not_matter(sweep, paths):
    # Another order of the blocks, a view that is not contiguous, other whole numbers: the same paths.
    back = slice(None, None, -1)
    again = cslam.Estimator().estimate(sweep.iq[back], sweep.beams[back].tolist(), sweep.exponents[back].astype(np.int64))
    assert str(again) == str(paths)


def unaligned(array):
    """The same numbers at an odd address, as a field of a packed file has them."""
    place = np.zeros(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)
    place[...] = array
    assert not place.flags.aligned
    return place


def test_numbers_at_odd_addresses_and_in_columns_are_read_like_others(tmp_path, link, sweep, paths):
    parts = [unaligned(part) for part in (sweep.iq, sweep.beams, sweep.exponents)]
    assert str(cslam.Estimator().estimate(*parts)) == str(paths)
    cslam.write_sigmf(tmp_path / "sweep", *parts)
    np.testing.assert_array_equal(cslam.read_sigmf(tmp_path / "sweep").iq, sweep.iq)
    amplitudes = np.asfortranarray(sweep.iq[..., 0] + 1j * sweep.iq[..., 1])
    np.testing.assert_array_equal(cslam.quantize(unaligned(amplitudes))[0], cslam.quantize(amplitudes.copy("C"))[0])
    np.testing.assert_array_equal(cslam.quantize(amplitudes)[0], cslam.quantize(amplitudes.copy("C"))[0])
    columns = {name: unaligned(column) for name, column in paths.to_dict().items()}
    known = {"uav_m": unaligned(link.rx_m), "gmt_m": unaligned(link.tx_m)}
    np.testing.assert_array_equal(cslam.solve(columns, **known).position_m, cslam.solve(paths, **known).position_m)
    with pytest.raises(ValueError, match="iq: got >i2, expected int16"):
        cslam.Estimator().estimate(sweep.iq.astype(">i2"), sweep.beams, sweep.exponents)


def test_calls_of_one_estimator_stand_alone_and_threads_may_share_it(sweep, paths):
    estimator = cslam.Estimator()
    said = []
    work = lambda: said.append(str(estimator.estimate(sweep.iq, sweep.beams, sweep.exponents)))  # noqa: E731
    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert said == [str(paths)] * 4


def test_one_exponent_for_all_gives_other_paths(sweep, paths):
    assert len(set(sweep.exponents.tolist())) > 1
    wrong = np.full_like(sweep.exponents, sweep.exponents[0])
    assert str(cslam.Estimator().estimate(sweep.iq, sweep.beams, wrong)) != str(paths)


def test_complex_samples_are_converted_as_by_the_front_end(sweep, paths):
    amplitudes = (sweep.iq[..., 0] + 1j * sweep.iq[..., 1]) * np.ldexp(1.0, sweep.exponents)[:, None, None]
    samples, exponents = cslam.quantize(amplitudes)
    np.testing.assert_array_equal(samples, sweep.iq)
    np.testing.assert_array_equal(exponents, sweep.exponents)
    assert str(cslam.Estimator().estimate(amplitudes, sweep.beams)) == str(paths)
    assert len(cslam.Estimator().estimate(np.zeros((1, 32, 512), np.complex64), [0])) == 0


def test_published_method_and_following_sweeps(sweep, paths):
    assert len(cslam.Estimator(mode="paper").estimate(sweep.iq, sweep.beams, sweep.exponents)) > 0
    estimator = cslam.Estimator(follow=True)
    followed = [estimator.estimate(sweep.iq, sweep.beams, sweep.exponents) for _ in range(5)]
    # A following estimator learns the errors of its arrays from what it receives. It begins with more than a single
    # sweep is told, so a weak path close behind a strong one is not reported at once; these arrays have none, so a
    # few sweeps later the paths are those of a single sweep, and the claims on them narrow.
    assert abs(followed[0].c_tau_m[0] - paths.c_tau_m[0]) < 0.1
    assert len(followed[-1]) == len(paths)
    np.testing.assert_allclose(followed[-1].c_tau_m, paths.c_tau_m, atol=1e-3)
    np.testing.assert_allclose(followed[-1].aoa_body, paths.aoa_body, atol=1e-3)
    assert followed[-1].covariance[0, 0, 0] < followed[1].covariance[0, 0, 0]


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda a: a.update(iq=a["iq"][:, :31]), r"iq: got shape \[72, 31, 512, 2\], expected \[1 to 72, 32, 512, 2\]"),
        (lambda a: a.update(iq=a["iq"][0]), r"iq: got shape \[32, 512, 2\]"),
        (lambda a: a.update(iq=a["iq"].astype(np.int32)), "iq: got int32, expected int16"),
        (lambda a: a.update(iq=a["iq"][:0], beams=[], exponents=[]), "iq: got shape|got float64"),
        (lambda a: a.update(exponents=a["exponents"][:5]), r"exponents: got shape \[5\], expected \[72\]"),
        (lambda a: a.update(exponents=None), "exponents: got none, expected one a beam"),
        (lambda a: a.update(exponents=-38), r"exponents: got shape \[\], expected \[72\]"),
        (lambda a: a.update(exponents=a["exponents"] + 0.5), "exponents: got float64, expected whole numbers"),
        (lambda a: a.update(exponents=a["exponents"] + 500), "exponents: got .*, expected -100 to 100"),
        (lambda a: a.update(beams=a["beams"] + 1), "beams: got 72, expected 0 to 71"),
        (lambda a: a.update(beams=a["beams"] * 0), "beams: 0 comes twice"),
        (lambda a: a.update(beams=a["beams"].astype(int) - 1), "beams: got -1 to 70, expected 0 to 65535"),
        (lambda a: a.update(iq=np.zeros((72, 32, 512), complex)), "exponents: got some with complex samples"),
        (lambda a: a.update(iq=np.full((72, 32, 512), np.nan, complex), exponents=None), "iq: a sample is not finite"),
    ],
)
def test_wrong_arrays_are_refused_with_what_was_met_and_wanted(sweep, change, words):
    arguments = {"iq": sweep.iq, "beams": sweep.beams, "exponents": sweep.exponents}
    change(arguments)
    with pytest.raises(ValueError, match=words):
        cslam.Estimator().estimate(**arguments)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"mode": "worst"}, "mode: got \"worst\", expected one of best"),
        ({"false_alarms_per_sweep": 0.0}, "false_alarms_per_sweep: expected above 0"),
        ({"dynamic_range_db": float("nan")}, "dynamic_range_db: expected 0 to 120"),
        ({"gmt_heading_rad": float("inf")}, "gmt_heading_rad"),
        ({"mode": "paper", "follow": True}, "follow"),
    ],
)
def test_wrong_options_are_refused_by_name(options, words):
    with pytest.raises(ValueError, match=words):
        cslam.Estimator(**options)


def test_points_of_a_traced_link_are_where_the_wave_was_reflected(link):
    points = cslam.solve(link)
    first = (link.order == 1) & points.ok
    assert first.any()
    np.testing.assert_allclose(points.position_m[first], link.last_vertex_m[first], atol=1e-6)
    assert np.isnan(points.position_m[~points.ok]).all()
    assert "line of sight" not in points.verdict or 0 in link.order


def test_measured_paths_are_solved_in_the_pose(link, paths):
    known = {"uav_m": link.rx_m, "gmt_m": link.tx_m}
    level = cslam.solve(paths, **known, ground_z_m=0.0)
    assert level.ok.any()
    # The same arrivals seen from a nose that points elsewhere.
    turn = np.radians(40)
    matrix = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    turned = {**paths.to_dict(), "aoa_body": paths.aoa_body @ matrix.T}
    attitude = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    again = cslam.solve(turned, **known, attitude_wxyz=attitude, ground_z_m=0.0)
    assert again.verdict == level.verdict
    np.testing.assert_allclose(again.position_m, level.position_m, atol=1e-4)
    late = cslam.solve({**paths.to_dict(), "c_tau_m": paths.c_tau_m + 7.0}, **known, clock_offset_m=7.0, ground_z_m=0.0)
    np.testing.assert_allclose(late.position_m, level.position_m, atol=1e-4)


def test_probabilities_tell_orders_apart(link):
    p = cslam.classify(link)
    np.testing.assert_allclose(p.sum(axis=1), 1, atol=1e-6)
    assert (p.argmax(axis=1) == np.minimum(link.order, 2)).mean() > 0.5


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"uav_m": [1, 2]}, r"uav_m: got shape \[2\], expected \[3\]"),
        ({"uav_m": [1, 2, np.nan]}, "not finite"),
        ({"attitude_wxyz": [1, 0, 0, 0]}, "attitude_wxyz: got one with arrivals in world axes"),
        ({"bounds_m": [[1, 1, 1], [0, 2, 2]]}, "bounds_m"),
        ({"max_sigma_m": -1.0}, "max_sigma_m"),
        ({"ground_z_m": float("nan")}, "ground_z_m"),
    ],
)
def test_wrong_arguments_of_the_solver(link, arguments, words):
    with pytest.raises(ValueError, match=words):
        cslam.solve(link, **arguments)


def test_columns_of_your_own():
    own = {"c_tau_m": [46.818, np.nan], "aoa_world": [[-12, -20, -2], [1, 0, 0]]}
    points = cslam.solve(own, uav_m=[12, 40, 6], gmt_m=[12, 0, 2])
    assert points.verdict == ["ok", "input: a number is not finite"]
    np.testing.assert_allclose(points.position_m[0], [0, 20, 4], atol=0.01)
    with pytest.raises(ValueError, match="gmt_m: got none"):
        cslam.solve(own, uav_m=[0, 0, 0])
    with pytest.raises(ValueError, match=r"aoa_world: got shape \[1, 3\], expected \[2, 3\]"):
        cslam.solve({**own, "aoa_world": [[1, 0, 0]]}, uav_m=[0, 0, 0], gmt_m=[1, 0, 0])
    with pytest.raises(ValueError, match="expected a column aoa_world or aoa_body"):
        cslam.solve({"c_tau_m": [1.0]}, uav_m=[0, 0, 0], gmt_m=[1, 0, 0])
    assert cslam.classify({"c_tau_m": [], "aoa_world": np.zeros((0, 3))}, uav_m=[0, 0, 0], gmt_m=[1, 0, 0]).shape == (0, 3)


def test_scenes_and_links(tmp_path, link):
    scene = cslam.Scene("outdoor")
    assert scene.bounds_m.shape == (2, 3) and scene.frequency_hz == 30e9 and "outdoor" in repr(scene)
    links = scene.trace([[0, 0, 1.5]], [[56, 2, 6], [56, 3, 6]], max_order=1)
    assert len(links) == 2 and max(links[0].order, default=0) <= 1
    cslam.write_links(tmp_path / "links.jsonl", [link])
    (again,) = cslam.read_links(tmp_path / "links.jsonl")
    for name, column in link.to_dict().items():
        np.testing.assert_allclose(again.to_dict()[name], column, rtol=1e-12)
    for call, words in (
        (lambda: cslam.Scene("nowhere.json"), "nowhere.json"),
        (lambda: scene.trace([0, 0], [1, 1, 1]), r"tx_m: got shape \[1, 2\]"),
        (lambda: scene.trace([0, 0, 1], [0, 0, 1]), "both stand at"),
        (lambda: scene.trace([0, 0, 1], [5, 0, 1], max_order=9), "max_order"),
        (lambda: cslam.Link.from_json('{"tx": [0,0,0], "rx": [1,0,0], "paths": [{"delay_s": 1}]}'), "expected a key"),
    ):
        with pytest.raises(ValueError, match=words):
            call()


def test_recordings_are_read_as_they_were_written(tmp_path, sweep, paths):
    name = tmp_path / "sweep"
    cslam.write_sigmf(
        name,
        sweep.iq,
        sweep.beams,
        sweep.exponents,
        gmt_position_m=sweep.gmt_position_m,
        uav_position_m=sweep.uav_position_m,
        uav_quaternion_wb=sweep.uav_quaternion_wb,
    )
    again = cslam.read_sigmf(f"{name}.sigmf-meta")
    for field in ("iq", "beams", "exponents", "gmt_position_m", "uav_position_m", "uav_quaternion_wb"):
        np.testing.assert_array_equal(getattr(again, field), getattr(sweep, field))
    assert str(cslam.Estimator().estimate(again.iq, again.beams, again.exponents)) == str(paths)
    assert again.radio is None
    (tmp_path / "sweep.sigmf-data").write_bytes(b"short")
    with pytest.raises(ValueError, match="cut short"):
        cslam.read_sigmf(name)
    with pytest.raises(ValueError, match=r"iq: got float64 \[3\], expected int16"):
        cslam.write_sigmf(name, np.zeros(3), [0], [0])


def test_another_radio_goes_with_its_recording(tmp_path, sweep, paths):
    radio = {"waveform": {"root": 136}}
    cslam.write_sigmf(tmp_path / "other", sweep.iq, sweep.beams, sweep.exponents, radio=radio)
    read = cslam.read_sigmf(tmp_path / "other")
    assert read.radio["waveform"]["root"] == 136 and read.radio["waveform"]["carrier_hz"] == 30e9
    # The samples are of root 273: who listens for another one hears something else in them.
    heard = {root: cslam.Estimator(radio={"waveform": {"root": root}}) for root in (273, 136)}
    said = {root: str(estimator.estimate(read.iq, read.beams, read.exponents)) for root, estimator in heard.items()}
    assert said[273] == str(paths) and said[136] != str(paths)
    assert str(cslam.Estimator(radio=read.radio).estimate(read.iq, read.beams, read.exponents)) == said[136]
    with pytest.raises(ValueError, match="radio.waveform.root expected a number coprime"):
        cslam.Estimator(radio={"waveform": {"root": 818}})
    with pytest.raises(ValueError, match="radio: unknown field `carrier`"):
        cslam.Receiver(radio={"carrier": 1})


COMMAND = os.environ.get("CSLAM_COMMAND")


@pytest.mark.skipif(COMMAND is None, reason="CSLAM_COMMAND names no cslam")
def test_a_recorded_flight_is_flown_as_by_the_command(tmp_path):
    run = lambda *words: subprocess.run([COMMAND, *words], check=True, capture_output=True, text=True).stdout  # noqa: E731
    recording, ours, theirs = (str(tmp_path / name) for name in ("recording", "ours", "theirs"))
    run("record", "--scene", "outdoor", "--steps", "12", "--out", recording)
    flight = cslam.fly(recording, ours)
    report = json.loads(run("fly", "--recording", recording, "--out", theirs, "--json"))
    for told in (flight.report, report):
        told.pop("elapsed_s")
    assert flight.report == report
    for name in ("packets.bin", "trajectory.tum", "map.ply"):
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    assert flight.trajectory.shape[1] == 8 and {"x", "y", "z"} <= set(flight.map)
    packets = cslam.read_packets(tmp_path / "ours" / "packets.bin", test_key=True)
    lines = run("ground", "--file", str(tmp_path / "ours" / "packets.bin"), "--test-key", "--json").splitlines()
    assert packets == [json.loads(line) for line in lines] and packets
    assert flight.smoothed is None and cslam.fly(recording, sweeps=3).directory is None
    with pytest.raises(ValueError, match="expected one of keys"):
        cslam.read_packets(tmp_path / "ours" / "packets.bin")
    with pytest.raises(ValueError, match="nowhere"):
        cslam.fly(tmp_path / "nowhere", tmp_path / "out")


@pytest.mark.skipif(COMMAND is None, reason="CSLAM_COMMAND names no cslam")
def test_links_of_another_tracer_are_recorded_as_by_the_command(tmp_path):
    links, ours, theirs = (tmp_path / name for name in ("links.jsonl", "ours", "theirs"))
    words = ["trace", "--scene", "outdoor", "--flight", "1", "--duration", "17", "--out", links]
    subprocess.run([COMMAND, *words], check=True, capture_output=True)
    told = cslam.record(ours, channel=links, sweeps=4)
    words = ["record", "--channel", links, "--steps", "4", "--out", theirs, "--json"]
    assert told == json.loads(subprocess.run([COMMAND, *words], check=True, capture_output=True).stdout)
    assert told["world"] == "real" and told["files"]


@pytest.mark.skipif(COMMAND is None, reason="CSLAM_COMMAND names no cslam")
def test_a_flight_is_smoothed_as_by_the_command(tmp_path):
    run = lambda *words: subprocess.run([COMMAND, *words], check=True, capture_output=True, text=True).stdout  # noqa: E731
    recording, flown, theirs = (str(tmp_path / name) for name in ("recording", "flown", "theirs"))
    # In twenty seconds of the default world there may be no map.
    run("fly", "--world", "budget", "--scene", "outdoor", "--steps", "40", "--keep-paths", recording, "--out", flown)
    flight = cslam.fly(recording, tmp_path / "ours", smooth=True)
    report = json.loads(run("fly", "--recording", recording, "--smooth", "--export", "npz", "--out", theirs, "--json"))
    assert flight.report["smoothed"] == report["smoothed"] is not None
    for name in ("trajectory.tum", "trajectory_smoothed.tum", "map_smoothed.ply"):
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    smoothed = flight.smoothed
    assert smoothed.trajectory.shape == flight.trajectory.shape and len(smoothed.map["x"]) > 0
    assert np.abs(smoothed.trajectory - flight.trajectory).max() > 1e-3
    columns = np.load(tmp_path / "theirs" / "flight.npz", allow_pickle=False)
    known = np.isfinite(columns["smoothed_pose_position_m"][:, 0])
    np.testing.assert_allclose(columns["smoothed_pose_position_m"][known], smoothed.trajectory[:, 1:4], atol=1e-5)
    np.testing.assert_allclose(columns["smoothed_pose_quaternion_wb"][known][:, [1, 2, 3, 0]], smoothed.trajectory[:, 4:], atol=1e-5)
    np.testing.assert_allclose(columns["smoothed_map_position_m"], np.stack([smoothed.map[axis] for axis in "xyz"], axis=1), atol=1e-5)
