/* Where one path was reflected, and why another one has no point: prints what the example `solve` of cslam-core prints. */
#include <stdio.h>
#include <stdlib.h>

#include "cslam.h"

#ifndef CSLAM_STD
#ifdef __ARM_ARCH
void cslam_panic(void) {
    abort();
}
#endif
#endif

int main(void) {
    /* UAV and transmitter 12 m in front of the wall x = 0, on the ground z = 0. */
    const float place = 0.05f * 0.05f, range = 0.05f * 0.05f, angle = 2e-3f * 2e-3f;
    const cslam_link link = {
        .size = sizeof link,
        .uav_m = {12, 40, 6},
        .uav_covariance_m2 = {place, 0, 0, 0, place, 0, 0, 0, place},
        .gmt_m = {12, 0, 2},
    };
    static const struct {
        const char *what;
        float way_m, towards[3];
    } tried[] = {
        {"off the wall", 46.818f, {-12, -20, -2}},
        {"straight", 40.200f, {0, -40, -4}},
        {"a longer way", 90.000f, {-12, -20, -2}},
        {"from below", 60.000f, {-12, -20, -9}},
    };
    cslam_gates gates;
    cslam_gates_default(&gates);
    gates.has_ground = 1;
    gates.ground_z_m = 0;
    for (size_t i = 0; i < sizeof tried / sizeof *tried; i++) {
        const float *u = tried[i].towards;
        const cslam_measured_path path = {
            .size = sizeof path,
            .c_tau_m = tried[i].way_m,
            .aoa_world = {u[0], u[1], u[2]},
            .covariance = {range, 0, 0, 0, angle, 0, 0, 0, angle},
        };
        cslam_point point = {.size = sizeof point};
        cslam_status status = cslam_solve(&link, &path, &gates, &point);
        const float *p = point.position_m;
        if (status != CSLAM_STATUS_OK)
            printf("%s: %s\n", tried[i].what, cslam_status_text(status));
        else if (point.verdict != 0)
            printf("%s: %s\n", tried[i].what, cslam_verdict_text(point.verdict));
        else
            printf("%s: %.3f %.3f %.3f m, sigma %.3f m\n", tried[i].what, p[0], p[1], p[2], point.sigma_m);
    }
    return 0;
}
