/* C interface of the cslam receiver: path estimation, reflection points, link states, and all of it as it flies.
 *
 * Memory is the caller's, zeroed before `_init`; every struct begins with its size, which the caller sets; every function gives a
 * status and reads no pointer before it is checked for null and alignment. A handle is good for one thread at a time.
 *
 * Each transmit beam has an exponent of its own (amplitude = integer x 2^exponent): one for a whole sweep gives paths that look right
 * and are wrong. */

#ifndef CSLAM_H
#define CSLAM_H

/* Made of capi/src by cbindgen: `CSLAM_WRITE_HEADER=1 cargo test -p cslam-c --test header`. */

#include <stddef.h>
#include <stdint.h>

/*
 What a call came to: 0 when it did what it was asked to.
 */
enum cslam_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Done.
   */
  CSLAM_STATUS_OK = 0,
  /*
   A pointer that must not be null is null.
   */
  CSLAM_STATUS_NULL = 1,
  /*
   A pointer is not aligned for what it points to.
   */
  CSLAM_STATUS_MISALIGNED = 2,
  /*
   The memory, or an array, is shorter than what has to go in.
   */
  CSLAM_STATUS_TOO_SHORT = 3,
  /*
   The `size` field of a struct is not that of this version.
   */
  CSLAM_STATUS_SIZE = 4,
  /*
   A number is NaN or infinite.
   */
  CSLAM_STATUS_NOT_FINITE = 5,
  /*
   A number is outside its range.
   */
  CSLAM_STATUS_OUT_OF_RANGE = 6,
  /*
   There is nothing at the handle: never built, ended, or copied elsewhere.
   */
  CSLAM_STATUS_NOT_READY = 7,
  /*
   There is something in the memory already that has not been ended.
   */
  CSLAM_STATUS_ALREADY_READY = 8,
  /*
   Another thread is in a call with this handle.
   */
  CSLAM_STATUS_BUSY = 9,
  /*
   The configuration cannot work; `cslam_estimator_config_wrong_field` names the field.
   */
  CSLAM_STATUS_CONFIG = 10,
  /*
   A delay is zero or negative, or a direction has no length.
   */
  CSLAM_STATUS_NO_LENGTH = 11,
  /*
   Both ends of the link are at the same place.
   */
  CSLAM_STATUS_COINCIDENT_ENDS = 12,
  /*
   A delay is shorter than the straight way between the ends.
   */
  CSLAM_STATUS_DELAY_TOO_SHORT = 13,
  /*
   A variance is negative or not finite.
   */
  CSLAM_STATUS_COVARIANCE = 14,
  /*
   An angle lies outside its range, or a direction is no unit vector.
   */
  CSLAM_STATUS_ANGLE = 15,
  /*
   The library itself is damaged: its models do not pass their checks.
   */
  CSLAM_STATUS_DAMAGED = 16,
  /*
   What was asked for is not known yet.
   */
  CSLAM_STATUS_NOT_KNOWN = 17,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum cslam_status cslam_status;
#else
typedef int32_t cslam_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 An estimator in the caller's memory.
 */
typedef struct cslam_estimator cslam_estimator;

/*
 A receiver in the caller's memory.
 */
typedef struct cslam_receiver cslam_receiver;

/*
 What the estimator may be told. `cslam_estimator_config_default` fills it in.
 */
