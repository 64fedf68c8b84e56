/* Wrong arguments give a status, never undefined behaviour: every kind of them once. Built with -fsanitize=address,undefined, and run by
 * valgrind. Every buffer is of its own, exactly as long as it says. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "given.h"

static int failures;

#define EXPECT(call, wanted)                                                                             \
    do {                                                                                                 \
        cslam_status got_ = (call);                                                                      \
        if (got_ != (wanted)) {                                                                          \
            printf("line %d: %s gave \"%s\", expected \"%s\"\n", __LINE__, #call, cslam_status_text(got_), \
                   cslam_status_text(wanted));                                                           \
            failures++;                                                                                  \
        }                                                                                                \
    } while (0)

static void handles(void) {
    size_t size = cslam_estimator_size();
    unsigned char *memory = calloc(1, size);
    cslam_estimator *estimator = NULL;
    EXPECT(cslam_estimator_init(NULL, size, NULL, &estimator), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_init(memory, size, NULL, NULL), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_init(memory + 1, size - 1, NULL, &estimator), CSLAM_STATUS_MISALIGNED);
    EXPECT(cslam_estimator_init(memory, size - 1, NULL, &estimator), CSLAM_STATUS_TOO_SHORT);
    EXPECT(cslam_estimator_init(memory, 0, NULL, &estimator), CSLAM_STATUS_TOO_SHORT);
    /* Before there is one. */
    size_t found;
    cslam_path paths[PATHS] = {{.size = sizeof(cslam_path)}};
    estimator = (cslam_estimator *)memory;
    EXPECT(cslam_estimator_finish(estimator, paths, PATHS, &found), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_estimator_end(estimator), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_estimator_end(NULL), CSLAM_STATUS_NULL);
    /* What cannot be is named. */
    cslam_estimator_config config;
    EXPECT(cslam_estimator_config_default(NULL), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_config_default(&config), CSLAM_STATUS_OK);
    if (cslam_estimator_config_wrong_field(&config) != NULL)
        failures++;
    config.dynamic_range_db = NAN;
    EXPECT(cslam_estimator_init(memory, size, &config, &estimator), CSLAM_STATUS_CONFIG);
    if (estimator != NULL || strcmp(cslam_estimator_config_wrong_field(&config), "dynamic_range_db") != 0)
        failures++;
    EXPECT(cslam_estimator_config_default(&config), CSLAM_STATUS_OK);
    config.screening = 2;
    EXPECT(cslam_estimator_init(memory, size, &config, &estimator), CSLAM_STATUS_CONFIG);
    config.size = 8;
    EXPECT(cslam_estimator_init(memory, size, &config, &estimator), CSLAM_STATUS_SIZE);
    /* Twice, and after its end. */
    EXPECT(cslam_estimator_init(memory, size, NULL, &estimator), CSLAM_STATUS_OK);
    cslam_estimator *second;
    EXPECT(cslam_estimator_init(memory, size, NULL, &second), CSLAM_STATUS_ALREADY_READY);
    unsigned char *copy = malloc(size);
    memcpy(copy, memory, size);
    EXPECT(cslam_estimator_end((cslam_estimator *)copy), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_estimator_init(copy, size, NULL, &second), CSLAM_STATUS_OK);
    EXPECT(cslam_estimator_end(second), CSLAM_STATUS_OK);
    free(copy);

    int16_t *samples = calloc(BLOCK, sizeof *samples);
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK, 0, -38, NULL), CSLAM_STATUS_OK);
    EXPECT(cslam_estimator_push_beam(estimator, NULL, BLOCK, 0, -38, NULL), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_push_beam(estimator, samples + 1, BLOCK - 1, 0, -38, NULL), CSLAM_STATUS_MISALIGNED);
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK - 1, 0, -38, NULL), CSLAM_STATUS_TOO_SHORT);
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK, 72, -38, NULL), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK, 0, 101, NULL), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_estimator_push_beam(NULL, samples, BLOCK, 0, -38, NULL), CSLAM_STATUS_NULL);
    cslam_beam_report report = {.size = 1};
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK, 0, -38, &report), CSLAM_STATUS_SIZE);
    float power;
    EXPECT(cslam_block_power(samples, BLOCK, 0, &power), CSLAM_STATUS_OK);
    EXPECT(cslam_block_power(samples, BLOCK, INT32_MIN, &power), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_block_power(samples, BLOCK, 0, NULL), CSLAM_STATUS_NULL);
    EXPECT(cslam_block_power(NULL, BLOCK, 0, &power), CSLAM_STATUS_NULL);
    EXPECT(cslam_block_power(samples, 7, 0, &power), CSLAM_STATUS_TOO_SHORT);
    uint16_t beams[2] = {3, 3};
    int32_t exponents[2] = {0, 0};
    EXPECT(cslam_estimator_sweep(estimator, samples, BLOCK, beams, exponents, 2, paths, PATHS, &found), CSLAM_STATUS_TOO_SHORT);
    EXPECT(cslam_estimator_sweep(estimator, samples, BLOCK, beams, exponents, 0, paths, PATHS, &found), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_estimator_sweep(estimator, samples, SIZE_MAX, beams, exponents, 73, paths, PATHS, &found), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_estimator_sweep(estimator, samples, BLOCK, NULL, exponents, 1, paths, PATHS, &found), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_sweep(estimator, samples, BLOCK, beams, NULL, 1, paths, PATHS, &found), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_sweep(estimator, samples, BLOCK, beams, exponents, 1, paths, PATHS, &found), CSLAM_STATUS_OK);
    int16_t *two = calloc(2 * BLOCK, sizeof *two);
    EXPECT(cslam_estimator_sweep(estimator, two, 2 * BLOCK, beams, exponents, 2, paths, PATHS, &found), CSLAM_STATUS_OUT_OF_RANGE);
    free(two);
    EXPECT(cslam_estimator_finish(estimator, paths, PATHS - 1, &found), CSLAM_STATUS_TOO_SHORT);
    EXPECT(cslam_estimator_finish(estimator, NULL, PATHS, &found), CSLAM_STATUS_NULL);
    EXPECT(cslam_estimator_finish(estimator, paths, PATHS, NULL), CSLAM_STATUS_NULL);
    paths[0].size = 0;
    EXPECT(cslam_estimator_finish(estimator, paths, PATHS, &found), CSLAM_STATUS_SIZE);
    EXPECT(cslam_estimator_end(estimator), CSLAM_STATUS_OK);
    EXPECT(cslam_estimator_end(estimator), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_estimator_push_beam(estimator, samples, BLOCK, 0, -38, NULL), CSLAM_STATUS_NOT_READY);
    free(samples);
    free(memory);
}

