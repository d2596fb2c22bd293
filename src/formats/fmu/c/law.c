/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Force law of an interface, operation by operation as crumple's own (multibody/law), so that the
 * results are the same bits. Compile without contraction of a*b+c (-ffp-contract=off). */
#include "law.h"

/* A point of the envelope. */
typedef struct {
    uint32_t piece;
    double deflection;
    double force;
    double work;
} top_t;

/* The unloading branch from the maximum deflection. */
typedef struct {
    double largest;
    double top;
    double stored;
    double dissipated;
    double length; /* deflection given back until the force is zero */
} branch_t;

static double larger(double a, double b) {
    return a > b ? a : b;
}
static double smaller(double a, double b) {
    return a < b ? a : b;
}

/* How many of the rising numbers are at most x. */
static uint32_t count_up_to(const double *rising, uint32_t n, double x) {
    uint32_t from = 0, to = n;
    while (from < to) {
        uint32_t middle = from + (to - from) / 2;
        if (rising[middle] <= x) {
            from = middle + 1;
        } else {
            to = middle;
        }
    }
    return from;
}

/* The point of the envelope at a deflection of 0 or more. */
static top_t on_envelope(const crumple_table_t *t, double deflection) {
    uint32_t above = count_up_to(t->deflection, t->points, deflection);
    uint32_t i = above > 1 ? above - 1 : 0;
    double along = larger(deflection - t->deflection[i], 0.0);
    double force = t->force[i] + t->slope[i] * along;
    top_t top;
    top.piece = i;
    top.deflection = deflection;
    top.force = force;
    top.work = t->work[i] + 0.5 * (t->force[i] + force) * along;
    return top;
}

/* Energy that a branch of this stiffness, or the stiffer one to (0, 0), can store. */
static double storable(const crumple_table_t *t, const top_t *top, double stiffness) {
    double bound = t->largest_share * top->deflection;
    return top->force * smaller(0.5 * top->force / stiffness, bound);
}

/* Energy of the branch of the unloading stiffness, were there no other. */
static double by_stiffness(const law_t *law, const top_t *top) {
    const crumple_table_t *t = law->table;
    double mean;
    if (!(t->flags & CRUMPLE_BY_MEAN_FORCE)) {
        return storable(t, top, law->stiffness);
    }
    mean = top->deflection > 0.0 ? top->work / top->deflection : 0.0;
    return smaller(0.5 * mean * mean / law->stiffness, top->work);
}

/* Derivative of `storable` by the stiffness. */
static double storable_by(const crumple_table_t *t, const top_t *top, double stiffness) {
    double length = 0.5 * top->force / stiffness;
    return length < t->largest_share * top->deflection ? -top->force * length / stiffness : 0.0;
}

/* Derivative of `by_stiffness` by the stiffness. */
static double by_stiffness_by(const law_t *law, const top_t *top) {
    double mean, energy;
    if (!(law->table->flags & CRUMPLE_BY_MEAN_FORCE)) {
        return storable_by(law->table, top, law->stiffness);
    }
    mean = top->deflection > 0.0 ? top->work / top->deflection : 0.0;
    energy = 0.5 * mean * mean / law->stiffness;
    return energy < top->work ? -energy / law->stiffness : 0.0;
}

void law_set_stiffness(law_t *law, double stiffness) {
    const crumple_table_t *t = law->table;
    double dissipated = 0.0, by = 0.0;
    uint32_t i;
    law->given = stiffness;
    law->stiffness = stiffness * t->scale;
    law->steepest = law->stiffness;
    for (i = 0; i < t->points; i++) {
        top_t top = {i, t->deflection[i], t->force[i], t->work[i]};
        double free = top.work - by_stiffness(law, &top);
        if (free > dissipated) {
            dissipated = free;
            by = -by_stiffness_by(law, &top);
        }
        law->dissipated[i] = dissipated;
        law->dissipated_by[i] = by;
        if (i + 1 < t->points) {
            law->steepest = larger(law->steepest, t->slope[i]);
        }
    }
}

