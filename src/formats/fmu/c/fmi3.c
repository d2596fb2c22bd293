/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* FMI 3.0, model exchange and co-simulation: the functions an importer calls, on top of spring.h.
 * Written from the standard's text (fmi-standard.org, 3.0.2); no headers of the standard are
 * needed. What the spring has none of stands in fmi3_none.c. */
#include <stdbool.h>

#include "spring.h"

#define FMI3(name) CRUMPLE_EXPORT int CRUMPLE_NAME(fmi3##name)

typedef void *instance_t;
typedef uint32_t reference_t;
typedef const char *string_t;
typedef void (*logger_t)(void *environment, int status, string_t category, string_t message);
typedef void (*intermediate_update_t)(void *environment, double time, bool is_set_requested,
                                      bool is_get_allowed, bool is_step_finished,
                                      bool can_return_early, bool *early_return,
                                      double *early_time);

static void say(spring_t *spring, int status, string_t message) {
    string_t category = status >= SAID_ERROR ? "logStatusError" : "logStatusWarning";
    ((logger_t)spring->logger)(spring->environment, status, category, message);
}

CRUMPLE_EXPORT string_t CRUMPLE_NAME(fmi3GetVersion)(void) {
    return "3.0";
}

FMI3(SetDebugLogging)(instance_t c, bool is_on, size_t n, const string_t categories[]) {
    (void)n;
    (void)categories; /* there is one kind of message besides errors, which are always said */
    if (c == NULL) {
        return SAID_ERROR;
    }
    ((spring_t *)c)->is_logging = is_on;
    return SAID_OK;
}

CRUMPLE_EXPORT instance_t CRUMPLE_NAME(fmi3InstantiateModelExchange)(
    string_t name, string_t token, string_t resources, bool is_visible, bool is_logging,
    void *environment, logger_t logger) {
    (void)resources;
    (void)is_visible;
    return spring_new(say, environment, (any_function_t)logger, is_logging, name, token,
                      MODEL_EXCHANGE);
}

CRUMPLE_EXPORT instance_t CRUMPLE_NAME(fmi3InstantiateCoSimulation)(
    string_t name, string_t token, string_t resources, bool is_visible, bool is_logging,
    bool has_events, bool may_return_early, const reference_t intermediate[], size_t intermediates,
    void *environment, logger_t logger, intermediate_update_t update) {
    spring_t *spring = spring_new(say, environment, (any_function_t)logger, is_logging, name, token,
                                  CO_SIMULATION);
    (void)resources;
    (void)is_visible;
    (void)may_return_early;
    (void)intermediate;
    (void)intermediates;
    (void)update;
    if (spring != NULL) {
        spring->now.events_used = has_events;
    }
    return spring;
}

CRUMPLE_EXPORT void CRUMPLE_NAME(fmi3FreeInstance)(instance_t c) {
    spring_free(c);
}

FMI3(EnterInitializationMode)(instance_t c, bool has_tolerance, double tolerance, double start,
                              bool has_stop, double stop) {
    static const char function[] = "fmi3EnterInitializationMode";
    int said = spring_start(c, function, start, has_stop, stop);
    (void)has_tolerance;
    (void)tolerance;
    return said != SAID_OK ? said
                           : spring_change(c, function, MODE_INSTANTIATED, MODE_INITIALIZATION);
}

FMI3(ExitInitializationMode)(instance_t c) {
    spring_t *spring = c;
    int said = spring_in(spring, "fmi3ExitInitializationMode", MODE_INITIALIZATION);
    if (said == SAID_OK) {
        int is_stepping = spring->now.kind == CO_SIMULATION && !spring->now.events_used;
        spring_settle(spring); /* a spring may be compressed at the start */
        spring->now.mode = is_stepping ? MODE_STEP : MODE_EVENT;
    }
    return said;
}

FMI3(EnterEventMode)(instance_t c) {
    static const char function[] = "fmi3EnterEventMode";
    spring_t *spring = c;
    int said = spring_change(spring, function, MODE_CONTINUOUS | MODE_STEP, MODE_EVENT);
    if (said == SAID_OK && spring->now.kind == CO_SIMULATION && !spring->now.events_used) {
        spring->now.mode = MODE_STEP;
        return spring_say(spring, SAID_ERROR, function, "instantiated without event mode");
    }
    return said;
}

FMI3(Terminate)(instance_t c) {
    return spring_change(c, "fmi3Terminate", MODE_EVENT | MODE_CONTINUOUS | MODE_STEP,
                         MODE_TERMINATED);
}

FMI3(Reset)(instance_t c) {
    if (c == NULL) {
        return SAID_ERROR;
    }
    spring_reset(c);
    return SAID_OK;
}

FMI3(GetFloat64)(instance_t c, const reference_t vr[], size_t n, double values[], size_t n_values) {
    if (c != NULL && n != n_values) {
        return spring_say(c, SAID_ERROR, "fmi3GetFloat64", "each variable has one value");
    }
    return spring_get(c, "fmi3GetFloat64", vr, n, values);
}

