/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* FMI 2.0, model exchange and co-simulation: the functions an importer calls, on top of spring.h.
 * Written from the standard's text (fmi-standard.org, 2.0.4); no headers of the standard are
 * needed. */
#include "spring.h"

#define FMI2(name) CRUMPLE_EXPORT int CRUMPLE_NAME(fmi2##name)

typedef void *component_t;
typedef unsigned int reference_t;
typedef const char *string_t;
/* The text is a format with arguments behind it; ours holds no per cent sign. */
typedef void (*logger_t)(void *environment, string_t name, int status, string_t category,
                         string_t message, ...);

typedef struct {
    logger_t logger;
    void *(*allocate)(size_t n, size_t size);
    void (*free)(void *memory);
    void (*step_finished)(void *environment, int status);
    void *environment;
} callbacks_t;

typedef struct {
    int new_discrete_states_needed;
    int terminate_simulation;
    int nominals_changed;
    int values_changed;
    int next_event_time_defined;
    double next_event_time;
} event_info_t;

enum { STATUS_DO_STEP = 0, STATUS_LAST_TIME = 2, STATUS_TERMINATED = 3 };

static void say(spring_t *spring, int status, string_t message) {
    string_t category = status >= SAID_ERROR ? "logStatusError" : "logStatusWarning";
    ((logger_t)spring->logger)(spring->environment, spring->name, status, category, message);
}

CRUMPLE_EXPORT string_t CRUMPLE_NAME(fmi2GetTypesPlatform)(void) {
    return "default";
}

CRUMPLE_EXPORT string_t CRUMPLE_NAME(fmi2GetVersion)(void) {
    return "2.0";
}

FMI2(SetDebugLogging)(component_t c, int is_on, size_t n, const string_t categories[]) {
    (void)n;
    (void)categories; /* there is one kind of message besides errors, which are always said */
    if (c == NULL) {
        return SAID_ERROR;
    }
    ((spring_t *)c)->is_logging = is_on;
    return SAID_OK;
}

CRUMPLE_EXPORT component_t CRUMPLE_NAME(fmi2Instantiate)(string_t name, int kind, string_t guid,
                                                         string_t resources,
                                                         const callbacks_t *callbacks,
                                                         int is_visible, int is_logging) {
    any_function_t logger = callbacks == NULL ? NULL : (any_function_t)callbacks->logger;
    void *environment = callbacks == NULL ? NULL : callbacks->environment;
    (void)resources;
    (void)is_visible;
    if (kind != MODEL_EXCHANGE && kind != CO_SIMULATION) {
        return NULL;
    }
    return spring_new(say, environment, logger, is_logging, name, guid, (uint32_t)kind);
}

CRUMPLE_EXPORT void CRUMPLE_NAME(fmi2FreeInstance)(component_t c) {
    spring_free(c);
}

FMI2(SetupExperiment)(component_t c, int has_tolerance, double tolerance, double start,
                      int has_stop, double stop) {
    (void)has_tolerance;
    (void)tolerance;
    return spring_start(c, "fmi2SetupExperiment", start, has_stop, stop);
}

FMI2(EnterInitializationMode)(component_t c) {
    return spring_change(c, "fmi2EnterInitializationMode", MODE_INSTANTIATED, MODE_INITIALIZATION);
}

FMI2(ExitInitializationMode)(component_t c) {
    spring_t *spring = c;
    int said = spring_in(spring, "fmi2ExitInitializationMode", MODE_INITIALIZATION);
    if (said == SAID_OK) {
        spring_settle(spring); /* a spring may be compressed at the start */
        spring->now.mode = spring->now.kind == CO_SIMULATION ? MODE_STEP : MODE_EVENT;
    }
    return said;
}

FMI2(Terminate)(component_t c) {
    return spring_change(c, "fmi2Terminate", MODE_EVENT | MODE_CONTINUOUS | MODE_STEP,
                         MODE_TERMINATED);
}

FMI2(Reset)(component_t c) {
    if (c == NULL) {
        return SAID_ERROR;
    }
    spring_reset(c);
    return SAID_OK;
}

FMI2(GetReal)(component_t c, const reference_t vr[], size_t n, double values[]) {
    size_t i;
    for (i = 0; c != NULL && vr != NULL && i < n; i++) {
        if (vr[i] == VR_TIME) {
            return spring_say_of(c, "fmi2GetReal", vr[i], "is not a variable of this type");
        }
    }
    return spring_get(c, "fmi2GetReal", vr, n, values);
}

FMI2(SetReal)(component_t c, const reference_t vr[], size_t n, const double values[]) {
    return spring_set(c, "fmi2SetReal", vr, n, values);
}

