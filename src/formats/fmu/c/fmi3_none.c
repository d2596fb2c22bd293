/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* FMI 3.0: functions for what the spring has none of. Every one must be there; an error follows
 * where an importer asks for something. */
#include <stdbool.h>

#include "spring.h"

#define FMI3(name) CRUMPLE_EXPORT int CRUMPLE_NAME(fmi3##name)

typedef void *instance_t;
typedef uint32_t reference_t;
typedef const char *string_t;

CRUMPLE_EXPORT instance_t CRUMPLE_NAME(fmi3InstantiateScheduledExecution)(
    string_t name, string_t token, string_t resources, bool is_visible, bool is_logging,
    void *environment,
    void (*logger)(void *environment, int status, string_t category, string_t message),
    void (*clock_update)(void *environment), void (*lock)(void), void (*unlock)(void)) {
    (void)name;
    (void)token;
    (void)resources;
    (void)is_visible;
    (void)is_logging;
    (void)clock_update;
    (void)lock;
    (void)unlock;
    if (logger != NULL) {
        logger(environment, SAID_ERROR, "logStatusError",
               "fmi3InstantiateScheduledExecution: the spring has no clocks");
    }
    return NULL;
}

/* Variables of other types than Float64. */
#define NO_TYPE(name, type)                                                              \
    FMI3(Get##name)(instance_t c, const reference_t vr[], size_t n, type values[],       \
                    size_t n_values) {                                                   \
        (void)vr;                                                                        \
        (void)values;                                                                    \
        return spring_none(c, "fmi3Get" #name, n + n_values);                            \
    }                                                                                    \
    FMI3(Set##name)(instance_t c, const reference_t vr[], size_t n, const type values[], \
                    size_t n_values) {                                                   \
        (void)vr;                                                                        \
        (void)values;                                                                    \
        return spring_none(c, "fmi3Set" #name, n + n_values);                            \
    }
NO_TYPE(Float32, float)
NO_TYPE(Int8, int8_t)
NO_TYPE(UInt8, uint8_t)
NO_TYPE(Int16, int16_t)
NO_TYPE(UInt16, uint16_t)
NO_TYPE(Int32, int32_t)
NO_TYPE(UInt32, uint32_t)
NO_TYPE(Int64, int64_t)
NO_TYPE(UInt64, uint64_t)
NO_TYPE(Boolean, bool)
NO_TYPE(String, string_t)

FMI3(GetBinary)(instance_t c, const reference_t vr[], size_t n, size_t sizes[],
                const uint8_t *values[], size_t n_values) {
    (void)vr;
    (void)sizes;
    (void)values;
    return spring_none(c, "fmi3GetBinary", n + n_values);
}

FMI3(SetBinary)(instance_t c, const reference_t vr[], size_t n, const size_t sizes[],
                const uint8_t *const values[], size_t n_values) {
    (void)vr;
    (void)sizes;
    (void)values;
    return spring_none(c, "fmi3SetBinary", n + n_values);
}

/* Functions of an instance, references and one or two arrays of them. */
#define NO_ARRAY(name, type)                                                    \
    FMI3(name)(instance_t c, const reference_t vr[], size_t n, type values[]) { \
        (void)vr;                                                               \
        (void)values;                                                           \
        return spring_none(c, "fmi3" #name, n);                                 \
    }
#define NO_ARRAYS(name, first_type, second_type)                                   \
    FMI3(name)(instance_t c, const reference_t vr[], size_t n, first_type first[], \
               second_type second[]) {                                             \
        (void)vr;                                                                  \
        (void)first;                                                               \
        (void)second;                                                              \
        return spring_none(c, "fmi3" #name, n);                                    \
    }

/* Clocks. */
NO_ARRAY(GetClock, bool)
NO_ARRAY(SetClock, const bool)
NO_ARRAYS(GetIntervalDecimal, double, int)
NO_ARRAY(GetShiftDecimal, double)
NO_ARRAYS(GetShiftFraction, uint64_t, uint64_t)
NO_ARRAY(SetIntervalDecimal, const double)
NO_ARRAYS(SetIntervalFraction, const uint64_t, const uint64_t)
NO_ARRAY(SetShiftDecimal, const double)
NO_ARRAYS(SetShiftFraction, const uint64_t, const uint64_t)

FMI3(GetIntervalFraction)(instance_t c, const reference_t vr[], size_t n, uint64_t counters[],
                          uint64_t resolutions[], int qualifiers[]) {
    (void)vr;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return spring_none(c, "fmi3GetIntervalFraction", n);
}

FMI3(ActivateModelPartition)(instance_t c, reference_t clock, double time) {
    (void)clock;
    (void)time;
    return spring_none(c, "fmi3ActivateModelPartition", 1);
}

/* Structural parameters. */
FMI3(EnterConfigurationMode)(instance_t c) {
    return spring_none(c, "fmi3EnterConfigurationMode", 1);
}

FMI3(ExitConfigurationMode)(instance_t c) {
    return spring_none(c, "fmi3ExitConfigurationMode", 1);
}

/* Dependencies beyond what modelDescription.xml says. */
FMI3(GetNumberOfVariableDependencies)(instance_t c, reference_t vr, size_t *n) {
    (void)vr;
    *n = 0;
    return spring_none(c, "fmi3GetNumberOfVariableDependencies", 1);
}

FMI3(GetVariableDependencies)(instance_t c, reference_t dependent, size_t elements[],
                              reference_t independents[], size_t independent_elements[],
                              int kinds[], size_t n) {
    (void)dependent;
    (void)elements;
    (void)independents;
    (void)independent_elements;
    (void)kinds;
    (void)n;
    return spring_none(c, "fmi3GetVariableDependencies", 1);
}

/* Continuous states. */
FMI3(GetNumberOfContinuousStates)(instance_t c, size_t *n) {
    *n = 0;
    return spring_none(c, "fmi3GetNumberOfContinuousStates", 0);
}

#define NO_STATES(name, type)                           \
    FMI3(name)(instance_t c, type values[], size_t n) { \
        (void)values;                                   \
        return spring_none(c, "fmi3" #name, n);         \
    }
NO_STATES(SetContinuousStates, const double)
NO_STATES(GetContinuousStateDerivatives, double)
NO_STATES(GetContinuousStates, double)
NO_STATES(GetNominalsOfContinuousStates, double)

/* Derivatives of outputs over time. */
FMI3(GetOutputDerivatives)(instance_t c, const reference_t vr[], size_t n, const int32_t orders[],
                           double values[], size_t n_values) {
    (void)vr;
    (void)orders;
    (void)values;
    return spring_none(c, "fmi3GetOutputDerivatives", n + n_values);
}
