/* Random calls of the C interface, most of them wrong: each gives a status, never undefined behaviour. `random_calls CALLS [SEED]`; built
 * with -fsanitize=address,undefined, and run by valgrind. A fourth as many go to a receiver. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "given.h"

static int failures;
static uint64_t state;

static uint32_t draw(uint32_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((state >> 33) % below);
}

/* A number as they come: extremes, numbers that are none, ordinary ones. */
static float number(void) {
    static const float extremes[] = {0, -0.0f, 1, -1, 1e-30f, 3e38f, -3e38f, 1e-45f, 625, NAN, INFINITY, -INFINITY};
    uint32_t which = draw(24);
    return which < 12 ? extremes[which] : ((float)draw(20001) - 10000) * (which < 18 ? 0.01f : 1e-4f);
}

/* A copy of its own on the heap with some of it spoilt; NULL or misaligned now and then. */
static void *spoilt(const void *value, size_t size, void **allocated) {
    unsigned char *at = *allocated = malloc(size + 1);
    uint32_t how = draw(40);
    if (how == 0)
        return NULL;
    size_t off = how == 1;
    memcpy(at + off, value, size);
    for (uint32_t i = draw(4); i > 0; i--) {
        size_t place = 4 * draw((uint32_t)(size / 4));
        float x = number();
        uint32_t bits = draw(8) == 0 ? draw(UINT32_MAX) : 0;
        memcpy(at + off + place, bits ? (void *)&bits : (void *)&x, 4);
    }
    return at + off;
}

/* How often each status was told. */
static size_t told[18];

static void counted(cslam_status status) {
    if (status < 0 || status > 17)
        failures++;
    else
        told[status]++;
}

static void random_calls(long calls) {
    size_t size = cslam_estimator_size();
    void *memory = calloc(1, size);
    int16_t *samples = calloc(BLOCK, sizeof *samples);
    cslam_estimator *estimator = memory;
    for (long call = 0; call < calls; call++) {
        void *a, *b, *c, *d = NULL;
        cslam_link link = a_link();
        cslam_measured_path path[3] = {a_path(), a_path(), a_path()};
        cslam_gates gates;
        cslam_gates_default(&gates);
        cslam_estimator_config config;
        cslam_estimator_config_default(&config);
        cslam_status status;
        size_t count = draw(4);
        uint32_t what = draw(4000);
        if (what < 2200) {
            cslam_point empty = {.size = sizeof empty};
            void *at = spoilt(&empty, sizeof empty, &d);
            status = cslam_solve(spoilt(&link, sizeof link, &a), spoilt(path, sizeof *path, &b), spoilt(&gates, sizeof gates, &c), at);
        } else if (what < 3600) {
            cslam_probabilities empty[3] = {{.size = sizeof *empty}};
            status = cslam_classify(spoilt(&link, sizeof link, &a), spoilt(path, sizeof path, &b), count,
                                    spoilt(empty, sizeof empty, &c));
        } else if (what < 3990) {
            cslam_path paths[PATHS] = {{.size = sizeof(cslam_path)}};
            size_t found = 0;
            void *at = spoilt(paths, sizeof paths, &a);
            b = malloc(1), c = malloc(1);
            status = draw(3) ? cslam_estimator_finish(draw(9) ? estimator : NULL, at, PATHS - draw(2), &found)
                             : cslam_block_power(draw(4) ? samples : NULL, BLOCK - draw(2), (int32_t)draw(300) - 150, &(float){0});
        } else {
            a = malloc(1), b = malloc(1);
            void *told_config = spoilt(&config, sizeof config, &c);
            cslam_estimator *built;
            cslam_estimator_config_wrong_field(told_config);
            switch (draw(4)) {
            case 0: status = cslam_estimator_init(memory, size - draw(2), told_config, &built); break;
            case 1: status = cslam_estimator_end(estimator); break;
            default:
                for (size_t i = 0; i < BLOCK; i += 1 + draw(40))
                    samples[i] = (int16_t)draw(65536);
                status = cslam_estimator_push_beam(estimator, samples, BLOCK, (uint16_t)draw(80), (int32_t)draw(240) - 120, NULL);
            }
        }
        counted(status);
        free(a), free(b), free(c), free(d);
    }
    cslam_estimator_end(estimator);
    free(samples);
    free(memory);
}