/* All variables are real. */
#define NONE(name, type)                                                         \
    FMI2(name)(component_t c, const reference_t vr[], size_t n, type values[]) { \
        (void)vr;                                                                \
        (void)values;                                                            \
        return spring_none(c, "fmi2" #name, n);                                  \
    }
NONE(GetInteger, int)
NONE(GetBoolean, int)
NONE(GetString, string_t)
NONE(SetInteger, const int)
NONE(SetBoolean, const int)
NONE(SetString, const string_t)

FMI2(GetFMUstate)(component_t c, void **state) {
    return state_take(c, "fmi2GetFMUstate", state);
}

FMI2(SetFMUstate)(component_t c, void *state) {
    return state_put(c, "fmi2SetFMUstate", state);
}

FMI2(FreeFMUstate)(component_t c, void **state) {
    (void)c;
    state_drop(state);
    return SAID_OK;
}

FMI2(SerializedFMUstateSize)(component_t c, void *state, size_t *size) {
    (void)state;
    *size = state_size();
    return c == NULL ? SAID_ERROR : SAID_OK;
}

FMI2(SerializeFMUstate)(component_t c, void *state, char bytes[], size_t n) {
    return state_write(c, "fmi2SerializeFMUstate", state, (uint8_t *)bytes, n);
}

FMI2(DeSerializeFMUstate)(component_t c, const char bytes[], size_t n, void **state) {
    return state_read(c, "fmi2DeSerializeFMUstate", (const uint8_t *)bytes, n, state);
}

FMI2(GetDirectionalDerivative)(component_t c, const reference_t unknown[], size_t unknowns,
                               const reference_t known[], size_t knowns, const double seed[],
                               double result[]) {
    return spring_forward(c, "fmi2GetDirectionalDerivative", unknown, unknowns, known, knowns, seed,
                          result);
}

/* Model exchange. */

FMI2(EnterEventMode)(component_t c) {
    return spring_change(c, "fmi2EnterEventMode", MODE_EVENT | MODE_CONTINUOUS, MODE_EVENT);
}

FMI2(NewDiscreteStates)(component_t c, event_info_t *info) {
    event_info_t nothing = {0, 0, 0, 0, 0, 0.0};
    int said = spring_in(c, "fmi2NewDiscreteStates", MODE_EVENT);
    if (said == SAID_OK) {
        spring_settle(c); /* an input may have jumped at the event */
        *info = nothing;
    }
    return said;
}

FMI2(EnterContinuousTimeMode)(component_t c) {
    return spring_change(c, "fmi2EnterContinuousTimeMode", MODE_EVENT, MODE_CONTINUOUS);
}

FMI2(CompletedIntegratorStep)(component_t c, int is_final, int *enter_event_mode, int *terminate) {
    int said = spring_in(c, "fmi2CompletedIntegratorStep", MODE_CONTINUOUS);
    (void)is_final;
    *enter_event_mode = 0;
    *terminate = 0;
    if (said == SAID_OK) {
        *enter_event_mode = spring_accept(c);
    }
    return said;
}

FMI2(SetTime)(component_t c, double time) {
    return spring_set_time(c, "fmi2SetTime", time);
}

FMI2(SetContinuousStates)(component_t c, const double x[], size_t n) {
    (void)x;
    return spring_none(c, "fmi2SetContinuousStates", n);
}

FMI2(GetDerivatives)(component_t c, double derivatives[], size_t n) {
    (void)derivatives;
    return spring_none(c, "fmi2GetDerivatives", n);
}

FMI2(GetEventIndicators)(component_t c, double indicators[], size_t n) {
    return spring_indicators(c, "fmi2GetEventIndicators", indicators, n);
}

FMI2(GetContinuousStates)(component_t c, double x[], size_t n) {
    (void)x;
    return spring_none(c, "fmi2GetContinuousStates", n);
}

FMI2(GetNominalsOfContinuousStates)(component_t c, double nominals[], size_t n) {
    (void)nominals;
    return spring_none(c, "fmi2GetNominalsOfContinuousStates", n);
}

/* Co-simulation. */

FMI2(SetRealInputDerivatives)(component_t c, const reference_t vr[], size_t n, const int order[],
                              const double values[]) {
    return spring_set_rates(c, "fmi2SetRealInputDerivatives", vr, n, order, values);
}

FMI2(GetRealOutputDerivatives)(component_t c, const reference_t vr[], size_t n, const int order[],
                               double values[]) {
    (void)vr;
    (void)order;
    (void)values;
    return spring_none(c, "fmi2GetRealOutputDerivatives", n);
}

FMI2(DoStep)(component_t c, double point, double step, int is_final) {
    (void)is_final;
    return spring_step(c, "fmi2DoStep", point, step);
}

/* A step is done when doStep returns: there is nothing to cancel or to ask for. */
FMI2(CancelStep)(component_t c) {
    return spring_none(c, "fmi2CancelStep", 1);
}

FMI2(GetStatus)(component_t c, int kind, int *value) {
    *value = SAID_OK;
    return spring_none(c, "fmi2GetStatus", kind != STATUS_DO_STEP);
}

FMI2(GetRealStatus)(component_t c, int kind, double *value) {
    *value = c == NULL ? 0.0 : ((spring_t *)c)->now.time;
    return spring_none(c, "fmi2GetRealStatus", kind != STATUS_LAST_TIME);
}

FMI2(GetIntegerStatus)(component_t c, int kind, int *value) {
    (void)kind;
    *value = 0;
    return spring_none(c, "fmi2GetIntegerStatus", 1);
}

FMI2(GetBooleanStatus)(component_t c, int kind, int *value) {
    *value = 0;
    return spring_none(c, "fmi2GetBooleanStatus", kind != STATUS_TERMINATED);
}

FMI2(GetStringStatus)(component_t c, int kind, string_t *value) {
    (void)kind;
    *value = "";
    return spring_none(c, "fmi2GetStringStatus", 1);
}
