/* The paths of one recorded sweep, as lines of numbers: `estimate NAME.sigmf-meta` (docs/bindings.md).
 *
 * Prints what `cslam estimate --csv` and the example of cslam-core print, character for character. Also for a Cortex-M7: files come by
 * semihosting there. Looks for two keys of the metadata and believes the rest: a program of your own reads the JSON. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cslam.h"

enum { BEAMS = 72, CHANNELS = 32, SAMPLES = 512, PATHS = 9, BLOCK = CHANNELS * SAMPLES * 2 };

static char text[1 << 17];
static uint32_t samples[BEAMS][BLOCK / 2]; /* words, so that pairs are aligned */
static uint32_t interleaved[SAMPLES][CHANNELS];
static uint16_t beams[BEAMS];
static int32_t exponents[BEAMS];

#ifndef CSLAM_STD
#ifdef __ARM_ARCH
void cslam_panic(void) {
    abort();
}
#endif
#endif

static int failed(const char *what, cslam_status status) {
    fprintf(stderr, "%s: %s\n", what, cslam_status_text(status));
    return EXIT_FAILURE;
}

/* The number behind a key, and the place behind it; NULL when there is none. */
static const char *number(const char *from, const char *key, long *value) {
    const char *found = strstr(from, key);
    if (found == NULL)
        return NULL;
    char *end;
    *value = strtol(found + strlen(key), &end, 10);
    return end;
}

/* Reads both files; the number of beams, 0 when they cannot be read. */
static size_t read_sweep(const char *name) {
    char other[1024];
    size_t length = strlen(name);
    FILE *meta = fopen(name, "rb");
    if (meta == NULL || length < 4 || length >= sizeof other)
        return 0;
    text[fread(text, 1, sizeof text - 1, meta)] = '\0';
    fclose(meta);
    strcpy(other, name);
    strcpy(other + length - 4, "data");
    FILE *data = fopen(other, "rb");
    if (data == NULL)
        return 0;
    size_t count = 0;
    const char *at = text;
    for (; count < BEAMS; count++) {
        long beam, exponent;
        at = number(at, "\"cslam:beam\":", &beam);
        at = at != NULL ? number(at, "\"cslam:exponent\":", &exponent) : NULL;
        if (at == NULL || fread(interleaved, sizeof interleaved, 1, data) != 1)
            break;
        beams[count] = (uint16_t)beam;
        exponents[count] = (int32_t)exponent; /* of this beam */
        /* The file has the channels sample by sample; the receiver wants one channel after the other. */
        for (size_t n = 0; n < SAMPLES; n++)
            for (size_t channel = 0; channel < CHANNELS; channel++)
                samples[count][channel * SAMPLES + n] = interleaved[n][channel];
    }
    fclose(data);
    return count;
}

static void print(const cslam_path *p) {
    printf("%.6f,%.8f,%.8f,%.8f,", p->c_tau_m, p->aoa_body[0], p->aoa_body[1], p->aoa_body[2]);
    if (p->has_departure)
        printf("%.8f,%.8f,%.8f,%.8f,", p->aod_world[0], p->aod_world[1], p->aod_world[2], p->aod_sigma_rad);
    else
        printf(",,,,");
    printf("%.5f,%u", p->snr_db, (unsigned)p->beam);
    static const int upper[6] = {0, 1, 2, 4, 5, 8};
    for (int i = 0; i < 6; i++)
        printf(",%.12f", p->covariance[upper[i]]);
    printf("\n");
}

int main(int count_of_words, char **words) {
    size_t heard = read_sweep(count_of_words > 1 ? words[1] : "sweep.sigmf-meta");
    if (heard == 0) {
        fprintf(stderr, "expected a recording: NAME.sigmf-meta with NAME.sigmf-data beside it\n");
        return EXIT_FAILURE;
    }
    /* On a chip: a static array. Zeroed, as the header asks for. */
    size_t size = cslam_estimator_size();
    void *memory = calloc(1, size);
    cslam_estimator *estimator;
    /* One sweep teaches nothing of the arrays before its paths are wanted: two degrees an element. */
    cslam_estimator_config config = {.size = sizeof config};
    cslam_estimator_config_default(&config);
    config.element_errors_learned = 0;
    config.element_errors = 0.035F;
    cslam_status status = cslam_estimator_init(memory, size, &config, &estimator);
    if (status != CSLAM_STATUS_OK)
        return failed("estimator", status);
    cslam_path paths[PATHS] = {{.size = sizeof(cslam_path)}};
    size_t found;
    status = cslam_estimator_sweep(estimator, (int16_t *)samples, heard * BLOCK, beams, exponents, heard, paths, PATHS, &found);
    if (status != CSLAM_STATUS_OK)
        return failed("sweep", status);
    printf("c_tau_m,aoa_x,aoa_y,aoa_z,aod_x,aod_y,aod_z,aod_sigma_rad,snr_db,beam,"
           "cov_rr_m2,cov_r1_m_rad,cov_r2_m_rad,cov_11_rad2,cov_12_rad2,cov_22_rad2\n");
    for (size_t i = 0; i < found; i++)
        print(&paths[i]);
    status = cslam_estimator_end(estimator);
    free(memory);
    return status == CSLAM_STATUS_OK ? EXIT_SUCCESS : failed("end", status);
}