/* Energy that comes back from a maximum deflection. */
static double stored_from(const law_t *law, const top_t *top) {
    const crumple_table_t *t = law->table;
    double dissipated = larger(law->dissipated[top->piece], top->work - by_stiffness(law, top));
    double stored = larger(top->work - dissipated, storable(t, top, law->steepest));
    if (t->flags & CRUMPLE_BY_MEAN_FORCE) {
        stored = smaller(stored, top->force * t->largest_share * top->deflection);
    }
    return stored;
}

static branch_t branch_from(const law_t *law, double largest) {
    const crumple_table_t *t = law->table;
    top_t top = on_envelope(t, largest);
    branch_t branch;
    branch.largest = largest;
    branch.top = top.force;
    branch.stored = stored_from(law, &top);
    branch.dissipated = top.work - branch.stored;
    branch.length = 0.0; /* the envelope itself has no force here */
    if (top.force > 0.0 && branch.stored > 0.0) {
        branch.length = branch.stored / (top.force * t->shape_rest[0]);
    }
    return branch;
}

/* The piece of the shape that holds a share of the length. */
static uint32_t shape_piece(const crumple_table_t *t, double length) {
    uint32_t above = count_up_to(t->shape_length, t->shape_points, length);
    if (above < 1) {
        above = 1;
    } else if (above > t->shape_points - 1) {
        above = t->shape_points - 1;
    }
    return above - 1;
}

static double shape_slope(const crumple_table_t *t, uint32_t j) {
    return (t->shape_force[j + 1] - t->shape_force[j]) /
           (t->shape_length[j + 1] - t->shape_length[j]);
}

/* Force on a branch below its top, and its slope. */
static double force_on(const crumple_table_t *t, const branch_t *b, double deflection,
                       double *slope) {
    uint32_t j;
    double at, at_zero, force;
    *slope = 0.0;
    if (deflection <= b->largest - b->length || b->length <= 0.0) {
        return 0.0;
    }
    j = shape_piece(t, (b->largest - deflection) / b->length);
    at = b->largest - t->shape_length[j] * b->length;
    *slope = -shape_slope(t, j) * b->top / b->length;
    at_zero = b->top * t->shape_force[j] - *slope * at;
    force = at_zero + *slope * deflection;
    if (!(force > 0.0)) {
        *slope = 0.0;
        return 0.0;
    }
    return force;
}

double law_force(const law_t *law, double deflection, double largest) {
    const crumple_table_t *t = law->table;
    branch_t branch;
    double slope;
    if (deflection <= 0.0) {
        return 0.0;
    }
    if (!(t->flags & CRUMPLE_HAS_MEMORY) || deflection >= largest) {
        return on_envelope(t, deflection).force;
    }
    branch = branch_from(law, largest);
    return force_on(t, &branch, deflection, &slope);
}

void law_energies(const law_t *law, double deflection, double largest, double *stored,
                  double *dissipated) {
    const crumple_table_t *t = law->table;
    branch_t branch;
    double length, along, force, rest;
    uint32_t j;
    *stored = 0.0;
    *dissipated = 0.0;
    if (largest <= 0.0) {
        return; /* never in contact */
    }
    if (!(t->flags & CRUMPLE_HAS_MEMORY)) {
        *stored = on_envelope(t, larger(deflection, 0.0)).work;
        return;
    }
    branch = branch_from(law, largest);
    *dissipated = branch.dissipated;
    if (branch.length <= 0.0) {
        return;
    }
    length = (branch.largest - larger(deflection, 0.0)) / branch.length;
    if (length >= 1.0) {
        return;
    }
    j = shape_piece(t, length);
    along = t->shape_length[j + 1] - length;
    force = t->shape_force[j + 1] - shape_slope(t, j) * along;
    rest = t->shape_rest[j + 1] + 0.5 * (t->shape_force[j + 1] + force) * along;
    *stored = branch.stored * rest / t->shape_rest[0];
}

/* Slope of `storable` along the envelope. */
static double storable_slope(const crumple_table_t *t, const top_t *top, double stiffness) {
    double slope = t->slope[top->piece];
    if (0.5 * top->force / stiffness < t->largest_share * top->deflection) {
        return top->force * slope / stiffness;
    }
    return t->largest_share * (top->force + top->deflection * slope);
}

