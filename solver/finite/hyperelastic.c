/* hyperelastic.c: the laws at one point, as they are in lanes (hyperelastic_lanes.h). */
#include "finite/hyperelastic.h"

#include "finite/hyperelastic_lanes.h"

/* Inlined for each n, whose loops the compiler then unrolls. */
UZ_INLINE bool at_point(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS], int n,
                        uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS])
{
    uz_lanes in[UZ_FINITE_STRAINS], W_of, S_of[UZ_FINITE_STRAINS], D_of[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS];
    bool good;
    for (int i = 0; i < UZ_FINITE_STRAINS; i++)
        in[i] = (uz_lanes){0} + C[i];
    uz_law_in_lanes(&good, &W_of, S_of, D ? D_of : NULL, n, 1, law, lambda, mu, in);
    if (!good)
        return false;
    *W = W_of[0];
    for (int i = 0; i < n; i++) {
        S[i] = S_of[i][0];
        for (int j = 0; j < n && D; j++)
            D[i][j] = D_of[i][j][0];
    }
    return true;
}

typedef bool evaluation(double *, double[UZ_FINITE_STRAINS], double[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS],
                        uz_elasticity, double, double, const double[UZ_FINITE_STRAINS]);

#define OF_COMPONENTS(NAME, N, VERSION)                                                                                \
    VERSION static bool NAME(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS],   \
                             uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS])           \
    {                                                                                                                  \
        return at_point(W, S, D, N, law, lambda, mu, C);                                                               \
    }
OF_COMPONENTS(plane, UZ_FINITE_PLANE_STRAINS, )
OF_COMPONENTS(space, UZ_FINITE_STRAINS, )
OF_COMPONENTS(plane_fused, UZ_FINITE_PLANE_STRAINS, UZ_AVX2_FMA)
OF_COMPONENTS(space_fused, UZ_FINITE_STRAINS, UZ_AVX2_FMA)

bool uz_hyperelastic(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS], int n,
                     uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS])
{
    const bool fused = uz_cpu_has_avx2_fma(), flat = n == UZ_FINITE_PLANE_STRAINS;
    evaluation *of = flat ? (fused ? plane_fused : plane) : fused ? space_fused : space;
    return of(W, S, D, law, lambda, mu, C);
}