typedef struct cslam_estimator_config {
  /*
   `sizeof(cslam_estimator_config)`.
   */
  uint32_t size;
  /*
   1: beams and candidates are passed over that hold no path but known ones. 0: everything is looked at.
   */
  uint8_t screening;
  /*
   1: what one sweep shows of the noise helps the next, for sweeps that follow each other. 0: sweeps of no one flight.
   */
  uint8_t gating;
  /*
   1: errors of the receive elements are learned from sweep to sweep, beginning with `element_errors`. 0: they are known.
   */
  uint8_t element_errors_learned;
  /*
   0.
   */
  uint8_t reserved;
  /*
   Attitude of the transmitter: quaternion w, x, y, z from its axes to the world's. 1, 0, 0, 0: first face to the east.
   */
  float gmt_attitude_wxyz[4];
  /*
   False alarms a sweep on noise alone, above 0 and at most 1.
   */
  float false_alarms_per_sweep;
  /*
   Paths weaker than the strongest one by more than this are not reported, dB, 0 to 120.
   */
  float dynamic_range_db;
  /*
   Standard deviation of the error of a receive element's response, relative to what it should be, 0 to 1.
   */
  float element_errors;
  /*
   Standard deviation of a transmit beam's gain, dB, 0 to 20.
   */
  float beam_gain_sigma_db;
  /*
   Thousands of instructions of a Cortex-M7 that the search of a sweep may take; UINT32_MAX for no limit.
   */
  uint32_t work_limit_thousands;
} cslam_estimator_config;

/*
 What one beam gave.
 */
typedef struct cslam_beam_report {
  /*
   `sizeof(cslam_beam_report)`.
   */
  uint32_t size;
  /*
   Paths found in it.
   */
  uint32_t paths;
  /*
   Mean power of a sample, all channels added, amplitude units squared.
   */
  float power;
  /*
   Values that clipped in the transform: paths may be too weak where this is not 0.
   */
  uint32_t clips;
  /*
   1 when the beam was not searched, for it holds no path worth reporting.
   */
  uint8_t weak;
  /*
   1 when the beam was not searched because the sweep's work was spent.
   */
  uint8_t left_out;
  /*
   0.
   */
  uint8_t reserved[2];
} cslam_beam_report;

/*
 An estimated path.
 */
typedef struct cslam_path {
  /*
   `sizeof(cslam_path)`.
   */
  uint32_t size;
  /*
   Transmit beam in which the path was strongest.
   */
  uint16_t beam;
  /*
   1 when the beams showed the direction of departure, else 0 and zeros there.
   */
  uint8_t has_departure;
  /*
   0.
   */
  uint8_t reserved;
  /*
   Speed of light times the delay, clock offset included, m, cyclic with 625 m.
   */
  float c_tau_m;
  /*
   Unit vector from the UAV towards where the wave came from, body axes: forward, left, up.
   */
  float aoa_body[3];
  /*
   Unit vector from the transmitter towards where the wave went, world axes.
   */
  float aod_world[3];
  /*
   Standard deviation of that along any tangent, rad.
   */
  float aod_sigma_rad;
  /*
   SNR per element and active subcarrier in that beam, mean over the elements, dB.
   */
  float snr_db;
  /*
   Power per active subcarrier in that beam, summed over the elements, amplitude units squared.
   */
  float energy;
  /*
   Covariance by noise of (c tau, angles along the tangents e1, e2 of the arrival), m^2, m rad, rad^2, row by row.
   */
  float covariance[9];
} cslam_path;

/*
 Thresholds of the gates that a point has to pass. `cslam_gates_default` fills it in.
 */
typedef struct cslam_gates {
  /*
   `sizeof(cslam_gates)`.
   */
  uint32_t size;
  /*
   1 when `ground_z_m` is known, else 0.
   */
  uint8_t has_ground;
  /*
   1 when `bounds_min_m` and `bounds_max_m` are known, else 0.
   */
  uint8_t has_bounds;
  /*
   0.
   */
  uint8_t reserved[2];
  /*
   Excess delay must exceed this many of its standard deviations.
   */
  float excess_sigmas;
  /*
   Within this angle of the transmitter's direction a path without excess is line of sight, rad.
   */
  float line_of_sight_angle_rad;
  /*
   Least `1 + cos beta` of the bistatic angle; 0 opens the gate.
   */
  float min_one_plus_cos_bistatic;
  /*
   Largest error of the point, m; INFINITY opens the gate.
   */
  float max_sigma_m;
  /*
   Least distance from the UAV, m.
   */
  float min_uav_distance_m;
  /*
   Least distance from the transmitter, m.
   */
  float min_gmt_distance_m;
  /*
   The point must lie where the wave left to, within this many standard deviations; INFINITY opens the gate.
   */
  float departure_sigmas;
  /*
   Height of the ground, m.
   */
  float ground_z_m;
  /*
   Least coordinates of the scene, m.
   */
  float bounds_min_m[3];
  /*
   Greatest coordinates of the scene, m.
   */
  float bounds_max_m[3];
} cslam_gates;

