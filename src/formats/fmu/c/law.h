/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Force law of an interface: force and energies over the deflection and the largest one so far. */
#ifndef CRUMPLE_LAW_H
#define CRUMPLE_LAW_H

#include "table.h"

/* Deflections between which the force is one straight line, as long as it does not turn on the
 * envelope; LAW_FAR where there is no end. */
typedef struct {
    double from;
    double to;
} law_piece_t;

#define LAW_FAR 1e300

/* Derivatives by the deflection, where the maximum deflection follows it if it is at least that. */
typedef struct {
    double force;
    double stored;
    double dissipated;
} law_slopes_t;

CRUMPLE_INSIDE

/* Force in N at a deflection after it has once been `largest` (largest >= deflection, >= 0). */
double law_force(const crumple_table_t *t, double deflection, double largest);

/* Stored and dissipated energy in J; their sum is the work done so far. */
void law_energies(const crumple_table_t *t, double deflection, double largest, double *stored,
                  double *dissipated);

/* On the envelope and at its points, the slopes towards larger deflections. */
law_slopes_t law_slopes(const crumple_table_t *t, double deflection, double largest);

/* The piece of the law at a deflection; on a knot, the one on the side where the law leads from it:
 * above it on the envelope, below it on a branch. */
law_piece_t law_piece(const crumple_table_t *t, double deflection, double largest);

CRUMPLE_INSIDE_END

#endif