/* Slope of `by_stiffness` along the envelope. */
static double by_stiffness_slope(const law_t *law, const top_t *top) {
    const crumple_table_t *t = law->table;
    double mean;
    if (!(t->flags & CRUMPLE_BY_MEAN_FORCE)) {
        return storable_slope(t, top, law->stiffness);
    }
    mean = top->work / top->deflection;
    if (0.5 * mean * mean / law->stiffness < top->work) {
        return mean * ((top->force - mean) / top->deflection) / law->stiffness;
    }
    return top->force;
}

law_slopes_t law_slopes(const law_t *law, double deflection, double largest) {
    const crumple_table_t *t = law->table;
    law_slopes_t slopes = {0.0, 0.0, 0.0};
    branch_t branch;
    top_t top;
    double dissipated, free, stored;
    if (deflection <= 0.0) {
        return slopes;
    }
    top = on_envelope(t, deflection);
    if (!(t->flags & CRUMPLE_HAS_MEMORY)) {
        slopes.force = t->slope[top.piece];
        slopes.stored = top.force;
        return slopes;
    }
    if (deflection < largest) {
        branch = branch_from(law, largest);
        slopes.stored = force_on(t, &branch, deflection, &slopes.force);
        return slopes;
    }
    slopes.force = t->slope[top.piece];
    dissipated = law->dissipated[top.piece];
    free = top.work - by_stiffness(law, &top);
    slopes.stored = top.force;
    if (free > dissipated) {
        dissipated = free;
        slopes.stored = by_stiffness_slope(law, &top);
    } else if (free == dissipated) {
        /* What is dissipated never falls. */
        slopes.stored = smaller(top.force, by_stiffness_slope(law, &top));
    }
    stored = top.work - dissipated;
    if (storable(t, &top, law->steepest) > stored) {
        stored = storable(t, &top, law->steepest);
        slopes.stored = storable_slope(t, &top, law->steepest);
    }
    if ((t->flags & CRUMPLE_BY_MEAN_FORCE) &&
        top.force * t->largest_share * top.deflection < stored) {
        slopes.stored = t->largest_share * (top.force + top.deflection * slopes.force);
    }
    slopes.dissipated = top.force - slopes.stored;
    return slopes;
}

double law_stored_by(const law_t *law, double deflection) {
    const crumple_table_t *t = law->table;
    top_t top;
    double free, stored, least, by;
    if (deflection <= 0.0 || !(t->flags & CRUMPLE_HAS_MEMORY)) {
        return 0.0;
    }
    top = on_envelope(t, deflection);
    stored = top.work - law->dissipated[top.piece];
    by = -law->dissipated_by[top.piece];
    free = top.work - by_stiffness(law, &top);
    if (free > law->dissipated[top.piece]) {
        stored = top.work - free;
        by = by_stiffness_by(law, &top);
    }
    least = storable(t, &top, law->steepest);
    if (least > stored) {
        stored = least;
        by = law->steepest > law->stiffness ? 0.0 : storable_by(t, &top, law->stiffness);
    }
    if ((t->flags & CRUMPLE_BY_MEAN_FORCE) &&
        top.force * t->largest_share * top.deflection < stored) {
        by = 0.0;
    }
    return by * t->scale;
}

law_piece_t law_piece(const law_t *law, double deflection, double largest) {
    const crumple_table_t *t = law->table;
    law_piece_t piece = {-LAW_FAR, 0.0};
    branch_t branch;
    uint32_t i;
    int is_below = (t->flags & CRUMPLE_HAS_MEMORY) && deflection < largest;
    if (!is_below && deflection < 0.0) {
        return piece;
    }
    if (!is_below) {
        i = on_envelope(t, deflection).piece;
        piece.from = t->deflection[i];
        piece.to = i + 1 < t->points ? t->deflection[i + 1] : LAW_FAR;
        return piece;
    }
    branch = branch_from(law, largest);
    piece.to = larger(largest - branch.length, 0.0);
    if (deflection > piece.to && branch.length > 0.0) {
        i = shape_piece(t, (largest - deflection) / branch.length);
        piece.from = larger(largest - t->shape_length[i + 1] * branch.length, 0.0);
        piece.to = largest - t->shape_length[i] * branch.length;
    }
    return piece;
}
