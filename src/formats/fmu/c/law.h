/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Force law of an interface: force and energies over the deflection and the largest one so far. */
#ifndef CRUMPLE_LAW_H
#define CRUMPLE_LAW_H

#include "table.h"

/* The law of one instance: the table with an unloading stiffness that its user may change. */
typedef struct {
    const crumple_table_t *table;
    double given;     /* what its user has set */
    double stiffness; /* the same, scaled as the table says */
    double steepest; /* steepest rise of the envelope, or the stiffness if that is more */
    /* At each point of the envelope, the energy that is lost once the deflection has been there, and its
     * derivative by the stiffness. */
    double dissipated[CRUMPLE_POINTS];
    double dissipated_by[CRUMPLE_POINTS];
} law_t;

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

/* Needs the table; the stiffness is above 0. */
void law_set_stiffness(law_t *law, double stiffness);

/* Force in N at a deflection after it has once been `largest` (largest >= deflection, >= 0). */
double law_force(const law_t *law, double deflection, double largest);

/* Stored and dissipated energy in J; their sum is the work done so far. */
void law_energies(const law_t *law, double deflection, double largest, double *stored,
                  double *dissipated);

/* On the envelope and at its points, the slopes towards larger deflections. */
law_slopes_t law_slopes(const law_t *law, double deflection, double largest);

/* Derivative of the stored energy by the stiffness, on the envelope; that of the dissipated energy is its
 * opposite. */
double law_stored_by(const law_t *law, double deflection);

/* The piece of the law at a deflection; on a knot, the one on the side where the law leads from it:
 * above it on the envelope, below it on a branch. */
law_piece_t law_piece(const law_t *law, double deflection, double largest);

CRUMPLE_INSIDE_END

#endif
