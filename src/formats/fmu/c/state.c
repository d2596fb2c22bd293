/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Saved states: copies of an instance's state, and the same as bytes. */
#include "spring.h"

#include <stdlib.h>

/* A state of another curve or kind, or none at all. */
static int is_fit(const spring_t *spring, const state_t *state) {
    return state->table_sum == spring->now.table_sum && state->layout == STATE_LAYOUT &&
           state->kind == spring->now.kind && state->events_used == spring->now.events_used &&
           state->unloading_stiffness > 0.0;
}

/* Byte by byte: what is given may lie anywhere. */
static void copy(uint8_t *to, const uint8_t *from, size_t n) {
    size_t i;
    for (i = 0; i < n; i++) {
        to[i] = from[i];
    }
}

int state_take(spring_t *spring, const char *function, void **state) {
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (state == NULL) {
        return spring_say(spring, SAID_ERROR, function, "no place for the state");
    }
    /* A state that is given is written over, as both versions of the interface have it. */
    if (*state == NULL) {
        *state = calloc(1, sizeof(state_t));
    }
    if (*state == NULL) {
        return spring_say(spring, SAID_ERROR, function, "no memory for the state");
    }
    *(state_t *)*state = spring->now;
    return SAID_OK;
}

int state_put(spring_t *spring, const char *function, const void *state) {
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (state == NULL || !is_fit(spring, state)) {
        return spring_say(spring, SAID_ERROR, function,
                          "the state is missing, or of another kind of instance");
    }
    spring->now = *(const state_t *)state;
    spring_follow_stiffness(spring);
    return SAID_OK;
}

void state_drop(void **state) {
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
}

size_t state_size(void) {
    return sizeof(state_t);
}

int state_write(spring_t *spring, const char *function, const void *state, uint8_t *bytes,
                size_t n) {
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (state == NULL || bytes == NULL || n < sizeof(state_t)) {
        return spring_say(spring, SAID_ERROR, function, "the state is missing, or the room for its bytes is too small");
    }
    copy(bytes, state, sizeof(state_t));
    return SAID_OK;
}

int state_read(spring_t *spring, const char *function, const uint8_t *bytes, size_t n,
               void **state) {
    state_t read;
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (state == NULL || bytes == NULL || n < sizeof read) {
        return spring_say(spring, SAID_ERROR, function, "these bytes are not a state of this curve");
    }
    copy((uint8_t *)&read, bytes, sizeof read);
    if (!is_fit(spring, &read)) {
        return spring_say(spring, SAID_ERROR, function, "these bytes are not a state of this curve");
    }
    if (*state == NULL) {
        *state = calloc(1, sizeof read);
    }
    if (*state == NULL) {
        return spring_say(spring, SAID_ERROR, function, "no memory for the state");
    }
    *(state_t *)*state = read;
    return SAID_OK;
}
