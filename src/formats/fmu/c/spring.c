/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* The spring's variables, its memory and its steps. */
#include "spring.h"

/* Modes in which all variables have values. */
#define MODES_TO_GET \
    (MODE_INITIALIZATION | MODE_EVENT | MODE_CONTINUOUS | MODE_STEP | MODE_TERMINATED)
/* Times of a step may differ by this share of it: importers add steps up. */
#define STEP_SHARE 1e-3
#define NO_ARRAY "an array is missing"
#define NOT_A_VARIABLE "is not a variable of this type"

static int is_finite(double x) {
    return x - x == 0.0;
}

/* How far times may lie apart; rounding of large times does not count. */
static double slack(double time, double step) {
    double size = time < 0.0 ? -time : time;
    return STEP_SHARE * step + 1e-9 * size;
}

int spring_set_time(spring_t *spring, const char *function, double time) {
    int said = spring_in(spring, function, MODE_EVENT | MODE_CONTINUOUS);
    if (said != SAID_OK) {
        return said;
    }
    if (spring->now.kind != MODEL_EXCHANGE || !is_finite(time)) {
        return spring_say(spring, SAID_ERROR, function, "needs model exchange and a finite time");
    }
    spring->now.time = time;
    return SAID_OK;
}

void spring_follow_stiffness(spring_t *spring) {
    if (spring->law.given != spring->now.unloading_stiffness) {
        law_set_stiffness(&spring->law, spring->now.unloading_stiffness);
    }
}

int spring_has_memory(void) {
    return (crumple_table.flags & CRUMPLE_HAS_MEMORY) != 0;
}

/* The maximum deflection with the present point, which may be a trial. */
static double largest_with(const state_t *now) {
    return now->deflection > now->largest ? now->deflection : now->largest;
}

void spring_remember(spring_t *spring) {
    spring->now.largest = largest_with(&spring->now);
}

int spring_get(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
               double *values) {
    const state_t *now;
    double stored, dissipated, knots[INDICATORS];
    size_t i;
    int said = spring_in(spring, function, MODE_INSTANTIATED | MODES_TO_GET);
    if (said != SAID_OK || n == 0) {
        return said;
    }
    if (vr == NULL || values == NULL) {
        return spring_say(spring, SAID_ERROR, function, NO_ARRAY);
    }
    now = &spring->now;
    law_energies(&spring->law, now->deflection, largest_with(now), &stored, &dissipated);
    spring_knots(spring, knots);
    for (i = 0; i < n; i++) {
        int is_output = vr[i] >= VR_FORCE && vr[i] <= VR_BEFORE_KNOT && vr[i] != VR_FORCE_SCALE;
        if (now->mode == MODE_INSTANTIATED && is_output) {
            return spring_say_of(spring, function, vr[i], "has no value before initialization");
        }
        switch (vr[i]) {
        case VR_TIME: values[i] = now->time; break;
        case VR_DEFLECTION: values[i] = now->deflection; break;
        case VR_FORCE:
            values[i] =
                now->force_scale * law_force(&spring->law, now->deflection, largest_with(now));
            break;
        case VR_STORED_ENERGY: values[i] = now->force_scale * stored; break;
        case VR_DISSIPATED_ENERGY: values[i] = now->force_scale * dissipated; break;
        case VR_LARGEST_DEFLECTION: values[i] = largest_with(now); break;
        case VR_FORCE_SCALE: values[i] = now->force_scale; break;
        case VR_UNLOADING_STIFFNESS:
            if (!spring_has_memory()) {
                return spring_say_of(spring, function, vr[i], NOT_A_VARIABLE);
            }
            values[i] = now->unloading_stiffness;
            break;
        case VR_PAST_KNOT: values[i] = knots[0]; break;
        case VR_BEFORE_KNOT: values[i] = knots[1]; break;
        default: return spring_say_of(spring, function, vr[i], NOT_A_VARIABLE);
        }
    }
    return SAID_OK;
}

