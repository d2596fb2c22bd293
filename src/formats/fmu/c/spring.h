/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* An instance of the spring: what both versions of the interface share. */
#ifndef CRUMPLE_SPRING_H
#define CRUMPLE_SPRING_H

#include <stddef.h>
#include <stdint.h>

#include "law.h"

#define STATE_LAYOUT 3u

/* Value references, the same in both versions; time is a variable in FMI 3 only. 2 is kept for a
 * second input, `deflection_rate`, should the law come to depend on it: nothing else moves then. */
enum {
    VR_TIME = 0,
    VR_DEFLECTION = 1,
    VR_FORCE = 3,
    VR_STORED_ENERGY = 4,
    VR_DISSIPATED_ENERGY = 5,
    VR_LARGEST_DEFLECTION = 6,
    VR_FORCE_SCALE = 7,
    VR_PAST_KNOT = 8,
    VR_BEFORE_KNOT = 9,
    VR_UNLOADING_STIFFNESS = 10
};

/* The event indicators: VR_PAST_KNOT and VR_BEFORE_KNOT. */
#define INDICATORS 2

/* Numbers of fmi2Status and fmi3Status. */
enum { SAID_OK = 0, SAID_WARNING = 1, SAID_DISCARD = 2, SAID_ERROR = 3 };

/* Modes, as bits, so that a call can name all in which it is allowed. */
enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALIZATION = 2,
    MODE_EVENT = 4,
    MODE_CONTINUOUS = 8,
    MODE_STEP = 16,
    MODE_TERMINATED = 32
};

enum { MODEL_EXCHANGE = 0, CO_SIMULATION = 1 };

/* All that a saved state must hold. Without padding, since it is written byte by byte; up to 128 bytes are
 * copied without a call of the C library, which the Windows library lacks. */
typedef struct {
    uint64_t table_sum; /* a state of another curve is refused */
    uint32_t layout;
    uint32_t kind; /* model exchange or co-simulation */
    uint32_t mode;
    uint32_t events_used; /* FMI 3 co-simulation with event mode */
    double time;
    double stop_time;   /* beyond all times where none was given */
    double deflection;
    double rates[2];    /* its first and second derivative, for the next step */
    double largest;     /* maximum deflection at an accepted point, 0 at least */
    law_piece_t piece;  /* of the last event of model exchange: its ends are the next events */
    double force_scale;
    double unloading_stiffness;
} state_t;

typedef struct spring spring_t;

/* A function whose type its version knows. */
typedef void (*any_function_t)(void);

/* Passes a message on to the importer, in the way of its version. */
typedef void (*say_t)(spring_t *spring, int status, const char *message);

struct spring {
    state_t now;
    law_t law; /* with the unloading stiffness of the state */
    say_t say;
    int is_logging;
    /* The importer's. */
    void *environment;
    any_function_t logger;
    char *name;
};

CRUMPLE_INSIDE

/* A new instance, or NULL after a message. `logger` may be NULL. */
spring_t *spring_new(say_t say, void *environment, any_function_t logger, int is_logging,
                     const char *name, const char *token, uint32_t kind);
void spring_free(spring_t *spring);

/* Logs "FUNCTION: WHAT" and returns the status. Errors are always said, the rest where logging is
 * on. */
int spring_say(spring_t *spring, int status, const char *function, const char *what);

/* An error about one variable. */
int spring_say_of(spring_t *spring, const char *function, uint32_t vr, const char *what);

/* SAID_OK if the instance is in one of the modes, else an error is said. */
int spring_in(spring_t *spring, const char *function, uint32_t modes);

/* From one of `modes` to another mode. */
int spring_change(spring_t *spring, const char *function, uint32_t modes, uint32_t to);

void spring_reset(spring_t *spring);

/* Start and stop time of the experiment. */
int spring_start(spring_t *spring, const char *function, double start, int has_stop, double stop);
int spring_set_time(spring_t *spring, const char *function, double time);

int spring_get(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
               double *values);
int spring_set(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
               const double *values);

/* Derivatives of inputs over time for the next step; order 1 or 2. */
int spring_set_rates(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
                     const int32_t *order, const double *values);

/* Whether the curve unloads along branches of its own. */
int spring_has_memory(void);

/* After the unloading stiffness of the state has changed. */
void spring_follow_stiffness(spring_t *spring);

/* The present point is accepted: the memory moves here and nowhere else. */
void spring_remember(spring_t *spring);

/* The same at an event, from which on the piece of the law counts that the present point is on. */
void spring_settle(spring_t *spring);

/* The same at the end of an integrator's step; 1 if the point lies on another piece than at the last
 * event, so that an event is due. */
int spring_accept(spring_t *spring);

/* How far in m the deflection lies beyond the lower end of its piece and before the upper one; at
 * most 1. Below 0 after the end has been crossed. */
void spring_knots(const spring_t *spring, double knots[INDICATORS]);

/* The same as event indicators of model exchange. */
int spring_indicators(spring_t *spring, const char *function, double indicators[], size_t n);

int spring_step(spring_t *spring, const char *function, double point, double step);

/* Partial derivatives times a seed of the knowns (forward) or of the unknowns (backward). */
int spring_forward(spring_t *spring, const char *function, const uint32_t *unknown, size_t unknowns,
                   const uint32_t *known, size_t knowns, const double *seed, double *result);
int spring_backward(spring_t *spring, const char *function, const uint32_t *unknown,
                    size_t unknowns, const uint32_t *known, size_t knowns, const double *seed,
                    double *result);

/* For calls on what the spring has none of, such as states or strings: an error unless n is 0. */
int spring_none(spring_t *spring, const char *function, size_t n);

/* Saved states, which the importer owns. */
int state_take(spring_t *spring, const char *function, void **state);
int state_put(spring_t *spring, const char *function, const void *state);
void state_drop(void **state);
size_t state_size(void);
int state_write(spring_t *spring, const char *function, const void *state, uint8_t *bytes,
                size_t n);
int state_read(spring_t *spring, const char *function, const uint8_t *bytes, size_t n,
               void **state);

CRUMPLE_INSIDE_END

#endif
