/* elastic.c: isotropic linear elasticity of the four models (Timoshenko and Goodier, "Theory of Elasticity", ch. 1 and
 * 2; temperature: ch. 13). */
#include "element/element.h"

uz_lame uz_lame_of(uz_model model, double young, double poisson)
{
    const double third = model == UZ_PLANE_STRESS ? 1 - poisson : 1 - 2 * poisson;
    return (uz_lame){.lambda = young * poisson / ((1 + poisson) * third), .mu = young / (2 * (1 + poisson))};
}

int uz_stress_count(uz_model model)
{
    return model == UZ_SOLID ? 6 : model == UZ_AXISYMMETRIC ? 4 : 3;
}

/* Direct components come first. */
static int direct_count(uz_model model)
{
    return model == UZ_SOLID || model == UZ_AXISYMMETRIC ? 3 : 2;
}

uz_lame uz_lame_in_space(uz_model model, uz_lame lame)
{
    if (model == UZ_PLANE_STRESS)
        lame.lambda = 2 * lame.mu * lame.lambda / (2 * lame.mu - lame.lambda);
    return lame;
}

void uz_elastic_stress(double *stress, uz_model model, uz_lame lame, const double *strain)
{
    const int n = uz_stress_count(model), direct = direct_count(model);
    const double mean = lame.lambda * (direct == 3 ? strain[0] + strain[1] + strain[2] : strain[0] + strain[1]);
    for (int i = 0; i < n; i++)
        stress[i] = i < direct ? mean + 2 * lame.mu * strain[i] : lame.mu * strain[i];
}

/* Of Lame's own lambda, not that of plane stress. */
static double poisson_of(uz_lame lame)
{
    return lame.lambda / (2 * (lame.lambda + lame.mu));
}

void uz_thermal_strain(double *strain, uz_model model, uz_lame lame, double free_strain)
{
    const int n = uz_stress_count(model), direct = direct_count(model);
    const double each = model == UZ_PLANE_STRAIN ? (1 + poisson_of(lame)) * free_strain : free_strain;
    for (int i = 0; i < n; i++)
        strain[i] = i < direct ? each : 0;
}

double uz_stress_zz(uz_model model, uz_lame lame, const double *stress, double free_strain)
{
    if (model != UZ_PLANE_STRAIN)
        return 0;
    const double poisson = poisson_of(lame), young = 2 * lame.mu * (1 + poisson);
    return poisson * (stress[0] + stress[1]) - young * free_strain;
}
