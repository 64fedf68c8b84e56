"""Writes a recorded flight of a small world of its own: python write_recording.py DIR [SEED]

Everything here is from docs/formats.md ("Scenes", "Path lists", "Recordings of samples", "Recorded flights"); nothing of the project
is imported. The world is a wall and the ground, which go into DIR/scene.json: a GMT stands still, a UAV rests and then flies a curve,
turning. Waves go in line of sight, over the wall, over the ground, and over both.
"""

import json
import pathlib
import sys
import zlib

import numpy as np

C, CARRIER_HZ, RATE_HZ, SAMPLES = 299792458.0, 30e9, 245.76e6, 512
SUBCARRIERS = np.arange(-208, 208)
F_HZ = SUBCARRIERS * RATE_HZ / SAMPLES
PLACES = np.arange(8) - 3.5
BEAM_PERIOD_S = 2 * SAMPLES / RATE_HZ
G = 9.80665

# The world: planes as (point, normal), what they are of, where the GMT stands, the earth's field.
GROUND = (np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
WALL = (np.array([0.0, 22.0, 0.0]), np.array([0.0, -1.0, 0.0]))
WAYS = [(), (WALL,), (GROUND,), (WALL, GROUND)]
PERMITTIVITY = 6.0
SCENE = {
    "name": "wall and ground",
    "units": "metre",
    "material": {"relative_permittivity": PERMITTIVITY, "conductivity_S_per_m": 0.0, "model": "half-space"},
    "frequency_hz": CARRIER_HZ,
    "faces": [
        {"vertices": [[-60, -60, 0], [60, -60, 0], [60, 22, 0], [-60, 22, 0]], "normal": [0, 0, 1]},
        {"vertices": [[-60, 22, 0], [60, 22, 0], [60, 22, 30], [-60, 22, 30]], "normal": [0, -1, 0]},
    ],
}
GMT_M = np.array([0.0, 0.0, 1.5])
FIELD = {"strength_ut": 48.0, "inclination_deg": 65.0, "declination_deg": 3.0}
REST_S, FLIGHT_S, PERIOD_S = 3.0, 20.0, 0.5
# The UAV's clock: what it is ahead of the GMT's at first, s, and its rate.
CLOCK_S, DRIFT = -1.4e-6, 2e-7


def motion(t):
    """Place, velocity, yaw and yaw rate of the UAV at GMT times t: at rest, then along a curve that starts and ends smoothly."""
    span_s = FLIGHT_S - REST_S
    s = np.clip((np.asarray(t, float) - REST_S) / span_s, 0.0, 1.0)
    q, dq = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / span_s
    place = np.stack([28 - 10 * q, -6 + 8 * q + 3 * np.sin(np.pi * q), 3 + 6 * q], -1)
    along = np.stack([-10 + 0 * q, 8 + 3 * np.pi * np.cos(np.pi * q), 6 + 0 * q], -1)
    return place, along * dq[..., None], 0.4 + 1.2 * q, 1.2 * dq


def to_body(yaw, v):
    """World vectors in the axes of a level UAV."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * v[..., 0] + s * v[..., 1], c * v[..., 1] - s * v[..., 0], v[..., 2]], -1)


def clock_offset_s(t):
    return CLOCK_S + DRIFT * np.asarray(t, float)


def stamp_ns(t):
    """What the UAV's clock shows at a GMT time."""
    return int(np.floor((t + clock_offset_s(t)) * 1e9 + 0.5))


# --- propagation


def mirrored(point, way):
    for on, normal in way:
        point = point - 2 * np.dot(point - on, normal) * normal
    return point


def reflection(way, u):
    """Fresnel's factors; the field, which is vertical, is in the plane of incidence on the ground and across it on the wall."""
    factor = 1.0
    for _, normal in way:
        cosine = abs(np.dot(u, normal))
        root = np.sqrt(PERMITTIVITY - 1 + cosine**2)
        n2 = PERMITTIVITY if normal[2] else 1.0
        factor *= (n2 * cosine - root) / (n2 * cosine + root)
    return factor


def paths(uav_m):
    """Of every way: itself, length (m), arrival and departure (unit vectors, world axes), gain between isotropic antennas."""
    for way in WAYS:
        to_gmt, to_uav = mirrored(GMT_M, way) - uav_m, mirrored(uav_m, way) - GMT_M
        length_m = np.linalg.norm(to_gmt)
        arrival, departure = to_gmt / length_m, to_uav / length_m
        gain = C / CARRIER_HZ / (4 * np.pi * length_m) * reflection(way, arrival)
        yield way, length_m, arrival, departure, gain


def true_paths(uav_m):
    """The line of truth_paths.jsonl for a place of the UAV."""
    found = []
    for way, length_m, arrival, departure, gain in paths(uav_m):
        path = {"order": len(way), "delay_s": length_m / C, "gain": [gain * dipole(departure) * dipole(arrival), 0.0]}
        for name, u in [("aoa", arrival), ("aod", departure)]:
            path[f"{name}_zenith_rad"], path[f"{name}_azimuth_rad"] = np.arccos(u[2]), np.arctan2(u[1], u[0])
        found.append(path)
    found.sort(key=lambda path: -abs(path["gain"][0]))
    return json.dumps({"tx": list(GMT_M), "rx": list(uav_m), "paths": found})


# --- antennas


def dipole(u):
    return np.sqrt(1.643) * np.cos(np.pi / 2 * u[2]) / np.hypot(u[0], u[1])


def face(azimuth_rad):
    """Normal and horizontal tangent of a face."""
    c, s = np.cos(azimuth_rad), np.sin(azimuth_rad)
    return np.array([c, s, 0.0]), np.array([-s, c, 0.0])


def received(u):
    """Of each UAV array and element: factor for a wave from u (body axes); of each array how much earlier it comes, s."""
    factors, leads_s = np.empty((4, 8), complex), np.empty(4)
    for j in range(4):
        normal, tangent = face(np.pi / 2 * j)
        axis = np.sqrt(2 / 3) * tangent + np.array([0.0, 0.0, np.sqrt(1 / 3)])
        off = np.arccos(np.clip(np.dot(u, normal), -1, 1)) / (np.pi / 2)
        loss_db = 6 * off**2 if off <= 1 else 6 + 12 * (off - 1)
        amplitude = dipole(u) * np.sqrt(2) * 10 ** (-loss_db / 20)
        leads_s[j] = np.dot(0.2 * normal, u) / C
        carrier = np.exp(2j * np.pi * CARRIER_HZ * leads_s[j])
        factors[j] = amplitude * carrier * np.exp(1j * np.pi * PLACES * np.dot(axis, u))
    return factors, leads_s


def sweep_of(a, b):
    """Phase step and delay step (s) that take the beam from cosine a to b over the band."""
    low, high = F_HZ[0], F_HZ[-1]
    step_s = (b * (1 + high / CARRIER_HZ) - a * (1 + low / CARRIER_HZ)) / (2 * (high - low))
    return a * (1 + low / CARRIER_HZ) - 2 * step_s * low, step_s


def schedule():
    """Face, phase steps and delay steps (along row, along column) of the 72 beams, then of the 33 squint symbols."""
    sines = np.sin(np.pi / 3) * PLACES / 4
    beams, symbols = [], []
    for s in range(3):
        for sine in sines:
            for elevation in np.radians([0, 12, 25]):
                beams.append((s, (sine * np.cos(elevation), 0.0), (np.sin(elevation), 0.0)))
        symbols += [(s, sweep_of(-0.87, 0.87), (elevation, 0.0)) for elevation in [0.05, 0.28, 0.51]]
        symbols += [(s, (sine, 0.0), sweep_of(-0.10, 0.75)) for sine in sines]
    return beams + symbols


SCHEDULE = schedule()


def sent(u):
    """Field towards u (GMT axes) of everything that is sent, over the subcarriers."""
    fields = np.empty((len(SCHEDULE), len(F_HZ)), complex)
    for number, (s, row, column) in enumerate(SCHEDULE):
        normal, tangent = face(2 * np.pi / 3 * s)
        cosine = np.dot(u, normal)
        fields[number] = dipole(u) * (np.sqrt(max(cosine, 0.05)) if cosine >= 0 else 0.05) / 8
        for towards, (psi, step_s) in [(np.dot(u, tangent), row), (u[2], column)]:
            step_rad = np.pi * (towards * (1 + F_HZ / CARRIER_HZ) - psi) - 2 * np.pi * F_HZ * step_s
            fields[number] *= np.exp(1j * PLACES[:, None] * step_rad).sum(axis=0)
    return fields


# --- samples


def symbol():
    """The waveform's subcarriers, for samples of mean power one."""
    n = (SUBCARRIERS + 208) % 409
    return np.exp(-1j * np.pi * 273 * n * (n + 1) / 409) / np.sqrt(len(SUBCARRIERS))


def blocks(t, random):
    """Amplitudes in sqrt(W) of everything that is sent in the sweep at GMT time t: [block, array, element, sample]."""
    place, velocity, yaw, _ = motion(t)
    slots_s = BEAM_PERIOD_S * np.arange(len(SCHEDULE))
    clock_s = clock_offset_s(t + slots_s)
    heard = np.zeros((len(SCHEDULE), 4, 8, SAMPLES), complex)
    sample_s = np.arange(SAMPLES) / RATE_HZ
    for _, length_m, arrival, departure, gain in paths(place):
        factors, leads_s = received(to_body(yaw, arrival))
        delay_s = length_m / C - leads_s[None, :] + clock_s[:, None]
        spectrum = np.zeros((len(SCHEDULE), 4, SAMPLES), complex)
        late = np.exp(-2j * np.pi * F_HZ * delay_s[..., None])
        spectrum[..., SUBCARRIERS % SAMPLES] = symbol() * sent(departure)[:, None, :] * late
        # A clock that is fast makes the carrier seem low.
        shift_hz = CARRIER_HZ * (np.dot(velocity, arrival) / C - DRIFT)
        turn = np.exp(2j * np.pi * shift_hz * (slots_s[:, None] + sample_s))
        wave = np.fft.ifft(spectrum, axis=-1) * SAMPLES * turn[:, None, :]
        gain = gain * np.exp(-2j * np.pi * CARRIER_HZ * length_m / C)
        heard += gain * factors[None, :, :, None] * wave[:, :, None, :]
    # 1 W less 3 dB; each array's oscillator has a phase of its own in each block; 7 dB over thermal noise.
    free = np.exp(2j * np.pi * random.random((len(SCHEDULE), 4)))
    heard *= 10 ** (-3 / 20) * free[..., None, None]
    sigma = np.sqrt(0.5 * 1.380649e-23 * 290 * 10**0.7 * RATE_HZ)
    heard.real += sigma * random.standard_normal(heard.shape)
    heard.imag += sigma * random.standard_normal(heard.shape)
    return heard


def write_samples(name, codebook, heard):
    """A pair of SigMF files: 12-bit samples, left-aligned, with an exponent of each block."""
    rms = np.sqrt((abs(heard) ** 2).mean(axis=-1)).reshape(len(heard), -1).max(axis=1)
    exponents = np.ceil(np.log2(rms / (32768 * 10 ** (-12 / 20)))).astype(int)
    scaled = heard.reshape(len(heard), 32, SAMPLES) * 2.0 ** -(exponents[:, None, None] + 4)
    both = np.stack([scaled.real, scaled.imag], axis=-1)
    steps = np.clip(np.floor(both + 0.5), -2048, 2047).astype("<i2") * 16
    steps.astype("<i2").transpose(0, 2, 1, 3).tofile(f"{name}.sigmf-data")
    description = {
        "global": {
            "core:datatype": "ci16_le",
            "core:version": "1.2.0",
            "core:sample_rate": RATE_HZ,
            "core:num_channels": 32,
            "cslam:waveform": "zc409-273",
            "cslam:array": "quad-tilted-4x8",
            "cslam:codebook": codebook,
        },
        "captures": [
            {"core:sample_start": SAMPLES * i, "core:frequency": CARRIER_HZ, "cslam:beam": i, "cslam:exponent": int(e)}
            for i, e in enumerate(exponents)
        ],
        "annotations": [],
    }
    pathlib.Path(f"{name}.sigmf-meta").write_text(json.dumps(description))


# --- sensors


def imu(random):
    """imu.bin: a sample a millisecond of the UAV's clock, the mean over the millisecond before; a bias, and white noise."""
    ticks = np.arange(int(FLIGHT_S * 1000) + 1)
    t = (ticks * 1e-3 - CLOCK_S) / (1 + DRIFT)
    _, velocity, yaw, _ = motion(t)
    dt_s = np.diff(t)
    rate = np.zeros((len(dt_s), 3))
    rate[:, 2] = np.diff(yaw) / dt_s
    force = to_body((yaw[1:] + yaw[:-1]) / 2, np.diff(velocity, axis=0) / dt_s[:, None] + [0, 0, G])
    rate += np.radians([0.2, -0.3, 0.1]) + np.radians(2.8e-3 * 1000**0.5) * random.standard_normal(rate.shape)
    force += G * (np.array([4e-3, -3e-3, 5e-3]) + 70e-6 * 1000**0.5 * random.standard_normal(force.shape))
    gyro = np.rint(np.degrees(rate) * 131.072).astype(int) << 1
    accel = np.rint(force / G * 8192).astype(int) << 2
    packets = np.zeros((len(dt_s), 28), np.uint8)
    packets[:, :8] = (ticks[1:] * 1000000).astype("<u8").view(np.uint8).reshape(-1, 8)
    packets[:, 8] = 0x78
    packets[:, 9:15] = (accel >> 4).astype(">i2").view(np.uint8).reshape(-1, 6)
    packets[:, 15:21] = (gyro >> 4).astype(">i2").view(np.uint8).reshape(-1, 6)
    packets[:, 23:25] = (ticks[1:] * 1875 // 2 % 65536).astype(">u2").view(np.uint8).reshape(-1, 2)
    packets[:, 25:28] = (accel & 15) << 4 | gyro & 15
    return packets.tobytes(), len(packets)


def magnetometer(random):
    """magnetometer.csv: 50 samples per second of the UAV's clock."""
    inclination, declination = np.radians([FIELD["inclination_deg"], FIELD["declination_deg"]])
    earth_ut = FIELD["strength_ut"] * np.array(
        [np.cos(inclination) * np.sin(declination), np.cos(inclination) * np.cos(declination), -np.sin(inclination)]
    )
    lines = ["uav_time_ns,x,y,z"]
    for tick in range(1, int(FLIGHT_S * 50) + 1):
        _, _, yaw, _ = motion((tick / 50 - CLOCK_S) / (1 + DRIFT))
        field = to_body(yaw, earth_ut) + 0.04 * random.standard_normal(3)
        lines.append(f"{tick * 20000000}," + ",".join(str(int(c)) for c in np.rint(field * 163.84)))
    return lines


def truth():
    """truth.csv: every 10 ms, and where a sweep begins."""
    lines = [
        "time_s,sweep,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,qw,qx,qy,qz,rate_x_rad_per_s,rate_y_rad_per_s,"
        "rate_z_rad_per_s,gmt_x_m,gmt_y_m,gmt_z_m,clock_offset_s,clock_drift"
    ]
    for tick in range(int(FLIGHT_S * 100) + 1):
        t = tick / 100
        place, velocity, yaw, yaw_rate = motion(t)
        sweep = str(tick // 50 - 1) if tick % 50 == 0 and tick else ""
        turn = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2), 0, 0, yaw_rate]
        numbers = [*place, *velocity, *turn, *GMT_M, clock_offset_s(t), DRIFT]
        lines.append(f"{t},{sweep}," + ",".join(repr(float(x)) for x in numbers))
    return lines


def main(directory, seed):
    directory.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(seed)
    starts_s = PERIOD_S * np.arange(1, int(FLIGHT_S / PERIOD_S) + 1)
    imu_bytes, imu_records = imu(random)
    timing, sweeps, beacons, links = ["uav_time_ns,clock_offset_s"], ["uav_time_ns,sweep"], [], []
    for number, t in enumerate(starts_s):
        exchange_s = t - PERIOD_S / 2
        measured_s = clock_offset_s(exchange_s) + 0.3e-9 * random.standard_normal()
        timing.append(f"{stamp_ns(exchange_s)},{float(measured_s)!r}")
        sweeps.append(f"{stamp_ns(t)},{number}")
        beacon = {
            "sweep": number,
            "gmt_time_s": float(t),
            "position_m": list(GMT_M),
            "heading_pitch_roll_rad": [0.0, 0.0, 0.0],
            "position_sigma_m": 0.02,
            "sweep_period_s": PERIOD_S,
            "sweeps_per_stop": len(starts_s),
        }
        beacons.append(json.dumps({"uav_time_ns": stamp_ns(t + 1e-3), "beacon": beacon}))
        links.append(true_paths(motion(t)[0]))
        heard = blocks(t, random)
        write_samples(directory / f"sweep-{number:04}", "gmt-72", heard[:72])
        write_samples(directory / f"squint-{number:04}", "bsm-seq", heard[72:])
    files = []

    def put(name, content, records):
        (directory / name).write_bytes(content)
        files.append({"name": name, "records": records, "bytes": len(content), "crc32": zlib.crc32(content)})

    def text(lines):
        return "".join(line + "\n" for line in lines).encode()

    put("imu.bin", imu_bytes, imu_records)
    for name, lines in [("magnetometer.csv", magnetometer(random)), ("timing.csv", timing), ("sweeps.csv", sweeps)]:
        put(name, text(lines), len(lines) - 1)
    put("beacons.jsonl", text(beacons), len(beacons))
    (directory / "truth.csv").write_bytes(text(truth()))
    (directory / "truth_paths.jsonl").write_bytes(text(links))
    (directory / "scene.json").write_text(json.dumps(SCENE))
    description = {
        "format": "cslam-flight",
        "version": 2,
        "duration_s": FLIGHT_S,
        "sweep_period_s": PERIOD_S,
        "gmt_setup_position_m": list(GMT_M),
        "magnetic_field": FIELD,
        "imu_rate_hz": 1000,
        "samples": True,
        "files": files,
    }
    (directory / "flight.json").write_text(json.dumps(description))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