/* Sensors, clock and sweeps of a receiver as nobody would deliver them. */
static void random_receiver_calls(long calls) {
    size_t size = cslam_receiver_size();
    void *memory = calloc(1, size);
    int16_t *samples = calloc(BLOCK, sizeof *samples);
    cslam_receiver *receiver = memory;
    uint64_t now_ns = 0;
    uint32_t sweep = 0;
    for (long call = 0; call < calls; call++) {
        void *a = NULL, *b = NULL;
        cslam_status status;
        cslam_receiver *to = draw(50) ? receiver : NULL;
        now_ns += draw(3000000);
        uint64_t time_ns = draw(500) ? now_ns : (uint64_t)draw(UINT32_MAX) << draw(32);
        uint32_t of = draw(50) ? sweep : draw(UINT32_MAX), what = draw(1000);
        float still[3] = {0, 0, 0}, weight[3] = {0, 0, 9.81f}, powers[72] = {0};
        if (what < 4) {
            cslam_receiver_config config = a_receiver();
            cslam_receiver *built;
            status = cslam_receiver_init(memory, size - !draw(4), spoilt(&config, sizeof config, &a), &built);
        } else if (what < 5) {
            status = draw(2) ? cslam_receiver_close(to) : cslam_receiver_end(to);
        } else if (what < 25) {
            for (size_t i = 0; i < BLOCK; i += 1 + draw(4000))
                samples[i] = (int16_t)draw(65536);
            uint16_t block = (uint16_t)draw(what < 15 ? 74 : 146);
            int32_t exponent = (int32_t)draw(240) - 120;
            status = what < 10   ? cslam_receiver_beam(to, of, time_ns, samples, BLOCK - !draw(9), block, exponent)
                     : what < 15 ? cslam_receiver_squint(to, of, time_ns, samples, BLOCK - !draw(9), block, exponent)
                                 : cslam_receiver_pilot(to, of, time_ns, samples, BLOCK - !draw(9), block, exponent);
        } else if (what < 50) {
            cslam_beacon beacon = {.size = sizeof beacon, .sweep = of, .position_m = {0, 0, 2}, .attitude_wxyz = {1}, .sigma_m = 0.1f, .sweeps_per_stop = 4};
            sweep++;
            status = cslam_receiver_beacon(to, time_ns, spoilt(&beacon, sizeof beacon, &a));
        } else if (what < 100) {
            status = cslam_receiver_powers(to, of, time_ns, spoilt(powers, sizeof powers, &a));
        } else if (what < 150) {
            cslam_pose pose = {.size = sizeof pose};
            status = cslam_receiver_pose(to, spoilt(&pose, sizeof pose, &a));
        } else if (what < 170) {
            cslam_map_point points[4] = {{.size = sizeof *points}};
            size_t found;
            status = cslam_receiver_map(to, spoilt(points, sizeof points, &a), 4 - draw(4), draw(9) ? &found : NULL);
        } else if (what < 250) {
            size_t room = draw(300), taken;
            a = malloc(room + 1);
            status = cslam_receiver_take_packets(to, a, room, &taken);
        } else if (what < 300) {
            uint8_t bytes[64];
            for (size_t i = 0; i < sizeof bytes; i++)
                bytes[i] = (uint8_t)draw(256);
            size_t length = draw(65);
            a = malloc(length + 1);
            memcpy(a, bytes, length);
            status = cslam_receiver_uplink(to, time_ns, a, length);
        } else if (what < 350) {
            status = cslam_receiver_timing(to, time_ns, draw(2) ? number() : 1e-9 * draw(1000));
        } else if (what < 400) {
            status = cslam_receiver_magnetometer(to, time_ns, spoilt(weight, sizeof weight, &a));
        } else if (what < 450) {
            status = cslam_receiver_elapse(to, time_ns);
        } else {
            status = cslam_receiver_imu(to, time_ns, spoilt(still, sizeof still, &a), spoilt(weight, sizeof weight, &b));
        }
        counted(status);
        free(a), free(b);
    }
    cslam_receiver_end(receiver);
    free(samples);
    free(memory);
}

int main(int count, char **words) {
    long calls = count > 1 ? atol(words[1]) : 1000;
    state = count > 2 ? (uint64_t)atol(words[2]) : 1;
    random_calls(calls);
    random_receiver_calls(calls / 4);
    for (int s = 0; s < 18; s++)
        if (told[s] > 0)
            printf("%9zu  %s\n", told[s], cslam_status_text(s));
    printf("%ld random calls, %d failures\n", calls + calls / 4, failures);
    return failures == 0 ? 0 : 1;
}
