#!/usr/bin/env python3
"""Reads the files of a flight with the tools of the field and compares their figures with report.json.

Trajectories: evo (library, evo_ape and evo_traj). Clouds: Open3D and plyfile. Recording: the mcap reader with its
protobuf decoder. Ends with 1 when a file does not load or a figure differs by more than 1 %.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import open3d
from evo.core import metrics, sync
from evo.tools import file_interface
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from plyfile import PlyData

TOLERANCE = 0.01
failures = 0


def compare(name, ours, theirs):
    """Prints a line, and counts a failure when the two differ by more than the tolerance."""
    global failures
    apart = abs(ours - theirs) / max(abs(ours), 1e-12) if ours is not None else float("inf")
    good = apart <= TOLERANCE or abs(ours - theirs) < 1e-6
    failures += not good
    print(f"{'ok  ' if good else 'FAIL'} {name:<52} ours {ours:<12.6g} theirs {theirs:<12.6g} apart {100 * apart:.3f} %")


def count(name, ours, theirs):
    """Two numbers of things must be the same."""
    check(f"{name}: ours {ours}, theirs {theirs}", ours == theirs)


def check(name, good):
    """Prints a line, and counts a failure."""
    global failures
    failures += not good
    print(f"{'ok  ' if good else 'FAIL'} {name}")


def trajectories(out, flown):
    truth = file_interface.read_tum_trajectory_file(out / "truth.tum")
    estimate = file_interface.read_tum_trajectory_file(out / "trajectory.tum")
    check("evo finds both trajectories valid", truth.check()[0] and estimate.check()[0])
    truth, estimate = sync.associate_trajectories(truth, estimate)
    count("poses (evo)", flown["poses"], estimate.num_poses)

    def error(metric, trajectory):
        metric.process_data((truth, trajectory))
        return metric.get_statistic(metrics.StatisticsType.rmse)

    translation, angle = metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_deg
    compare("position, rms, m (evo APE)", flown["position_rmse_m"], error(metrics.APE(translation), estimate))
    compare("attitude, rms, deg (evo APE)", flown["attitude_rmse_deg"], error(metrics.APE(angle), estimate))
    for name, delta in (("rpe", 1), ("rpe_1s", round(1.0 / float(np.median(np.diff(truth.timestamps)))))):
        relative = lambda relation: metrics.RPE(relation, delta, metrics.Unit.frames, all_pairs=True)
        compare(f"{name} over {delta} poses, m (evo RPE)", flown[f"{name}_rmse_m"], error(relative(translation), estimate))
        compare(f"{name} over {delta} poses, deg (evo RPE)", flown[f"{name}_rmse_deg"], error(relative(angle), estimate))
    aligned = file_interface.read_tum_trajectory_file(out / "trajectory.tum")
    _, aligned = sync.associate_trajectories(truth, aligned)
    aligned.align(truth)
    compare("position aligned, rms, m (evo APE)", flown["position_aligned_rmse_m"], error(metrics.APE(translation), aligned))

    tools = Path(sys.executable).parent
    said = subprocess.run(
        [tools / "evo_ape", "tum", out / "truth.tum", out / "trajectory.tum"], capture_output=True, text=True, check=True
    ).stdout
    compare("position, rms, m (evo_ape)", flown["position_rmse_m"], float(re.search(r"rmse\s+([\d.e+-]+)", said)[1]))
    said = subprocess.run(
        [tools / "evo_traj", "tum", out / "trajectory.tum", "--ref", out / "truth.tum"], capture_output=True, text=True, check=True
    ).stdout
    poses = int(re.search(r"trajectory\W+infos:\s+(\d+) poses", said)[1])
    count("poses (evo_traj)", flown["poses"], poses)


def recording(out):
    """All messages by topic, in order."""
    messages = {}
    with open(out / "flight.mcap", "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        check("mcap finds the index", reader.get_summary() is not None)
        for schema, channel, message in reader.iter_messages():
            value = (
                json.loads(message.data)
                if channel.message_encoding == "json"
                else DecoderFactory().decoder_for(channel.message_encoding, schema)(message.data)
            )
            messages.setdefault(channel.topic, []).append(value)
    return messages


def cloud_of(message):
    """A PointCloud message as an array with named columns."""
    kinds = {7: "<f4", 5: "<u4"}
    layout = {
        "names": [f.name for f in message.fields],
        "formats": [kinds[f.type] for f in message.fields],
        "offsets": [f.offset for f in message.fields],
        "itemsize": message.point_stride,
    }
    return np.frombuffer(message.data, dtype=np.dtype(layout))


def clouds(out, figures, messages):
    counts = {"map.ply": figures["points"], "points.ply": figures["accepted"]}
    for name in ("map.ply", "points.ply", "map_truth.ply"):
        points = np.asarray(open3d.io.read_point_cloud(str(out / name)).points)
        vertices = PlyData.read(str(out / name))["vertex"]
        check(f"{name}: Open3D and plyfile read the same {len(points)} points", len(points) == vertices.count)
        same = all(np.array_equal(points[:, k].astype(np.float32), vertices[axis]) for k, axis in enumerate("xyz"))
        check(f"{name}: and the same coordinates", same)
        if name in counts:
            count(f"{name}: points (Open3D)", counts[name], len(points))
            tensor = open3d.t.io.read_point_cloud(str(out / name)).point
            wanted = {"covariance_trace", "probability", "time_s", "snr_db", "gmt_index", "hits"}
            check(f"{name}: Open3D keeps the attributes", wanted <= {key for key, _ in tensor.items()})
            check(f"{name}: covariances are positive", bool((vertices["covariance_trace"] > 0).all()))

    vertices = PlyData.read(str(out / "map.ply"))["vertex"]
    count("hits in the map sum to the accepted points", figures["accepted"], int(vertices["hits"].sum()))
    recorded = cloud_of(messages["/map"][-1])
    same = all(np.array_equal(recorded[axis], vertices[axis]) for axis in ("x", "y", "z", "covariance_trace", "hits"))
    check("the map in the recording is that of map.ply", same)

    # The scene's triangles are in the recording: Open3D measures the distances to them.
    corners = [(p.x, p.y, p.z) for t in messages["/scene"][0].entities[0].triangles for p in t.points]
    scene = open3d.t.geometry.RaycastingScene()
    triangles = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    scene.add_triangles(np.array(corners, dtype=np.float32), triangles)
    points = np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float32)
    distances = scene.compute_distance(points).numpy()
    compare("map to surface, median, m (Open3D)", figures["surface_median_m"], float(np.median(distances)))
    compare("map to surface, rms, m (Open3D)", figures["surface_rmse_m"], float(np.sqrt((distances**2).mean())))
    compare("map within 0.2 m of a surface (Open3D)", figures["precision_0p2m"], float((distances <= 0.2).mean()))
    compare("map within 0.5 m of a surface (Open3D)", figures["precision_0p5m"], float((distances <= 0.5).mean()))


def series(report, messages):
    flown = report["trajectory"]
    count("poses (mcap)", flown["poses"], len(messages["/pose"]))
    count("sweeps (mcap)", report["sweeps"], len(messages["/link_state"]))
    rms = lambda values: float(np.sqrt(np.mean(np.square(values))))
    errors = messages["/errors"]
    compare("position, rms, m (mcap /errors)", flown["position_rmse_m"], rms([e["position_m"] for e in errors]))
    compare("clock, rms, ns (mcap /errors)", report["clock"]["rmse_ns"], rms([e["clock_ns"] for e in errors]))
    accepted = sum(state["accepted"] for state in messages["/link_state"])
    count("accepted points (mcap /link_state)", report["map"]["accepted"], accepted)
    told = [(s["state"], s["true_state"]) for s in messages["/link_state"] if s["state"] is not None]
    right = sum(a == b for a, b in told) / len(told)
    compare("link state right (mcap /link_state)", report["link_state"]["accuracy"], right)
    check("the filter's innovations are there", any(topic.startswith("/innovations/") for topic in messages))
    last = {t.child_frame_id: t for message in messages["/tf"] for t in message.transforms}
    check("frames body, body_true and gmt stand in the world", {"body", "body_true", "gmt"} <= set(last))


def main():
    out = Path(sys.argv[1])
    report = json.loads((out / "report.json").read_text())
    trajectories(out, report["trajectory"])
    messages = recording(out)
    clouds(out, report["map"], messages)
    series(report, messages)
    print(f"{failures} of the checks failed")
    sys.exit(failures > 0)


main()
