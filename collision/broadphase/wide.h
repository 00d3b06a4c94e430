// Functions compiled twice, for the baseline and for wide registers (AVX2); the choice is made when
// the program starts. For elementwise work only: both versions then give the same bits. Copy of
// contact/linear/wide.h, which this folder does not include.
#pragma once

// Not with the address sanitizer, which is not yet initialized when the choice is made.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__AVX2__) && \
    !defined(__SANITIZE_ADDRESS__)
#define COUNTERPOINT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define COUNTERPOINT_WIDE
#endif

// Marks functions that such functions share: they are inlined into both versions.
#define COUNTERPOINT_INTO_EACH __attribute__((always_inline)) inline