/*
 The two ends of a link. World axes: east, north, up.
 */
typedef struct cslam_link {
  /*
   `sizeof(cslam_link)`.
   */
  uint32_t size;
  /*
   Position of the UAV, m.
   */
  float uav_m[3];
  /*
   Its covariance, m^2, row by row.
   */
  float uav_covariance_m2[9];
  /*
   Position of the transmitter, m.
   */
  float gmt_m[3];
} cslam_link;

/*
 A path in world axes (east, north, up), clock offset removed.
 */
typedef struct cslam_measured_path {
  /*
   `sizeof(cslam_measured_path)`.
   */
  uint32_t size;
  /*
   1 when `aod_world` and `aod_sigma_rad` are known, else 0.
   */
  uint8_t has_departure;
  /*
   1 when `gain_db` is known, else 0. Used by `cslam_classify` alone.
   */
  uint8_t has_gain;
  /*
   0.
   */
  uint8_t reserved[2];
  /*
   Speed of light times the delay, m.
   */
  float c_tau_m;
  /*
   From the UAV towards where the wave came from; any length but zero.
   */
  float aoa_world[3];
  /*
   From the transmitter towards where the wave went; any length but zero.
   */
  float aod_world[3];
  /*
   Standard deviation of that along any tangent, rad.
   */
  float aod_sigma_rad;
  /*
   Covariance of (c tau, angles along the tangents e1, e2 of the arrival), m^2, m rad, rad^2, row by row. e1 is horizontal, towards
   growing azimuth; e2 = aoa x e1.
   */
  float covariance[9];
  /*
   Power gain between half-wave dipoles, dB (negative).
   */
  float gain_db;
} cslam_measured_path;

/*
 A solved point.
 */
typedef struct cslam_point {
  /*
   `sizeof(cslam_point)`.
   */
  uint32_t size;
  /*
   0: accepted. Another number: why there is none, in words by `cslam_verdict_text`; all that follows is 0 then.
   */
  int32_t verdict;
  /*
   The point, world axes, m.
   */
  float position_m[3];
  /*
   Its covariance, m^2, row by row.
   */
  float covariance_m2[9];
  /*
   Distance from the UAV, m.
   */
  float distance_m;
  /*
   Root of the covariance's trace, m.
   */
  float sigma_m;
} cslam_point;

/*
 What a path is.
 */
typedef struct cslam_probabilities {
  /*
   `sizeof(cslam_probabilities)`.
   */
  uint32_t size;
  /*
   The most probable: 1 line of sight, 2 one reflection, 3 more. 0: the path is no measurement, and all probabilities are 0.
   */
  int32_t state;
  /*
   Probability of line of sight.
   */
  float line_of_sight;
  /*
   Probability of one reflection.
   */
  float first_order;
  /*
   Probability of two reflections or more.
   */
  float higher_order;
} cslam_probabilities;

/*
 What a receiver must be told.
 */
typedef struct cslam_receiver_config {
  /*
   `sizeof(cslam_receiver_config)`.
   */
  uint32_t size;
  /*
   Number of the UAV in its packets.
   */
  uint8_t uav;
  /*
   1 when `ground_z_m` is known, else 0.
   */
  uint8_t has_ground;
  /*
   1 when `earth_field_ut` is known, else 0: the magnetometer is not used then.
   */
  uint8_t has_earth_field;
  /*
   0.
   */
  uint8_t reserved;
  /*
   Secret of the link, with which packets both ways are signed; not all zero.
   */
  uint8_t key[32];
  /*
   Counter of the first packet: no less than any that was used with this key before.
   */
  uint32_t first_counter;
  /*
   Height of the ground at the start, m.
   */
  float ground_z_m;
  /*
   The earth's magnetic field, world axes (east, north, up), uT.
   */
  float earth_field_ut[3];
} cslam_receiver_config;

