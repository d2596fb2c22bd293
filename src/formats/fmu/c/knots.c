/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Knots of the law as state events: an integrator that stops at each of them sees straight lines
 * alone, and keeps its order on a curve with hundreds of kinks. */
#include "spring.h"

#define INDICATOR_MODES (MODE_INITIALIZATION | MODE_EVENT | MODE_CONTINUOUS)
/* Indicators end here in m where there is no knot: importers expect numbers of a usual size. */
#define FARTHEST_M 1.0

static double at_most(double x, double bound) {
    return x < bound ? x : bound;
}

static law_piece_t piece_here(const spring_t *spring) {
    const state_t *now = &spring->now;
    double d = now->deflection;
    return law_piece(&spring->law, d, d > now->largest ? d : now->largest);
}

void spring_settle(spring_t *spring) {
    spring_remember(spring);
    spring->now.piece = piece_here(spring);
}

int spring_accept(spring_t *spring) {
    law_piece_t piece;
    spring_remember(spring);
    piece = piece_here(spring);
    return piece.from != spring->now.piece.from || piece.to != spring->now.piece.to;
}

void spring_knots(const spring_t *spring, double knots[INDICATORS]) {
    const state_t *now = &spring->now;
    int has_events = now->kind == MODEL_EXCHANGE && (now->mode & (MODE_EVENT | MODE_CONTINUOUS));
    law_piece_t piece = has_events ? now->piece : piece_here(spring);
    knots[0] = at_most(now->deflection - piece.from, FARTHEST_M);
    knots[1] = at_most(piece.to - now->deflection, FARTHEST_M);
}

int spring_indicators(spring_t *spring, const char *function, double indicators[], size_t n) {
    int said = spring_in(spring, function, INDICATOR_MODES);
    if (said != SAID_OK || n == 0) {
        return said;
    }
    if (n != INDICATORS || indicators == NULL || spring->now.kind != MODEL_EXCHANGE) {
        return spring_say(spring, SAID_ERROR, function,
                          "model exchange has two event indicators, which need an array");
    }
    spring_knots(spring, indicators);
    return SAID_OK;
}
