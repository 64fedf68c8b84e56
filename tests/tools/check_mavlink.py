"""Reads the ground station's MAVLink with pymavlink and compares it with what the UAVs said.

    check_mavlink.py frd|ned '{"system": N, "poses": [...]}'

UAVs 1 and 2 are made up (host-sim/src/ground/flock.rs), UAV N says the poses, in east-north-up and forward-left-up axes, in their order.
Everything that is expected is computed here, from these. Prints the UDP port it listens on, then what it found; ends with 0 when all of it
is right.
"""

import json
import math
import socket
import sys
import time

from pymavlink.dialects.v20 import ardupilotmega as mavlink

# Only a broken station takes so long, however busy the machine is.
PATIENCE_S = 120
WANTED = {"HEARTBEAT", "ODOMETRY", "ESTIMATOR_STATUS", "OBSTACLE_DISTANCE_3D", "STATUSTEXT"}
FRAME = {"frd": mavlink.MAV_FRAME_LOCAL_FRD, "ned": mavlink.MAV_FRAME_LOCAL_NED}[sys.argv[1]]
SAID = json.loads(sys.argv[2])

listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
listener.bind(("127.0.0.1", 0))
listener.settimeout(1)
print(listener.getsockname()[1], flush=True)

parser = mavlink.MAVLink(None)
parser.robust_parsing = False
counts, sequences, last, problems, scripted = {}, {}, {}, [], []


def must(condition, message):
    if not condition:
        problems.append(message)


def near(a, b, tolerance):
    return abs(a - b) <= tolerance


def all_near(a, b, tolerance):
    return len(a) == len(b) and all(near(x, y, tolerance) for x, y in zip(a, b))