/*
 What the transmitter says of a sweep.
 */
typedef struct cslam_beacon {
  /*
   `sizeof(cslam_beacon)`.
   */
  uint32_t size;
  /*
   Number of the sweep that it follows.
   */
  uint32_t sweep;
  /*
   Position of the antenna during that sweep, world axes, m.
   */
  double position_m[3];
  /*
   Attitude of the mast: quaternion w, x, y, z from its axes to the world's.
   */
  float attitude_wxyz[4];
  /*
   Standard deviation of the position, m per axis.
   */
  float sigma_m;
  /*
   Sweeps from one place before it moves on, 1 or more.
   */
  uint32_t sweeps_per_stop;
} cslam_beacon;

/*
 Where the UAV is.
 */
typedef struct cslam_pose {
  /*
   `sizeof(cslam_pose)`.
   */
  uint32_t size;
  /*
   Counts the jumps: poses with different counts must not be differenced.
   */
  uint32_t resets;
  /*
   Clock of the UAV, ns.
   */
  uint64_t time_ns;
  /*
   World axes, m.
   */
  double position_m[3];
  /*
   UAV clock less transmitter clock as a length, m, within half a period of 625 m.
   */
  double clock_offset_m;
  /*
   World axes, m/s.
   */
  float velocity_m_per_s[3];
  /*
   Attitude: the matrix that turns body axes into world axes, row by row.
   */
  float attitude_wb[9];
  /*
   Covariance of the position, m^2, row by row.
   */
  float position_covariance_m2[9];
  /*
   Covariance of the velocity, m^2/s^2, row by row.
   */
  float velocity_covariance_m2_per_s2[9];
  /*
   Covariance of the attitude as a small rotation vector in world axes, rad^2, row by row.
   */
  float attitude_covariance_rad2[9];
  /*
   Standard deviation of `clock_offset_m`, m.
   */
  float clock_offset_sigma_m;
} cslam_pose;

/*
 A point of the map.
 */
typedef struct cslam_map_point {
  /*
   `sizeof(cslam_map_point)`.
   */
  uint32_t size;
  /*
   Reflections that were fused, at most 65535.
   */
  uint32_t hits;
  /*
   World axes, m.
   */
  float position_m[3];
  /*
   Trace of its covariance, m^2.
   */
  float variance_m2;
  /*
   Number of the surface that it lies on, -1 where none is known.
   */
  int32_t surface;
} cslam_map_point;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 A status in words, never null; "unknown status" for a number that is none. Static: not to be freed.
 */
const char *cslam_status_text(int32_t status);

/*
 Bytes that an estimator takes: 78 KiB. Its memory must be zeroed, or have held one that was ended.
 */
size_t cslam_estimator_size(void);

/*
 Alignment of these bytes: 16 at most, that of `malloc`.
 */
size_t cslam_estimator_align(void);

/*
 Fills in the configuration that flies.

 # Safety
 Unless null or misaligned, `config` points to a `cslam_estimator_config`.
 */
cslam_status cslam_estimator_config_default(struct cslam_estimator_config *config);

/*
 Name of the first field of a configuration that cannot work, static; null when all are sound, and when there is no configuration.

 # Safety
 Unless null or misaligned, `config` points to a `cslam_estimator_config` that is filled in.
 */
const char *cslam_estimator_config_wrong_field(const struct cslam_estimator_config *config);

/*
 Builds an estimator in `length` bytes at `memory`. `config` may be null: that which flies. Computes all tables where they lie, and takes
 8 KiB of stack on the way (measured); a push of a beam takes 18 KiB and more.

 # Safety
 `memory`: `length` bytes, zeroed or of an object that was ended, that stay where they are until `cslam_estimator_end`. `config`
 and `out` as their types say.
 */
cslam_status cslam_estimator_init(void *memory,
                                  size_t length,
                                  const struct cslam_estimator_config *config,
                                  struct cslam_estimator **out);

/*
 Gives the memory back.

 # Safety
 `estimator` is null or comes from `cslam_estimator_init`, and its memory is still there.
 */
