/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* The numbers of one spring. In a ready binary the exporter finds this block by its mark and writes
 * the curve into it; among the sources it is a generated C file (table.c). */
#ifndef CRUMPLE_TABLE_H
#define CRUMPLE_TABLE_H

#include <stdint.h>

#include "names.h"

#define CRUMPLE_TABLE_VERSION 2
#define CRUMPLE_POINTS 4096
#define CRUMPLE_SHAPE 1024

/* The envelope is followed back unless this is set. */
#define CRUMPLE_HAS_MEMORY 1u
/* Energy is stored by the mean force up to the maximum deflection, not by the force there. */
#define CRUMPLE_BY_MEAN_FORCE 2u

/* Without padding: the exporter counts on the places. SI. */
typedef struct {
    char mark[16];
    uint64_t sum; /* of all that follows and is in use, see crumple_table_sum */
    uint32_t version;
    uint32_t points_room;
    uint32_t shape_room;
    uint32_t points; /* 0 until a curve has been written */
    uint32_t shape_points;
    uint32_t flags;
    char token[64];       /* GUID or instantiation token, ended by 0 */
    double stiffness;     /* unloading stiffness */
    double scale;         /* of the stiffness, where energy is stored by the mean force; else 1 */
    double largest_share; /* of force times deflection that a branch can store */
    /* One per point of the envelope; `slope` is that of the piece from there on. */
    double deflection[CRUMPLE_POINTS];
    double force[CRUMPLE_POINTS];
    double slope[CRUMPLE_POINTS];
    double work[CRUMPLE_POINTS];
    /* Unloading branch: shares of its length and force, and the integral from each point to the
     * end. */
    double shape_length[CRUMPLE_SHAPE];
    double shape_force[CRUMPLE_SHAPE];
    double shape_rest[CRUMPLE_SHAPE];
} crumple_table_t;

CRUMPLE_INSIDE

/* In a file of its own, so that no compiler takes the empty block for the final one. */
extern const crumple_table_t crumple_table;

/* Sum over the used numbers; 0 if the counts do not fit the room. */
uint64_t crumple_table_sum(const crumple_table_t *table);

CRUMPLE_INSIDE_END

#endif