static void values(void) {
    cslam_link link = a_link();
    cslam_measured_path path = a_path();
    cslam_point point = {.size = sizeof point};
    cslam_gates gates;
    EXPECT(cslam_gates_default(&gates), CSLAM_STATUS_OK);
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_OK);
    if (point.verdict != 0 || fabsf(point.position_m[1] - 20) > 0.01f)
        failures++;
    EXPECT(cslam_solve(NULL, &path, NULL, &point), CSLAM_STATUS_NULL);
    EXPECT(cslam_solve(&link, NULL, NULL, &point), CSLAM_STATUS_NULL);
    EXPECT(cslam_solve(&link, &path, NULL, NULL), CSLAM_STATUS_NULL);
    EXPECT(cslam_solve((cslam_link *)((char *)&link + 1), &path, NULL, &point), CSLAM_STATUS_MISALIGNED);
    link.size++;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_SIZE);
    link = a_link();
    link.uav_m[1] = NAN;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_NOT_FINITE);
    link = a_link();
    memcpy(link.gmt_m, link.uav_m, sizeof link.gmt_m);
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_COINCIDENT_ENDS);
    link = a_link();
    link.uav_covariance_m2[4] = -1;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_COVARIANCE);
    link = a_link();
    path.c_tau_m = INFINITY;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_NOT_FINITE);
    path.c_tau_m = -1;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_NO_LENGTH);
    path.c_tau_m = 5;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_DELAY_TOO_SHORT);
    path = a_path();
    memset(path.aoa_world, 0, sizeof path.aoa_world);
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_NO_LENGTH);
    path = a_path();
    path.has_departure = 7;
    EXPECT(cslam_solve(&link, &path, NULL, &point), CSLAM_STATUS_OUT_OF_RANGE);
    path = a_path();
    gates.max_sigma_m = NAN;
    EXPECT(cslam_solve(&link, &path, &gates, &point), CSLAM_STATUS_NOT_FINITE);
    cslam_gates_default(&gates);
    gates.has_bounds = 1;
    EXPECT(cslam_solve(&link, &path, &gates, &point), CSLAM_STATUS_OUT_OF_RANGE);

    cslam_measured_path both[2] = {a_path(), a_path()};
    cslam_probabilities said[2] = {{.size = sizeof *said}};
    EXPECT(cslam_classify(&link, both, 2, said), CSLAM_STATUS_OK);
    if (fabsf(said[1].line_of_sight + said[1].first_order + said[1].higher_order - 1) > 1e-5f)
        failures++;
    EXPECT(cslam_classify(&link, both, 0, said), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_classify(&link, both, 33, said), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_classify(&link, NULL, 2, said), CSLAM_STATUS_NULL);
    EXPECT(cslam_classify(&link, both, 2, NULL), CSLAM_STATUS_NULL);
    both[1].has_gain = 1;
    both[1].gain_db = NAN;
    EXPECT(cslam_classify(&link, both, 2, said), CSLAM_STATUS_NOT_FINITE);
    for (int32_t number = -2; number < 40; number++)
        if (strlen(cslam_status_text(number)) == 0 || strlen(cslam_verdict_text(number)) == 0)
            failures++;
}

