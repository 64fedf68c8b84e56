"""Reads the ground station's MAVLink with pymavlink and compares it with what the made-up UAVs say.

Prints the UDP port it listens on, then what it found; ends with 0 when all of it is right.
"""

import math
import socket
import time

from pymavlink.dialects.v20 import ardupilotmega as mavlink

PATIENCE_S = 20
WANTED = {"HEARTBEAT", "ODOMETRY", "ESTIMATOR_STATUS", "OBSTACLE_DISTANCE_3D", "STATUSTEXT"}

listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
listener.bind(("127.0.0.1", 0))
listener.settimeout(1)
print(listener.getsockname()[1], flush=True)

parser = mavlink.MAVLink(None)
parser.robust_parsing = False
counts, sequences, last, problems = {}, {}, {}, []


def must(condition, message):
    if not condition:
        problems.append(message)


def near(a, b, tolerance):
    return abs(a - b) <= tolerance


def rotate(q, v):
    """Vector of the body in the world, by the quaternion w, x, y, z."""
    w, x, y, z = q
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return [sum(r * c for r, c in zip(row, v)) for row in rows]


def check_odometry(system, m):
    """UAV `system` flies on a circle about the origin, level, nose along its way (host-sim/src/ground/flock.rs)."""
    t = m.time_usec / 1e6
    turn = 0.05 * t + system
    radius, height = 15 + 0.35 * system, 8 + 0.2 * (system % 50)
    east, north, heading = radius * math.cos(turn), radius * math.sin(turn), turn + math.pi / 2
    must((m.frame_id, m.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD), f"frames {m}")
    must(near(m.x, north, 2e-3) and near(m.y, east, 2e-3) and near(m.z, -height, 2e-3), f"position {m.x, m.y, m.z}")
    # North-east-down: the compass course of the nose.
    nose = rotate(m.q, (1, 0, 0))
    must(near(nose[0], math.sin(heading), 1e-3) and near(nose[1], math.cos(heading), 1e-3), f"nose {nose} at {t}")
    must(near(rotate(m.q, (0, 0, 1))[2], 1, 1e-3), "the belly looks down")
    speed = 0.05 * radius
    must(near(m.vx, speed, 0.02) and near(m.vy, 0, 0.02) and near(m.vz, 0, 0.02), f"velocity {m.vx, m.vy, m.vz}")
    # Row by row from the diagonal: x at 0, y at 6, z at 11, roll, pitch, yaw at 15, 18, 20. The quantised sigmas are 0.1024 m,
    # 0.0512 m/s and 0.00293 rad, the correlation of east and north 13/127 and of north and up -13/127.
    pose, velocity, shared = m.pose_covariance, m.velocity_covariance, 13 / 127
    for index in (0, 6, 11):
        must(near(pose[index], 0.010486, 1e-5), f"variance {index}: {pose[index]}")
    # The velocity's are turned into the body: what east and north share is forward's gain and right's loss.
    turned = shared * math.sin(2 * heading)
    for index, factor in ((0, 1 + turned), (6, 1 - turned), (11, 1)):
        must(near(velocity[index], 0.0026214 * factor, 1e-5), f"velocity variance {index}: {velocity[index]} at {heading}")
    for index in (15, 18, 20):
        must(near(pose[index], 8.61e-6, 2e-8), f"attitude variance {index}: {pose[index]}")
    # North with east as before; north with up is minus what it is with down, and east with up was none.
    covariances = (pose[1], pose[2], pose[7])
    must(all(near(a, b, 1e-5) for a, b in zip(covariances, (0.0010734, 0.0010734, 0))), f"covariances {covariances}")
    must(m.reset_counter == 0 and m.quality == 100, f"reset counter, quality {m.reset_counter, m.quality}")


def check(m):
    system, kind = m.get_srcSystem(), m.get_type()
    must(system in (1, 2), f"system {system}")
    must(m.get_srcComponent() == mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY, "component")
    expected = sequences.get(system)
    must(expected is None or m.get_seq() == expected, f"sequence {m.get_seq()} for {expected}")
    sequences[system] = (m.get_seq() + 1) % 256
    counts[kind] = counts.get(kind, 0) + 1
    last[(system, kind)] = m
    if kind == "ODOMETRY":
        check_odometry(system, m)
    elif kind == "HEARTBEAT":
        must(m.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER and m.autopilot == mavlink.MAV_AUTOPILOT_INVALID, f"{m}")
        must(m.mavlink_version == 3, f"{m}")
    elif kind == "ESTIMATOR_STATUS":
        must(m.flags == 1 + 2 + 4 + 8 + 32, f"flags {m.flags}")
        must(near(m.pos_horiz_accuracy, 0.1414, 0.01) and near(m.pos_vert_accuracy, 0.1, 0.01), f"{m}")
    elif kind == "OBSTACLE_DISTANCE_3D":
        must(m.frame == mavlink.MAV_FRAME_BODY_FRD, f"{m}")
        must(m.min_distance == 0.5 and m.max_distance == 600, f"{m}")
        pose = last.get((system, "ODOMETRY"))
        if pose:
            # Back in the world it lies on a wall of the block, 60 m from the middle, between the ground and 20 m.
            north, east, down = (a + b for a, b in zip(rotate(pose.q, (m.x, m.y, m.z)), (pose.x, pose.y, pose.z)))
            must(near(max(abs(north), abs(east)), 60, 1) and -20.5 < down < 0.5, f"obstacle at {north, east, down}")
    elif kind == "STATUSTEXT":
        must(m.severity == mavlink.MAV_SEVERITY_INFO, f"{m}")
        must(m.text == "pose set for the first time", f"text {m.text!r}")


end = time.monotonic() + PATIENCE_S
while time.monotonic() < end and len(problems) < 10:
    try:
        data = listener.recv(4096)
    except TimeoutError:
        continue
    for message in parser.parse_buffer(data) or []:
        check(message)
    if WANTED <= set(counts) and counts["ODOMETRY"] > 50 and counts["ESTIMATOR_STATUS"] > 5:
        break
must(WANTED <= set(counts), f"missing {WANTED - set(counts)}")
print("read by pymavlink:", counts)
for problem in problems:
    print("PROBLEM", problem)
raise SystemExit(1 if problems else 0)