def matrix(q):
    """Rotation matrix of the quaternion w, x, y, z, row by row."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def transposed(m):
    return tuple(zip(*m))


def product(a, b):
    return tuple(tuple(sum(x * y for x, y in zip(row, column)) for column in zip(*b)) for row in a)


def turned(m, v):
    return [sum(a * b for a, b in zip(row, v)) for row in m]


def rotate(q, v):
    """Vector of the body in the world, by the quaternion w, x, y, z."""
    return turned(matrix(q), v)


# East-north-up to north-east-down, and forward-left-up to forward-right-down.
NED = ((0, 1, 0), (1, 0, 0), (0, 0, -1))
FRD = ((1, 0, 0), (0, -1, 0), (0, 0, -1))


def covariance(spread):
    (x, y, z), (xy, xz, yz) = spread["sigma"], spread["correlation"]
    return ((x * x, xy * x * y, xz * x * z), (xy * x * y, y * y, yz * y * z), (xz * x * z, yz * y * z, z * z))


def turned_covariance(m, spread):
    return product(product(m, covariance(spread)), transposed(m))


def places(first, second):
    """The 21 places of a 6 x 6 covariance of two blocks, upper triangle row by row: the diagonal is at 0, 6, 11, 15, 18, 20."""
    full = [list(row) + [0] * 3 for row in first] + [[0] * 3 + list(row) for row in second]
    return [full[i][j] for i in range(6) for j in range(i, 6)]


def check_covariance(name, found, expected):
    for index, (a, b) in enumerate(zip(found, expected)):
        # Single precision, and what the packet's quaternion and correlations are rounded by.
        must(near(a, b, 2e-3 * max(expected)), f"{name}[{index}] is {a}, not {b}")


def check_odometry(m, said):
    """What a pose must have become."""
    must(m.time_usec == said["time_us"], f"time {m.time_usec}")
    must(m.frame_id == FRAME, f"frame_id {m.frame_id}, not {FRAME}")
    must(m.child_frame_id == mavlink.MAV_FRAME_BODY_FRD, f"child_frame_id {m.child_frame_id}")
    must(m.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_VIO, f"estimator_type {m.estimator_type}")
    must(m.quality == said["quality"], f"quality {m.quality}, not {said['quality']} at {said['time_us']} us")
    must(m.reset_counter == said["jumps"], f"reset_counter {m.reset_counter}, not {said['jumps']} at {said['time_us']} us")
    position, velocity = said["position_m"], said["velocity_m_per_s"]
    must(all_near((m.x, m.y, m.z), turned(NED, position), 2e-3), f"position {m.x, m.y, m.z} for {position}")
    to_world = matrix(said["quaternion_wb"])
    attitude = product(product(NED, to_world), FRD)
    must(near(math.hypot(*m.q), 1, 1e-5), f"length of the quaternion {m.q}")
    for row, expected in zip(matrix(m.q), attitude):
        must(all_near(row, expected, 1e-3), f"attitude: {row}, not {expected}")
    yaw = math.atan2(attitude[1][0], attitude[0][0])
    w, x, y, z = m.q
    off = math.remainder(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) - yaw, math.tau)
    must(near(off, 0, 2e-3), f"yaw is off by {off} rad")
    to_body = product(FRD, transposed(to_world))
    must(all_near((m.vx, m.vy, m.vz), turned(to_body, velocity), 0.02), f"velocity {m.vx, m.vy, m.vz} for {velocity}")
    rates = (m.rollspeed, m.pitchspeed, m.yawspeed)
    must(all(math.isnan(rate) for rate in rates), f"angular rates {rates} that nobody measured")
    none = ((0,) * 3,) * 3
    pose = places(turned_covariance(NED, said["position"]), none)
    check_covariance("pose_covariance", m.pose_covariance[:15], pose[:15])
    # Apart, because they are so much smaller.
    attitude = places(none, turned_covariance(to_body, said["attitude"]))
    check_covariance("attitude in pose_covariance", m.pose_covariance[15:], attitude[15:])
    check_covariance("velocity_covariance", m.velocity_covariance, places(turned_covariance(to_body, said["velocity"]), none))


def made_up(system, time_us):
    """UAVs 1 and 2 fly on a circle about the origin, level, nose along their way."""
    turn = 0.05 * time_us / 1e6 + system
    radius, height, heading = 15 + 0.35 * system, 8 + 0.2 * (system % 50), turn + math.pi / 2
    # The steps of the packets' standard deviations that are nearest to theirs; correlations are in steps of 1/127.
    spread = lambda sigma: {"sigma": [sigma] * 3, "correlation": (13 / 127, 0, -13 / 127)}
    return {
        "time_us": time_us,
        "position_m": (radius * math.cos(turn), radius * math.sin(turn), height),
        "velocity_m_per_s": (0.05 * radius * math.cos(heading), 0.05 * radius * math.sin(heading), 0),
        "quaternion_wb": (math.cos(heading / 2), 0, 0, math.sin(heading / 2)),
        "position": spread(0.1024),
        "velocity": spread(0.0512),
        "attitude": spread(0.0001 * 2 ** (39 / 8)),
        "quality": 100,
        "jumps": 0,
    }


def scripted_poses():
    """The poses of UAV N with the quality and the count of jumps that they ask for."""
    jumps, before = 0, None
    for said in SAID["poses"]:
        if before:
            jumps += said["resets"] != before["resets"] or before["lost"] and not said["lost"]
        order = (("lost", -1), ("contested", 10), ("dead_reckoning", 30))
        quality = next((quality for flag, quality in order if said[flag]), 100)
        before = said
        yield said | {"quality": quality, "jumps": jumps}


def check(m):
    system, kind = m.get_srcSystem(), m.get_type()
    must(system in (1, 2, SAID["system"]), f"system {system}")
    must(m.get_srcComponent() == mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY, "component")
    expected = sequences.get(system)
    must(expected is None or m.get_seq() == expected, f"sequence {m.get_seq()} for {expected}")
    sequences[system] = (m.get_seq() + 1) % 256
    counts[kind] = counts.get(kind, 0) + 1
    last[(system, kind)] = m
    if kind == "ODOMETRY":
        if system == SAID["system"]:
            scripted.append(m)
        else:
            check_odometry(m, made_up(system, m.time_usec))
    elif kind == "HEARTBEAT":
        must(m.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER and m.autopilot == mavlink.MAV_AUTOPILOT_INVALID, f"{m}")
        must(m.mavlink_version == 3, f"{m}")
    elif kind == "ESTIMATOR_STATUS" and system != SAID["system"]:
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
    done = len(scripted) >= len(SAID["poses"]) and WANTED <= set(counts)
    if done and counts["ODOMETRY"] > 50 and counts["ESTIMATOR_STATUS"] > 5:
        break
must(WANTED <= set(counts), f"missing {WANTED - set(counts)}")
expected = list(scripted_poses())
must(len(scripted) == len(expected), f"{len(scripted)} poses of system {SAID['system']}, not {len(expected)}")
for message, said in zip(scripted, expected):
    check_odometry(message, said)
print(f"read by pymavlink with frame {sys.argv[1]}:", counts)
for problem in problems:
    print("PROBLEM", problem)
raise SystemExit(1 if problems else 0)
