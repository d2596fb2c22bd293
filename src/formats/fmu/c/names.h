/* SPDX-License-Identifier: MIT OR Apache-2.0 */
/* Names seen by the linker: plain in a shared library, with the importer's prefix where several
 * FMUs are linked into one program from their sources. */
#ifndef CRUMPLE_NAMES_H
#define CRUMPLE_NAMES_H

#if defined(FMI2_FUNCTION_PREFIX)
#define CRUMPLE_PREFIX FMI2_FUNCTION_PREFIX
#elif defined(FMI3_FUNCTION_PREFIX)
#define CRUMPLE_PREFIX FMI3_FUNCTION_PREFIX
#else
#define CRUMPLE_PREFIX
#endif

#define CRUMPLE_GLUE(a, b) a##b
#define CRUMPLE_GLUED(a, b) CRUMPLE_GLUE(a, b)
#define CRUMPLE_NAME(name) CRUMPLE_GLUED(CRUMPLE_PREFIX, name)

#if defined(_WIN32)
#define CRUMPLE_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define CRUMPLE_EXPORT __attribute__((visibility("default")))
#else
#define CRUMPLE_EXPORT
#endif

/* What the files share stays within the library: two of them in one process must not meet. */
#if defined(__GNUC__) && !defined(_WIN32)
#define CRUMPLE_INSIDE _Pragma("GCC visibility push(hidden)")
#define CRUMPLE_INSIDE_END _Pragma("GCC visibility pop")
#else
#define CRUMPLE_INSIDE
#define CRUMPLE_INSIDE_END
#endif

#define crumple_table CRUMPLE_NAME(crumple_table)
#define crumple_table_sum CRUMPLE_NAME(crumple_table_sum)
#define law_set_stiffness CRUMPLE_NAME(crumple_law_set_stiffness)
#define law_stored_by CRUMPLE_NAME(crumple_law_stored_by)
#define law_force CRUMPLE_NAME(crumple_law_force)
#define law_energies CRUMPLE_NAME(crumple_law_energies)
#define law_slopes CRUMPLE_NAME(crumple_law_slopes)
#define law_piece CRUMPLE_NAME(crumple_law_piece)
#define spring_new CRUMPLE_NAME(crumple_spring_new)
#define spring_free CRUMPLE_NAME(crumple_spring_free)
#define spring_say CRUMPLE_NAME(crumple_spring_say)
#define spring_say_of CRUMPLE_NAME(crumple_spring_say_of)
#define spring_in CRUMPLE_NAME(crumple_spring_in)
#define spring_change CRUMPLE_NAME(crumple_spring_change)
#define spring_reset CRUMPLE_NAME(crumple_spring_reset)
#define spring_start CRUMPLE_NAME(crumple_spring_start)
#define spring_set_time CRUMPLE_NAME(crumple_spring_set_time)
#define spring_get CRUMPLE_NAME(crumple_spring_get)
#define spring_set CRUMPLE_NAME(crumple_spring_set)
#define spring_set_rates CRUMPLE_NAME(crumple_spring_set_rates)
#define spring_follow_stiffness CRUMPLE_NAME(crumple_spring_follow_stiffness)
#define spring_has_memory CRUMPLE_NAME(crumple_spring_has_memory)
#define spring_remember CRUMPLE_NAME(crumple_spring_remember)
#define spring_settle CRUMPLE_NAME(crumple_spring_settle)
#define spring_accept CRUMPLE_NAME(crumple_spring_accept)
#define spring_knots CRUMPLE_NAME(crumple_spring_knots)
#define spring_indicators CRUMPLE_NAME(crumple_spring_indicators)
#define spring_step CRUMPLE_NAME(crumple_spring_step)
#define spring_forward CRUMPLE_NAME(crumple_spring_forward)
#define spring_backward CRUMPLE_NAME(crumple_spring_backward)
#define spring_none CRUMPLE_NAME(crumple_spring_none)
#define state_take CRUMPLE_NAME(crumple_state_take)
#define state_put CRUMPLE_NAME(crumple_state_put)
#define state_drop CRUMPLE_NAME(crumple_state_drop)
#define state_size CRUMPLE_NAME(crumple_state_size)
#define state_write CRUMPLE_NAME(crumple_state_write)
#define state_read CRUMPLE_NAME(crumple_state_read)

#endif