cslam_status cslam_estimator_end(struct cslam_estimator *estimator);

/*
 Mean power of a block, all channels added, amplitude units squared: beams are given strongest first.

 # Safety
 `samples`: `count` values of `int16_t`, channel by channel, 32 x 512 pairs I, Q, aligned to 4 bytes. `power` as its type says.
 */
cslam_status cslam_block_power(const int16_t *samples,
                               size_t count,
                               int32_t exponent,
                               float *power);

/*
 Takes the samples of one beam, which are worked on in place. `exponent` is that of **this** beam: amplitude = integer x
 2^exponent; one for a whole sweep gives paths that look right and are wrong. Strongest beam first (`cslam_block_power`).

 # Safety
 `estimator` from `cslam_estimator_init`; `samples`: `count` values of `int16_t`, channel by channel, 32 x 512 pairs I, Q, aligned to
 4 bytes, which nobody else uses meanwhile. `report` may be null.
 */
cslam_status cslam_estimator_push_beam(struct cslam_estimator *estimator,
                                       int16_t *samples,
                                       size_t count,
                                       uint16_t beam,
                                       int32_t exponent,
                                       struct cslam_beam_report *report);

/*
 Ends the sweep: its paths, strongest first, and how many there are. The estimator is empty afterwards, ready for the next sweep.

 # Safety
 `estimator` from `cslam_estimator_init`; `paths`: `capacity` (9 or more) structs, the first of which says its size; `found` as its
 type says.
 */
cslam_status cslam_estimator_finish(struct cslam_estimator *estimator,
                                    struct cslam_path *paths,
                                    size_t capacity,
                                    size_t *found);

/*
 A whole sweep that lies in memory: the beams in order of their power, then its paths. What was in the estimator is forgotten.

 # Safety
 `estimator` from `cslam_estimator_init`; `samples`: `count` values of `int16_t`, block by block as for `cslam_estimator_push_beam`,
 worked on in place; `beams` and `exponents`: one of each a block, `blocks` of them (at most 72, no beam twice); `paths`, `capacity`
 and `found` as for `cslam_estimator_finish`.
 */
cslam_status cslam_estimator_sweep(struct cslam_estimator *estimator,
                                   int16_t *samples,
                                   size_t count,
                                   const uint16_t *beams,
                                   const int32_t *exponents,
                                   size_t blocks,
                                   struct cslam_path *paths,
                                   size_t capacity,
                                   size_t *found);

/*
 Fills in the gates of the design: no ground, no bounds, errors of any size.

 # Safety
 Unless null or misaligned, `gates` points to a `cslam_gates`.
 */
cslam_status cslam_gates_default(struct cslam_gates *gates);

/*
 Where a path was reflected, if it was reflected once: `point->verdict` is 0 then. `gates` may be null: those of the design.

 A status but `CSLAM_STATUS_OK` says that the input is no measurement of a path.

 # Safety
 Pointers as their types say; `link`, `path` and `gates` filled in, `point` with its size.
 */
cslam_status cslam_solve(const struct cslam_link *link,
                         const struct cslam_measured_path *path,
                         const struct cslam_gates *gates,
                         struct cslam_point *point);

/*
 A verdict in words, never null: "ok" for 0, "unknown verdict" for a number that is none. Static.
 */
const char *cslam_verdict_text(int32_t verdict);

/*
 Probabilities of the paths of a link, by the networks that fly. They are judged together: give all of them, strongest first, 1 to 32.

 # Safety
 Pointers as their types say: `link` filled in, `count` of `paths` filled in, `count` of `probabilities`, the first with its size.
 */
cslam_status cslam_classify(const struct cslam_link *link,
                            const struct cslam_measured_path *paths,
                            size_t count,
                            struct cslam_probabilities *probabilities);

/*
 Bytes that a receiver takes: 272 KiB. Its memory must be zeroed, or have held one that was ended.
 */
size_t cslam_receiver_size(void);

/*
 Alignment of these bytes: 16 at most, that of `malloc`.
 */
size_t cslam_receiver_align(void);

