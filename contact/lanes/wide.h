// Functions compiled twice; the version for the machine's wide registers is chosen when the program
// starts. They do elementwise work only, so both give the same bits (no fused multiply-add). The
// folder contact/lanes lies below all libraries: each may include it.
#pragma once

// Not with sanitizers, initialized after the choice, nor clang-tidy (scripts/lint.sh).
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__AVX2__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) &&     \
    !defined(__clang_analyzer__)
#define COUNTERPOINT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define COUNTERPOINT_WIDE
#endif

// Marks helpers of such functions: they are inlined into both versions.
#define COUNTERPOINT_INTO_EACH __attribute__((always_inline)) inline

// Unrolls short loops over arrays of registers; as loops they would keep the arrays in memory.
#if defined(__clang__)
#define COUNTERPOINT_UNROLL _Pragma("unroll")
#else
#define COUNTERPOINT_UNROLL _Pragma("GCC unroll 8")
#endif
