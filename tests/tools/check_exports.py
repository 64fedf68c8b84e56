#!/usr/bin/env python3
"""Reads flight.npz with NumPy and flight.ros2.mcap with two readers of ROS 2, and compares them with report.json and with each other.

No ROS is needed. Ends with 1 when a file does not load or a figure differs.
"""

import json
import sys
from pathlib import Path

import numpy as np
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

failures = 0


def check(name, good):
    """Prints a line, and counts a failure."""
    global failures
    failures += not good
    print(f"{'ok  ' if good else 'FAIL'} {name}")


def close(name, ours, theirs, tolerance=1e-6):
    ours, theirs = np.asarray(ours, dtype=float), np.asarray(theirs, dtype=float)
    same = ours.shape == theirs.shape and np.allclose(ours, theirs, rtol=tolerance, atol=tolerance, equal_nan=True)
    check(f"{name}: {np.array2string(ours.ravel()[:3], precision=4)} {ours.shape}", same)


def columns(out, report):
    """The columns, compared with the report."""
    with np.load(out / "flight.npz", allow_pickle=False) as file:
        flight = {name: file[name] for name in file.files}
    lengths = {}
    for name, column in flight.items():
        lengths.setdefault(name.split("_")[0], set()).add(len(column))
    check(f"rows of a kind are as many: {lengths}", all(len(some) == 1 for some in lengths.values()))
    check("kinds of rows", set(lengths) == {"pose", "sweep", "path", "point", "map", "imu"})
    flown = report["trajectory"]
    known = np.isfinite(flight["pose_position_m"][:, 0]) & np.isfinite(flight["pose_true_position_m"][:, 0])
    close("poses (npz)", flown["poses"], known.sum())
    error = np.linalg.norm((flight["pose_position_m"] - flight["pose_true_position_m"])[known], axis=1)
    close("position, rms, m (npz)", flown["position_rmse_m"], np.sqrt(np.mean(error**2)), 1e-3)
    close("quaternions are of length one", np.linalg.norm(flight["pose_quaternion_wb"][known], axis=1), np.ones(known.sum()))
    close("accepted points (npz)", report["map"]["accepted"], len(flight["point_sweep"]))
    close("hits of the map (npz)", report["map"]["accepted"], flight["map_hits"].sum())
    close("sweeps (npz)", report["sweeps"], len(flight["sweep_number"]))
    accepted = np.char.startswith(flight["path_verdict"], "ok")
    points = set(zip(flight["point_sweep"].tolist(), flight["point_path"].tolist()))
    close("paths whose verdict is ok (npz)", len(points), accepted.sum())
    return flight


def stamp(header):
    return header.stamp.sec + header.stamp.nanosec * 1e-9


def position(message):
    at = message.pose.pose.position
    return [at.x, at.y, at.z]


def cloud(message):
    """A PointCloud2 as an array with named columns."""
    layout = {
        "names": [field.name for field in message.fields],
        "formats": [{7: "<f4", 6: "<u4"}[field.datatype] for field in message.fields],
        "offsets": [field.offset for field in message.fields],
        "itemsize": message.point_step,
    }
    points = np.frombuffer(bytes(message.data), dtype=np.dtype(layout))
    check(f"a cloud of {len(points)} points says so", message.width == len(points) and message.row_step == len(message.data))
    return points


def ros2(name, messages, flight):
    """Messages of a reader, by topic, compared with the columns."""
    known = np.isfinite(flight["pose_position_m"][:, 0])
    odometry = messages["/odometry"]
    close(f"{name}: times, s", flight["pose_time_s"][known], [stamp(m.header) for m in odometry])
    close(f"{name}: positions, m", flight["pose_position_m"][known], [position(m) for m in odometry])
    turned = [m.pose.pose.orientation for m in odometry]
    close(f"{name}: attitudes", flight["pose_quaternion_wb"][known], [[q.w, q.x, q.y, q.z] for q in turned])
    covariances = np.array([m.pose.covariance for m in odometry]).reshape(-1, 6, 6)
    close(f"{name}: covariance of the position", flight["pose_position_covariance_m2"][known].reshape(-1, 3, 3), covariances[:, :3, :3])
    close(f"{name}: covariance of the attitude", flight["pose_attitude_covariance_rad2"][known].reshape(-1, 3, 3), covariances[:, 3:, 3:])
    speed = [np.linalg.norm([m.twist.twist.linear.x, m.twist.twist.linear.y, m.twist.twist.linear.z]) for m in odometry]
    close(f"{name}: speed, m/s", np.linalg.norm(flight["pose_velocity_m_per_s"][known], axis=1), speed)
    # Turned back into the world it is the velocity.
    w, x, y, z = flight["pose_quaternion_wb"][known].T
    v = np.array([[m.twist.twist.linear.x, m.twist.twist.linear.y, m.twist.twist.linear.z] for m in odometry])
    u = np.stack([x, y, z], axis=1)
    back = v + 2 * np.cross(u, np.cross(u, v) + w[:, None] * v)
    close(f"{name}: velocity in the world, m/s", flight["pose_velocity_m_per_s"][known], back)
    check(f"{name}: frames", {(m.header.frame_id, m.child_frame_id) for m in odometry} == {("map", "base_link")})
    truths = np.isfinite(flight["pose_true_position_m"][:, 0])
    close(f"{name}: true positions, m", flight["pose_true_position_m"][truths], [position(m) for m in messages["/truth/odometry"]])
    points = np.concatenate([cloud(m) for m in messages["/points"]])
    close(f"{name}: points, m", flight["point_position_m"].astype("f4"), np.stack([points[axis] for axis in "xyz"], axis=1))
    mapped = cloud(messages["/map"][0])
    close(f"{name}: hits of the map", flight["map_hits"], mapped["hits"])
    rates = [[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for m in messages["/imu"]]
    close(f"{name}: rates, rad/s", flight["imu_rate_rad_per_s"], rates)
    forces = [m.linear_acceleration.z for m in messages["/imu"]]
    close(f"{name}: specific force along z, m/s^2", flight["imu_specific_force_m_per_s2"][:, 2], forces)
    check(f"{name}: no orientation by the inertial sensor", messages["/imu"][0].orientation_covariance[0] == -1)
    frames = {t.child_frame_id for m in messages["/tf"] for t in m.transforms}
    check(f"{name}: transforms of {sorted(frames)}", frames == {"base_link", "gmt"})


def by_mcap(file):
    messages = {}
    for message in read_ros2_messages(str(file)):
        messages.setdefault(message.channel.topic, []).append(message.ros_msg)
    return messages


def by_rosbags(file):
    messages = {}
    with AnyReader([file]) as reader:
        for connection, _, data in reader.messages():
            messages.setdefault(connection.topic, []).append(reader.deserialize(data, connection.msgtype))
    return messages


def main():
    out = Path(sys.argv[1])
    flight = columns(out, json.loads((out / "report.json").read_text()))
    file = out / "flight.ros2.mcap"
    ros2("mcap-ros2-support", by_mcap(file), flight)
    ros2("rosbags", by_rosbags(file), flight)
    print(f"{failures} of the checks failed")
    sys.exit(failures > 0)


main()
