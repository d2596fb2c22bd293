/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Instances of the spring: made, reset and freed, their modes, and what they say. */
#include "spring.h"

#include <float.h>
#include <stdlib.h>

static int is_finite(double x) {
    return x - x == 0.0;
}

static int is_same(const char *a, const char *b) {
    while (*a != 0 && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

/* Adds text to a message of `room` bytes. */
static size_t add(char *message, size_t at, size_t room, const char *text) {
    while (*text != 0 && at + 1 < room) {
        message[at++] = *text++;
    }
    message[at] = 0;
    return at;
}

static size_t add_number(char *message, size_t at, size_t room, uint32_t number) {
    char digits[11];
    size_t i = sizeof digits - 1;
    digits[i] = 0;
    do {
        digits[--i] = (char)('0' + number % 10);
        number /= 10;
    } while (number != 0);
    return add(message, at, room, digits + i);
}

int spring_say(spring_t *spring, int status, const char *function, const char *what) {
    char message[256];
    size_t at = add(message, 0, sizeof message, function);
    at = add(message, at, sizeof message, ": ");
    add(message, at, sizeof message, what);
    if (spring->logger != NULL && (spring->is_logging || status >= SAID_ERROR)) {
        spring->say(spring, status, message);
    }
    return status;
}

int spring_say_of(spring_t *spring, const char *function, uint32_t vr, const char *what) {
    char message[160];
    size_t at = add(message, 0, sizeof message, "value reference ");
    at = add_number(message, at, sizeof message, vr);
    at = add(message, at, sizeof message, " ");
    add(message, at, sizeof message, what);
    return spring_say(spring, SAID_ERROR, function, message);
}

void spring_reset(spring_t *spring) {
    state_t fresh = {0};
    fresh.table_sum = spring->now.table_sum;
    fresh.layout = STATE_LAYOUT;
    fresh.kind = spring->now.kind;
    fresh.events_used = spring->now.events_used;
    fresh.mode = MODE_INSTANTIATED;
    fresh.stop_time = DBL_MAX;
    fresh.force_scale = 1.0;
    fresh.unloading_stiffness = crumple_table.stiffness;
    spring->now = fresh;
    spring_follow_stiffness(spring);
}

/* What forbids an instance, or NULL. */
static const char *reason_against(const char *name, const char *token) {
    if (name == NULL || *name == 0) {
        return "the instance needs a name";
    }
    if (crumple_table.version != CRUMPLE_TABLE_VERSION || crumple_table.points == 0) {
        return "no curve has been written into this binary";
    }
    if (crumple_table.sum != crumple_table_sum(&crumple_table)) {
        return "the curve in this binary is damaged";
    }
    if (token == NULL || !is_same(token, crumple_table.token)) {
        return "the GUID or instantiation token is not the one of this binary";
    }
    return NULL;
}

spring_t *spring_new(say_t say, void *environment, any_function_t logger, int is_logging,
                     const char *name, const char *token, uint32_t kind) {
    static const char function[] = "instantiate";
    spring_t *spring = calloc(1, sizeof *spring);
    const char *reason = reason_against(name, token);
    size_t n = 0;
    if (spring == NULL) {
        return NULL;
    }
    spring->say = say;
    spring->environment = environment;
    spring->logger = logger;
    spring->is_logging = is_logging;
    while (name != NULL && name[n] != 0) {
        n++;
    }
    spring->name = calloc(n + 1, 1);
    if (spring->name == NULL) {
        free(spring);
        return NULL;
    }
    add(spring->name, 0, n + 1, name == NULL ? "" : name);
    if (reason != NULL) {
        spring_say(spring, SAID_ERROR, function, reason);
        spring_free(spring);
        return NULL;
    }
    spring->law.table = &crumple_table;
    spring->now.table_sum = crumple_table.sum;
    spring->now.kind = kind;
    spring_reset(spring);
    return spring;
}

void spring_free(spring_t *spring) {
    if (spring != NULL) {
        free(spring->name);
        free(spring);
    }
}

int spring_in(spring_t *spring, const char *function, uint32_t modes) {
    const char *what = "not allowed in this mode";
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (spring->now.mode & modes) {
        return SAID_OK;
    }
    switch (spring->now.mode) {
    case MODE_INSTANTIATED: what = "not allowed before initialization"; break;
    case MODE_INITIALIZATION: what = "not allowed in initialization mode"; break;
    case MODE_EVENT: what = "not allowed in event mode"; break;
    case MODE_CONTINUOUS: what = "not allowed in continuous-time mode"; break;
    case MODE_STEP: what = "not allowed between steps of co-simulation"; break;
    case MODE_TERMINATED: what = "not allowed after termination"; break;
    }
    return spring_say(spring, SAID_ERROR, function, what);
}

int spring_change(spring_t *spring, const char *function, uint32_t modes, uint32_t to) {
    int said = spring_in(spring, function, modes);
    if (said == SAID_OK) {
        spring->now.mode = to;
    }
    return said;
}

int spring_start(spring_t *spring, const char *function, double start, int has_stop, double stop) {
    int said = spring_in(spring, function, MODE_INSTANTIATED);
    if (said != SAID_OK) {
        return said;
    }
    if (!is_finite(start) || (has_stop && !(stop >= start))) {
        return spring_say(spring, SAID_ERROR, function, "no start time, or a stop time before it");
    }
    spring->now.time = start;
    spring->now.stop_time = has_stop ? stop : DBL_MAX;
    return SAID_OK;
}

int spring_none(spring_t *spring, const char *function, size_t n) {
    if (spring == NULL) {
        return SAID_ERROR;
    }
    if (n == 0) {
        return SAID_OK;
    }
    return spring_say(spring, SAID_ERROR, function, "the spring has none of these");
}