/* NULL if the variable may be given this value now. */
static const char *reason_against_value(const spring_t *spring, uint32_t vr, double value) {
    switch (vr) {
    case VR_DEFLECTION: return is_finite(value) ? NULL : "must be a finite number";
    case VR_FORCE_SCALE:
        if (spring->now.mode == MODE_CONTINUOUS) {
            return "is a parameter: it can be set in event mode";
        }
        return is_finite(value) && value > 0.0 ? NULL : "must be a finite number above 0";
    case VR_UNLOADING_STIFFNESS:
        if (!spring_has_memory()) {
            return "is not a variable: this curve is followed back";
        }
        if (!(spring->now.mode & (MODE_INSTANTIATED | MODE_INITIALIZATION))) {
            return "is fixed after initialization";
        }
        return is_finite(value) && value > 0.0 ? NULL : "must be a finite number above 0";
    default: return "is neither an input nor a parameter";
    }
}

int spring_set(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
               const double *values) {
    size_t i;
    int said = spring_in(spring, function,
                         MODE_INSTANTIATED | (MODES_TO_GET & ~(uint32_t)MODE_TERMINATED));
    if (said != SAID_OK) {
        return said;
    }
    if (n > 0 && (vr == NULL || values == NULL)) {
        return spring_say(spring, SAID_ERROR, function, NO_ARRAY);
    }
    /* All or none, so that a refused call changes nothing. */
    for (i = 0; i < n; i++) {
        const char *reason = reason_against_value(spring, vr[i], values[i]);
        if (reason != NULL) {
            return spring_say_of(spring, function, vr[i], reason);
        }
    }
    for (i = 0; i < n; i++) {
        switch (vr[i]) {
        case VR_DEFLECTION: spring->now.deflection = values[i]; break;
        case VR_FORCE_SCALE: spring->now.force_scale = values[i]; break;
        default: spring->now.unloading_stiffness = values[i];
        }
    }
    spring_follow_stiffness(spring);
    return SAID_OK;
}

int spring_set_rates(spring_t *spring, const char *function, const uint32_t *vr, size_t n,
                     const int32_t *order, const double *values) {
    size_t i;
    int said = spring_in(spring, function, MODE_INITIALIZATION | MODE_STEP);
    if (said != SAID_OK) {
        return said;
    }
    if (n > 0 && (vr == NULL || order == NULL || values == NULL)) {
        return spring_say(spring, SAID_ERROR, function, NO_ARRAY);
    }
    for (i = 0; i < n; i++) {
        if (vr[i] != VR_DEFLECTION) {
            return spring_say_of(spring, function, vr[i], "is not an input");
        }
        if (order[i] < 1 || order[i] > 2 || !is_finite(values[i])) {
            return spring_say_of(spring, function, vr[i],
                                 "takes finite derivatives of order 1 or 2");
        }
    }
    for (i = 0; i < n; i++) {
        spring->now.rates[order[i] - 1] = values[i];
    }
    return SAID_OK;
}

int spring_step(spring_t *spring, const char *function, double point, double step) {
    state_t *now;
    double turn, end, first, second;
    int said = spring_in(spring, function, MODE_STEP);
    if (said != SAID_OK) {
        return said;
    }
    now = &spring->now;
    if (!is_finite(point) || !is_finite(step) || !(step > 0.0)) {
        return spring_say(spring, SAID_ERROR, function, "the step must be a finite number above 0");
    }
    if (point - now->time > slack(point, step) || now->time - point > slack(point, step)) {
        return spring_say(
            spring, SAID_ERROR, function,
            "the step does not begin where the last one ended; restore a state to go back");
    }
    if (point + step - now->stop_time > slack(point, step)) {
        return spring_say(spring, SAID_ERROR, function, "the step goes beyond the stop time");
    }
    /* Values, derivatives and the end are of the input; the memory follows it all along the step.
     */
    first = now->rates[0];
    second = now->rates[1];
    end = now->deflection + (first + 0.5 * second * step) * step;
    if (!is_finite(end)) {
        return spring_say(spring, SAID_ERROR, function, "the deflection has no finite end value");
    }
    spring_remember(spring);
    turn = second < 0.0 ? -first / second : 0.0;
    if (turn > 0.0 && turn < step) {
        now->deflection += 0.5 * first * turn;
        spring_remember(spring);
    }
    now->deflection = end;
    spring_remember(spring);
    /* Else a later step whose derivatives nobody sets would go on along them. */
    now->rates[0] = 0.0;
    now->rates[1] = 0.0;
    now->time = point + step;
    return SAID_OK;
}
