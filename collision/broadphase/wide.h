// As contact/linear/wide.h, which this folder does not include: functions compiled twice, the one
// with the machine's wide registers chosen when the program starts. Elementwise work only: then
// both give the same bits.
#pragma once

// Not under the address sanitizer, which is not up yet when the choice is made.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__AVX2__) && \
    !defined(__SANITIZE_ADDRESS__)
#define COUNTERPOINT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define COUNTERPOINT_WIDE
#endif

// What such functions share becomes part of each of their two versions.
#define COUNTERPOINT_INTO_EACH __attribute__((always_inline)) inline
