/* Wrong arguments give a status, never undefined behaviour: every kind of them once, then random calls. `misuse CALLS [SEED]`; built with
 * -fsanitize=address,undefined, and run by valgrind. Every buffer is of its own, exactly as long as it says. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cslam.h"

enum { BLOCK = 32 * 512 * 2, PATHS = 9 };

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

static cslam_link a_link(void) {
    cslam_link link = {.size = sizeof link, .uav_m = {12, 40, 6}, .gmt_m = {12, 0, 2}};
    link.uav_covariance_m2[0] = link.uav_covariance_m2[4] = link.uav_covariance_m2[8] = 0.0025f;
    return link;
}

static cslam_measured_path a_path(void) {
    cslam_measured_path path = {.size = sizeof path, .c_tau_m = 46.818f, .aoa_world = {-12, -20, -2}};
    path.covariance[0] = 0.0025f;
    path.covariance[4] = path.covariance[8] = 4e-6f;
    return path;
}

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

/* Two threads with one handle: one works, the other is told so. */
static cslam_estimator *shared;
static size_t busy;

static void *pushes(void *samples) {
    for (int i = 0; i < 300; i++) {
        cslam_status status = cslam_estimator_push_beam(shared, samples, BLOCK, (uint16_t)(i % 72), 0, NULL);
        if (status == CSLAM_STATUS_BUSY)
            __atomic_fetch_add(&busy, 1, __ATOMIC_RELAXED);
        else if (status != CSLAM_STATUS_OK)
            __atomic_fetch_add(&failures, 1, __ATOMIC_RELAXED);
    }
    return NULL;
}

static void threads(void) {
    size_t size = cslam_estimator_size();
    void *memory = calloc(1, size);
    EXPECT(cslam_estimator_init(memory, size, NULL, &shared), CSLAM_STATUS_OK);
    pthread_t other[2];
    int16_t *samples[2];
    for (int t = 0; t < 2; t++) {
        samples[t] = calloc(BLOCK, sizeof **samples);
        pthread_create(&other[t], NULL, pushes, samples[t]);
    }
    for (int t = 0; t < 2; t++) {
        pthread_join(other[t], NULL);
        free(samples[t]);
    }
    EXPECT(cslam_estimator_end(shared), CSLAM_STATUS_OK);
    free(memory);
    printf("of 600 calls of two threads with one handle %zu were told that it is busy\n", busy);
}

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

static void random_calls(long calls) {
    size_t size = cslam_estimator_size();
    void *memory = calloc(1, size);
    int16_t *samples = calloc(BLOCK, sizeof *samples);
    cslam_estimator *estimator = memory;
    size_t told[18] = {0};
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
        if (status < 0 || status > 17)
            failures++;
        else
            told[status]++;
        free(a), free(b), free(c), free(d);
    }
    cslam_estimator_end(estimator);
    free(samples);
    free(memory);
    for (int s = 0; s < 18; s++)
        if (told[s] > 0)
            printf("%9zu  %s\n", told[s], cslam_status_text(s));
}

int main(int count, char **words) {
    long calls = count > 1 ? atol(words[1]) : 1000;
    state = count > 2 ? (uint64_t)atol(words[2]) : 1;
    handles();
    values();
    threads();
    random_calls(calls);
    printf("%ld random calls, %d failures\n", calls, failures);
    return failures == 0 ? 0 : 1;
}
