/* How much stack the calls that build an object take: a line each, `name: bytes`. Every call has a thread of its own, on a stack that is
 * painted before and looked at after. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cslam.h"

enum { STACK = 1 << 20, PAINT = 0xa5, BLOCK = 32 * 512 * 2, PATHS = 9 };

static cslam_estimator *estimator;

static void *builds_nothing(void *unused) {
    return unused;
}

static void *builds_an_estimator(void *memory) {
    return cslam_estimator_init(memory, cslam_estimator_size(), NULL, &estimator) == CSLAM_STATUS_OK ? memory : NULL;
}

static void *builds_a_receiver(void *memory) {
    cslam_receiver_config config = {.size = sizeof config, .uav = 1, .key = {1}};
    cslam_receiver *receiver;
    return cslam_receiver_init(memory, cslam_receiver_size(), &config, &receiver) == CSLAM_STATUS_OK ? memory : NULL;
}

/* Bytes of stack that `work` used of a thread's. */
static size_t used(void *(*work)(void *), void *memory) {
    unsigned char *stack = aligned_alloc(4096, STACK);
    memset(stack, PAINT, STACK);
    pthread_attr_t attributes;
    pthread_t thread;
    void *done = NULL;
    if (pthread_attr_init(&attributes) != 0 || pthread_attr_setstack(&attributes, stack, STACK) != 0 ||
        pthread_create(&thread, &attributes, work, memory) != 0 || pthread_join(thread, &done) != 0 || done != memory) {
        fputs("a call failed\n", stderr);
        exit(1);
    }
    pthread_attr_destroy(&attributes);
    size_t untouched = 0;
    while (untouched < STACK && stack[untouched] == PAINT)
        untouched++;
    free(stack);
    return STACK - untouched;
}

int main(void) {
    printf("cslam_estimator_size: %zu\ncslam_receiver_size: %zu\n", cslam_estimator_size(), cslam_receiver_size());
    /* What a thread takes for itself. */
    size_t before = used(builds_nothing, &estimator);
    void *memory = calloc(1, cslam_estimator_size());
    printf("cslam_estimator_init: %zu\n", used(builds_an_estimator, memory) - before);
    cslam_estimator_end(estimator);
    free(memory);
    memory = calloc(1, cslam_receiver_size());
    printf("cslam_receiver_init: %zu\n", used(builds_a_receiver, memory) - before);
    cslam_receiver_end(memory);
    free(memory);
    return 0;
}
