/* What is in order, to be spoilt by a test. */
#ifndef CSLAM_GIVEN_H
#define CSLAM_GIVEN_H

#include "cslam.h"

enum { BLOCK = 32 * 512 * 2, PATHS = 9 };

static inline cslam_link a_link(void) {
    cslam_link link = {.size = sizeof link, .uav_m = {12, 40, 6}, .gmt_m = {12, 0, 2}};
    link.uav_covariance_m2[0] = link.uav_covariance_m2[4] = link.uav_covariance_m2[8] = 0.0025f;
    return link;
}

static inline cslam_measured_path a_path(void) {
    cslam_measured_path path = {.size = sizeof path, .c_tau_m = 46.818f, .aoa_world = {-12, -20, -2}};
    path.covariance[0] = 0.0025f;
    path.covariance[4] = path.covariance[8] = 4e-6f;
    return path;
}

static inline cslam_receiver_config a_receiver(void) {
    return (cslam_receiver_config){.size = sizeof(cslam_receiver_config), .uav = 1, .has_ground = 1, .key = {1}};
}

#endif