/*
 Builds a receiver at rest that knows nothing yet, in `length` bytes at `memory`. Takes 132 KiB of stack on a 64-bit host (measured).

 # Safety
 `memory`: `length` bytes, zeroed or of a receiver that was ended, that stay where they are until `cslam_receiver_end`. `config` filled
 in; `out` as its type says.
 */
cslam_status cslam_receiver_init(void *memory,
                                 size_t length,
                                 const struct cslam_receiver_config *config,
                                 struct cslam_receiver **out);

/*
 Gives the memory back.

 # Safety
 `receiver` is null or comes from `cslam_receiver_init`, and its memory is still there.
 */
cslam_status cslam_receiver_end(struct cslam_receiver *receiver);

/*
 A sample of the inertial sensor: UAV clock at the end of its interval; angular rate (rad/s) and specific force (m/s^2, +9.8 along z at
 rest) in body axes, three of each.

 # Safety
 `receiver` from `cslam_receiver_init`; arrays of three.
 */
cslam_status cslam_receiver_imu(struct cslam_receiver *receiver,
                                uint64_t time_ns,
                                const float *rate_rad_per_s,
                                const float *specific_force_m_per_s2);

/*
 A sample of the magnetometer, body axes, uT, three numbers.

 # Safety
 `receiver` from `cslam_receiver_init`; an array of three.
 */
cslam_status cslam_receiver_magnetometer(struct cslam_receiver *receiver, uint64_t time_ns, const float *field_ut);

/*
 Begins a sweep with the powers of its beams (`cslam_block_power`), 72 of them, 0 where one is lost: so the receiver counts what is
 missing. A front end that does not know them leaves this call out.

 # Safety
 `receiver` from `cslam_receiver_init`; an array of 72.
 */
cslam_status cslam_receiver_powers(struct cslam_receiver *receiver,
                                   uint32_t sweep,
                                   uint64_t sweep_ns,
                                   const float *powers);

/*
 A two-way timing exchange: UAV clock less transmitter clock, s, not beyond one second.

 # Safety
 `receiver` from `cslam_receiver_init`.
 */
cslam_status cslam_receiver_timing(struct cslam_receiver *receiver, uint64_t time_ns, double clock_offset_s);

/*
 Samples of a transmit beam of a sweep, strongest beam first, each with its own exponent; as `cslam_estimator_push_beam` takes them. The
 first block of a new sweep begins it. `CSLAM_STATUS_OUT_OF_RANGE` also for a sweep that has ended.

 # Safety
 `receiver` from `cslam_receiver_init`; `samples`: `count` values of `int16_t`, 32 x 512 pairs, aligned to 4 bytes.
 */
cslam_status cslam_receiver_beam(struct cslam_receiver *receiver,
                                 uint32_t sweep,
                                 uint64_t sweep_ns,
                                 int16_t *samples,
                                 size_t count,
                                 uint16_t beam,
                                 int32_t exponent);

/*
 Samples of a pilot: a beam that the transmitter has sent again after the sweep, `pilot` its number, plus 72 when it is the second time (0 to
 143). Between the beams and the squint symbols, of each beam the first one before the second; those of the 12 strongest beams are enough.
 The receiver makes of them how fast paths grow while there is no line of sight. A sweep without them is whole.

 # Safety
 As `cslam_receiver_beam`.
 */
cslam_status cslam_receiver_pilot(struct cslam_receiver *receiver,
                                  uint32_t sweep,
                                  uint64_t sweep_ns,
                                  int16_t *samples,
                                  size_t count,
                                  uint16_t pilot,
                                  int32_t exponent);

/*
 Samples of a beam squint symbol, 0 to 32, in this order, after all beams of the sweep and their pilots.

 # Safety
 As `cslam_receiver_beam`.
 */
cslam_status cslam_receiver_squint(struct cslam_receiver *receiver,
                                   uint32_t sweep,
                                   uint64_t sweep_ns,
                                   int16_t *samples,
                                   size_t count,
                                   uint16_t symbol,
                                   int32_t exponent);

