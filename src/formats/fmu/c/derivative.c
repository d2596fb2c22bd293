/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Partial derivatives of the spring's outputs by its input and its parameters. */
#include "spring.h"

#define MODES (MODE_INITIALIZATION | MODE_EVENT | MODE_CONTINUOUS | MODE_STEP | MODE_TERMINATED)

/* Derivative of an output by a known variable; 0 if the call names no such pair. */
static int partial(const spring_t *spring, uint32_t unknown, uint32_t known, double *value) {
    const state_t *now = &spring->now;
    double d = now->deflection;
    int is_largest = d >= now->largest;
    double largest = is_largest ? d : now->largest;
    law_slopes_t slopes = law_slopes(&spring->law, d, largest);
    double stored, dissipated;
    law_energies(&spring->law, d, largest, &stored, &dissipated);
    if (known == VR_UNLOADING_STIFFNESS && now->mode == MODE_INITIALIZATION &&
        spring_has_memory()) {
        /* Nothing has unloaded yet. */
        double by = now->force_scale * law_stored_by(&spring->law, d);
        *value = unknown == VR_STORED_ENERGY ? by : unknown == VR_DISSIPATED_ENERGY ? -by : 0.0;
        return unknown >= VR_FORCE && unknown <= VR_BEFORE_KNOT && unknown != VR_FORCE_SCALE;
    }
    if (known != VR_DEFLECTION && known != VR_FORCE_SCALE) {
        return 0;
    }
    if (unknown == VR_PAST_KNOT || unknown == VR_BEFORE_KNOT) {
        double sign = unknown == VR_PAST_KNOT ? 1.0 : -1.0;
        *value = known == VR_DEFLECTION ? sign : 0.0;
        return 1;
    }
    switch (unknown) {
    case VR_FORCE:
        *value = known == VR_DEFLECTION ? now->force_scale * slopes.force
                                        : law_force(&spring->law, d, largest);
        return 1;
    case VR_STORED_ENERGY:
        *value = known == VR_DEFLECTION ? now->force_scale * slopes.stored : stored;
        return 1;
    case VR_DISSIPATED_ENERGY:
        *value = known == VR_DEFLECTION ? now->force_scale * slopes.dissipated : dissipated;
        return 1;
    case VR_LARGEST_DEFLECTION: *value = known == VR_DEFLECTION && is_largest ? 1.0 : 0.0; return 1;
    default: return 0;
    }
}

/* `result` has one number per unknown, or per known if `is_backward`. */
static int multiply(spring_t *spring, const char *function, const uint32_t *unknown,
                    size_t unknowns, const uint32_t *known, size_t knowns, const double *seed,
                    double *result, int is_backward) {
    size_t i, k;
    int said = spring_in(spring, function, MODES);
    if (said != SAID_OK) {
        return said;
    }
    if (unknowns > 0 && knowns > 0 &&
        (unknown == NULL || known == NULL || seed == NULL || result == NULL)) {
        return spring_say(spring, SAID_ERROR, function, "an array is missing");
    }
    for (i = 0; i < (is_backward ? knowns : unknowns); i++) {
        result[i] = 0.0;
    }
    for (i = 0; i < unknowns; i++) {
        for (k = 0; k < knowns; k++) {
            double value;
            if (!partial(spring, unknown[i], known[k], &value)) {
                return spring_say(spring, SAID_ERROR, function,
                                  "takes outputs as unknowns, the input or a parameter that may change as knowns");
            }
            if (is_backward) {
                result[k] += value * seed[i];
            } else {
                result[i] += value * seed[k];
            }
        }
    }
    return SAID_OK;
}

int spring_forward(spring_t *spring, const char *function, const uint32_t *unknown, size_t unknowns,
                   const uint32_t *known, size_t knowns, const double *seed, double *result) {
    return multiply(spring, function, unknown, unknowns, known, knowns, seed, result, 0);
}

int spring_backward(spring_t *spring, const char *function, const uint32_t *unknown,
                    size_t unknowns, const uint32_t *known, size_t knowns, const double *seed,
                    double *result) {
    return multiply(spring, function, unknown, unknowns, known, knowns, seed, result, 1);
}
