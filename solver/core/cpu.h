/* cpu.h: the one place that knows which instructions a processor has.
 *
 * A kernel is written once, as a function that is always inlined. Beside it stands a copy that is compiled for wider
 * registers, and the caller takes the one that the processor has:
 *
 *     UZ_INLINE void add(double *y, ...) { ... }
 *     UZ_AVX2_FMA static void add_fused(double *y, ...) { add(y, ...); }
 *     ...
 *     (uz_cpu_has_avx2_fma() ? add_fused : add)(y, ...);
 *
 * Whether products and sums are contracted is not decided here: the Makefile says for which files they may be. */
#ifndef UZ_CORE_CPU_H
#define UZ_CORE_CPU_H

#include <stdbool.h>

/* What is inlined into a version for each kind of processor; sizes that are constants there let short loops unroll. */
#define UZ_INLINE static inline __attribute__((always_inline))

#ifdef __x86_64__
#define UZ_AVX2             __attribute__((target("avx2")))
#define UZ_AVX2_FMA         __attribute__((target("avx2,fma")))
#define UZ_CPU_HAS(FEATURE) (__builtin_cpu_supports(FEATURE) != 0)
#else
#define UZ_AVX2
#define UZ_AVX2_FMA
#define UZ_CPU_HAS(FEATURE) false
#endif

static inline bool uz_cpu_has_avx2_fma(void)
{
    return UZ_CPU_HAS("avx2") && UZ_CPU_HAS("fma");
}

#endif
