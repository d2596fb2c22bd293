/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Sum that tells whether a table came through whole. */
#include "table.h"

/* Word by word, not byte by byte: the same on machines of either byte order. */
static uint64_t mix(uint64_t sum, uint64_t word) {
    sum = (sum ^ word) * 0x9E3779B97F4A7C15u;
    return sum ^ (sum >> 29);
}

static uint64_t mix_all(uint64_t sum, const double *numbers, uint32_t n) {
    union {
        double number;
        uint64_t word;
    } bits;
    uint32_t i;
    for (i = 0; i < n; i++) {
        bits.number = numbers[i];
        sum = mix(sum, bits.word);
    }
    return sum;
}

uint64_t crumple_table_sum(const crumple_table_t *t) {
    uint64_t sum = t->version;
    uint32_t i;
    if (t->points < 2 || t->points > CRUMPLE_POINTS || t->shape_points < 2 ||
        t->shape_points > CRUMPLE_SHAPE || t->points_room != CRUMPLE_POINTS ||
        t->shape_room != CRUMPLE_SHAPE || t->token[sizeof t->token - 1] != 0) {
        return 0;
    }
    sum = mix(mix(mix(sum, t->points), t->shape_points), t->flags);
    for (i = 0; i < sizeof t->token; i++) {
        sum = mix(sum, (unsigned char)t->token[i]);
    }
    sum = mix_all(sum, &t->stiffness, 1);
    sum = mix_all(sum, &t->scale, 1);
    sum = mix_all(sum, &t->largest_share, 1);
    sum = mix_all(sum, t->deflection, t->points);
    sum = mix_all(sum, t->force, t->points);
    sum = mix_all(sum, t->slope, t->points);
    sum = mix_all(sum, t->work, t->points);
    sum = mix_all(sum, t->shape_length, t->shape_points);
    sum = mix_all(sum, t->shape_force, t->shape_points);
    sum = mix_all(sum, t->shape_rest, t->shape_points);
    return sum == 0 ? 1 : sum;
}