/* Two threads with one handle: one works, the other is told so. They go on until one was told, however the machine shares its processors
 * out between them, or until it is plain that nobody ever is. */
enum { MOST_CALLS = 2000000 };

typedef cslam_status use(int16_t *samples, uint16_t beam);

static cslam_estimator *estimator_of_both;
static cslam_receiver *receiver_of_both;
static use *used;
static int told_busy;

static cslam_status use_estimator(int16_t *samples, uint16_t beam) {
    return cslam_estimator_push_beam(estimator_of_both, samples, BLOCK, beam, 0, NULL);
}

static cslam_status use_receiver(int16_t *samples, uint16_t beam) {
    return cslam_receiver_beam(receiver_of_both, 1, 1000000, samples, BLOCK, beam, 0);
}

static void *uses(void *samples) {
    for (int i = 0; i < MOST_CALLS && !__atomic_load_n(&told_busy, __ATOMIC_RELAXED); i++) {
        cslam_status status = used(samples, (uint16_t)(i % 72));
        if (status == CSLAM_STATUS_BUSY)
            __atomic_store_n(&told_busy, 1, __ATOMIC_RELAXED);
        else if (status != CSLAM_STATUS_OK)
            __atomic_fetch_add(&failures, 1, __ATOMIC_RELAXED);
    }
    return NULL;
}

static void contend(const char *what, use *call) {
    pthread_t thread[2];
    int16_t *samples[2];
    used = call;
    told_busy = 0;
    for (int t = 0; t < 2; t++) {
        samples[t] = calloc(BLOCK, sizeof **samples);
        pthread_create(&thread[t], NULL, uses, samples[t]);
    }
    for (int t = 0; t < 2; t++) {
        pthread_join(thread[t], NULL);
        free(samples[t]);
    }
    if (!told_busy) {
        printf("two threads used one %s, and none was told that it is busy\n", what);
        failures++;
    }
}

static void threads(void) {
    size_t size = cslam_estimator_size();
    void *memory = calloc(1, size);
    EXPECT(cslam_estimator_init(memory, size, NULL, &estimator_of_both), CSLAM_STATUS_OK);
    contend("estimator", use_estimator);
    EXPECT(cslam_estimator_end(estimator_of_both), CSLAM_STATUS_OK);
    free(memory);
}

static void receivers(void) {
    size_t size = cslam_receiver_size();
    void *memory = calloc(1, size);
    cslam_receiver_config config = a_receiver();
    EXPECT(cslam_receiver_elapse(memory, 1), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_receiver_init((char *)memory + 1, size, &config, &receiver_of_both), CSLAM_STATUS_MISALIGNED);
    EXPECT(cslam_receiver_init(memory, size, &config, &receiver_of_both), CSLAM_STATUS_OK);
    contend("receiver", use_receiver);
    int16_t *samples = calloc(BLOCK + 1, sizeof *samples);
    EXPECT(cslam_receiver_pilot(NULL, 1, 1000000, samples, BLOCK, 0, 0), CSLAM_STATUS_NULL);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, NULL, BLOCK, 0, 0), CSLAM_STATUS_NULL);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples + 1, BLOCK, 0, 0), CSLAM_STATUS_MISALIGNED);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples, BLOCK - 1, 0, 0), CSLAM_STATUS_TOO_SHORT);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples, BLOCK, 144, 0), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples, BLOCK, 0, -101), CSLAM_STATUS_OUT_OF_RANGE);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples, BLOCK, 143, 0), CSLAM_STATUS_OK);
    EXPECT(cslam_receiver_end(receiver_of_both), CSLAM_STATUS_OK);
    float three[3] = {0, 0, 9.81f};
    EXPECT(cslam_receiver_imu(receiver_of_both, 1, three, three), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_receiver_pilot(receiver_of_both, 1, 1000000, samples, BLOCK, 0, 0), CSLAM_STATUS_NOT_READY);
    EXPECT(cslam_receiver_close(receiver_of_both), CSLAM_STATUS_NOT_READY);
    free(samples);
    free(memory);
}

int main(void) {
    handles();
    values();
    threads();
    receivers();
    printf("every kind once, %d failures\n", failures);
    return failures == 0 ? 0 : 1;
}
