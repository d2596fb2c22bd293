/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* The table of a ready binary, before a curve is written into it. */
#include "table.h"

const crumple_table_t crumple_table = {
    "CRUMPLE TABLE 1",
    0,
    CRUMPLE_TABLE_VERSION,
    CRUMPLE_POINTS,
    CRUMPLE_SHAPE,
    0,
    0,
    0,
    "",
    0.0,
    0.0,
    0.0,
    {0.0},
    {0.0},
    {0.0},
    {0.0},
    {0.0},
    {0.0},
    {0.0},
};