/*
 What the transmitter says of the sweep in hand. One that comes as a signed packet goes through `cslam_receiver_uplink` instead.

 # Safety
 `receiver` from `cslam_receiver_init`; `beacon` filled in.
 */
cslam_status cslam_receiver_beacon(struct cslam_receiver *receiver,
                                   uint64_t time_ns,
                                   const struct cslam_beacon *beacon);

/*
 Bytes that the radio has received: packets of the ground, signed with the key. What is not signed so is counted and not used.

 # Safety
 `receiver` from `cslam_receiver_init`; `bytes`: `count` of them.
 */
cslam_status cslam_receiver_uplink(struct cslam_receiver *receiver,
                                   uint64_t time_ns,
                                   const uint8_t *bytes,
                                   size_t count);

/*
 Tells the time: a sweep that will not be whole any more ends, 21 ms after its last block without a beacon, 450 ms without its blocks.

 # Safety
 `receiver` from `cslam_receiver_init`.
 */
cslam_status cslam_receiver_elapse(struct cslam_receiver *receiver,
                                   uint64_t time_ns);

/*
 Ends the flight: the sweep in hand, and what waited for more to be sent with it.

 # Safety
 `receiver` from `cslam_receiver_init`.
 */
cslam_status cslam_receiver_close(struct cslam_receiver *receiver);

/*
 Takes what waits for the radio: `taken` bytes, at most `capacity`, a part of the stream of frames. At most 4096 wait; more is dropped.

 # Safety
 `receiver` from `cslam_receiver_init`; `bytes`: room for `capacity`; `taken` as its type says.
 */
cslam_status cslam_receiver_take_packets(struct cslam_receiver *receiver,
                                         uint8_t *bytes,
                                         size_t capacity,
                                         size_t *taken);

/*
 Pose by the newest inertial data. `CSLAM_STATUS_NOT_KNOWN` before there is one.

 # Safety
 `receiver` from `cslam_receiver_init`; `pose` with its size.
 */
cslam_status cslam_receiver_pose(struct cslam_receiver *receiver, struct cslam_pose *pose);

/*
 The map: writes at most `capacity` points, and to `found` how many there are (at most 3072). `points` may be null when `capacity` is 0.

 # Safety
 `receiver` from `cslam_receiver_init`; `points`: `capacity` structs, the first with its size; `found` as its type says.
 */
cslam_status cslam_receiver_map(struct cslam_receiver *receiver,
                                struct cslam_map_point *points,
                                size_t capacity,
                                size_t *found);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* CSLAM_H */

#ifdef __cplusplus
#define CSLAM_ASSERT(what) static_assert(what, #what)
#else
#define CSLAM_ASSERT(what) _Static_assert(what, #what)
#endif
CSLAM_ASSERT(sizeof(cslam_link) == 64);
CSLAM_ASSERT(sizeof(cslam_measured_path) == 80);
CSLAM_ASSERT(offsetof(cslam_measured_path, covariance) == 40);
CSLAM_ASSERT(sizeof(cslam_estimator_config) == 44);
CSLAM_ASSERT(sizeof(cslam_beam_report) == 20);
CSLAM_ASSERT(sizeof(cslam_path) == 84);
CSLAM_ASSERT(offsetof(cslam_path, covariance) == 48);
CSLAM_ASSERT(sizeof(cslam_gates) == 64);
CSLAM_ASSERT(sizeof(cslam_point) == 64);
CSLAM_ASSERT(sizeof(cslam_probabilities) == 20);
CSLAM_ASSERT(sizeof(cslam_receiver_config) == 60);
CSLAM_ASSERT(sizeof(cslam_beacon) == 56);
CSLAM_ASSERT(sizeof(cslam_pose) == 208);
CSLAM_ASSERT(sizeof(cslam_map_point) == 28);
CSLAM_ASSERT(sizeof(cslam_status) == 4);
#undef CSLAM_ASSERT

/* Without an operating system (the library built with --no-default-features --features panic-handler) the application defines
 * `void cslam_panic(void)`, which must not come back. The receiver has no panic that can be reached. */