FMI3(SetFloat64)(instance_t c, const reference_t vr[], size_t n, const double values[],
                 size_t n_values) {
    if (c != NULL && n != n_values) {
        return spring_say(c, SAID_ERROR, "fmi3SetFloat64", "each variable has one value");
    }
    return spring_set(c, "fmi3SetFloat64", vr, n, values);
}

FMI3(GetFMUState)(instance_t c, void **state) {
    return state_take(c, "fmi3GetFMUState", state);
}

FMI3(SetFMUState)(instance_t c, void *state) {
    return state_put(c, "fmi3SetFMUState", state);
}

FMI3(FreeFMUState)(instance_t c, void **state) {
    (void)c;
    state_drop(state);
    return SAID_OK;
}

FMI3(SerializedFMUStateSize)(instance_t c, void *state, size_t *size) {
    (void)state;
    *size = state_size();
    return c == NULL ? SAID_ERROR : SAID_OK;
}

FMI3(SerializeFMUState)(instance_t c, void *state, uint8_t bytes[], size_t n) {
    return state_write(c, "fmi3SerializeFMUState", state, bytes, n);
}

FMI3(DeserializeFMUState)(instance_t c, const uint8_t bytes[], size_t n, void **state) {
    return state_read(c, "fmi3DeserializeFMUState", bytes, n, state);
}

FMI3(GetDirectionalDerivative)(instance_t c, const reference_t unknown[], size_t unknowns,
                               const reference_t known[], size_t knowns, const double seed[],
                               size_t seeds, double result[], size_t results) {
    static const char function[] = "fmi3GetDirectionalDerivative";
    if (c != NULL && (seeds != knowns || results != unknowns)) {
        return spring_say(c, SAID_ERROR, function, "each variable has one value");
    }
    return spring_forward(c, function, unknown, unknowns, known, knowns, seed, result);
}

FMI3(GetAdjointDerivative)(instance_t c, const reference_t unknown[], size_t unknowns,
                           const reference_t known[], size_t knowns, const double seed[],
                           size_t seeds, double result[], size_t results) {
    static const char function[] = "fmi3GetAdjointDerivative";
    if (c != NULL && (seeds != unknowns || results != knowns)) {
        return spring_say(c, SAID_ERROR, function, "each variable has one value");
    }
    return spring_backward(c, function, unknown, unknowns, known, knowns, seed, result);
}

/* Events: the importer's, and in model exchange those at the knots of the law. */

FMI3(EvaluateDiscreteStates)(instance_t c) {
    return spring_in(c, "fmi3EvaluateDiscreteStates", MODE_INITIALIZATION | MODE_EVENT);
}

FMI3(UpdateDiscreteStates)(instance_t c, bool *update_needed, bool *terminate,
                           bool *nominals_changed, bool *values_changed, bool *has_next_event,
                           double *next_event_time) {
    int said = spring_in(c, "fmi3UpdateDiscreteStates", MODE_EVENT);
    *update_needed = *terminate = *nominals_changed = *values_changed = *has_next_event = false;
    *next_event_time = 0.0;
    if (said == SAID_OK) {
        spring_settle(c); /* an input may have jumped at the event */
    }
    return said;
}

/* Model exchange. */

FMI3(EnterContinuousTimeMode)(instance_t c) {
    static const char function[] = "fmi3EnterContinuousTimeMode";
    if (c != NULL && ((spring_t *)c)->now.kind != MODEL_EXCHANGE) {
        return spring_say(c, SAID_ERROR, function, "belongs to model exchange");
    }
    return spring_change(c, function, MODE_EVENT, MODE_CONTINUOUS);
}

FMI3(CompletedIntegratorStep)(instance_t c, bool is_final, bool *enter_event_mode,
                              bool *terminate) {
    int said = spring_in(c, "fmi3CompletedIntegratorStep", MODE_CONTINUOUS);
    (void)is_final;
    *enter_event_mode = *terminate = false;
    if (said == SAID_OK) {
        *enter_event_mode = spring_accept(c) != 0;
    }
    return said;
}

FMI3(GetNumberOfEventIndicators)(instance_t c, size_t *n) {
    *n = INDICATORS;
    return c == NULL ? SAID_ERROR : SAID_OK;
}

FMI3(GetEventIndicators)(instance_t c, double indicators[], size_t n) {
    return spring_indicators(c, "fmi3GetEventIndicators", indicators, n);
}

FMI3(SetTime)(instance_t c, double time) {
    return spring_set_time(c, "fmi3SetTime", time);
}

/* Co-simulation. */

FMI3(EnterStepMode)(instance_t c) {
    static const char function[] = "fmi3EnterStepMode";
    if (c != NULL && ((spring_t *)c)->now.kind != CO_SIMULATION) {
        return spring_say(c, SAID_ERROR, function, "belongs to co-simulation");
    }
    return spring_change(c, function, MODE_EVENT, MODE_STEP);
}

FMI3(DoStep)(instance_t c, double point, double step, bool is_final, bool *event_needed,
             bool *terminate, bool *early_return, double *last_time) {
    int said = spring_step(c, "fmi3DoStep", point, step);
    (void)is_final;
    *event_needed = *terminate = *early_return = false;
    *last_time = c == NULL ? point : ((spring_t *)c)->now.time;
    return said;
}
