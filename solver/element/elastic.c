/* elastic.c: linear elasticity of the four models, isotropic or by a matrix (anisotropy.c) (Timoshenko and Goodier,
 * "Theory of Elasticity", ch. 1 and 2; temperature: ch. 13). */
#include "element/element.h"

#include <math.h>
#include <string.h>

uz_lame uz_lame_of(uz_model model, double young, double poisson)
{
    const double third = model == UZ_PLANE_STRESS ? 1 - poisson : 1 - 2 * poisson;
    return (uz_lame){.lambda = young * poisson / ((1 + poisson) * third), .mu = young / (2 * (1 + poisson))};
}

uz_lame uz_lame_general(const uz_anisotropy *general)
{
    return (uz_lame){.lambda = NAN, .mu = NAN, .general = general};
}

double uz_most_stiffness(uz_lame lame)
{
    double trace = 0;
    for (int i = 0; i < 6 && lame.general; i++)
        trace += lame.general->C[i][i];
    return lame.general ? trace : lame.lambda + 2 * lame.mu;
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
    if (lame.general) {
        double of[UZ_ELEMENT_STRESSES];
        memcpy(of, strain, (size_t)n * sizeof *of);
        for (int i = 0; i < n; i++) {
            stress[i] = 0;
            for (int j = 0; j < n; j++)
                stress[i] += lame.general->C[i][j] * of[j];
        }
        return;
    }
    const double mean = lame.lambda * (direct == 3 ? strain[0] + strain[1] + strain[2] : strain[0] + strain[1]);
    for (int i = 0; i < n; i++)
        stress[i] = i < direct ? mean + 2 * lame.mu * strain[i] : lame.mu * strain[i];
}

/* Trace and deviator apart, so that a large lambda cancels nothing. */
double uz_stress_work(uz_model model, uz_lame lame, const double *stress)
{
    const int n = uz_stress_count(model), direct = direct_count(model);
    double trace = 0, sum = 0;
    for (int i = 0; i < n && lame.general; i++)
        for (int j = 0; j < n; j++)
            sum += stress[i] * lame.general->S[i][j] * stress[j];
    if (lame.general)
        return sum;
    for (int i = 0; i < direct; i++)
        trace += stress[i];
    for (int i = 0; i < n; i++)
        sum += i < direct ? (stress[i] - trace / direct) * (stress[i] - trace / direct) : 2 * stress[i] * stress[i];
    return trace * trace / (direct * (direct * lame.lambda + 2 * lame.mu)) + sum / (2 * lame.mu);
}

/* Of Lame's own lambda, not that of plane stress. */
static double poisson_of(uz_lame lame)
{
    return lame.lambda / (2 * (lame.lambda + lame.mu));
}

void uz_thermal_strain(double *strain, uz_model model, uz_lame lame, double free_strain)
{
    const int n = uz_stress_count(model), direct = direct_count(model);
    for (int i = 0; i < n && lame.general; i++)
        strain[i] = free_strain * lame.general->expansion[i];
    if (lame.general)
        return;
    const double each = model == UZ_PLANE_STRAIN ? (1 + poisson_of(lame)) * free_strain : free_strain;
    for (int i = 0; i < n; i++)
        strain[i] = i < direct ? each : 0;
}

static double across(const uz_anisotropy *general, const double *stress, double free_strain)
{
    return general->across[0] * stress[0] + general->across[1] * stress[1] + general->across[2] * stress[2] +
           general->warmed * free_strain;
}

double uz_stress_zz(uz_model model, uz_lame lame, const double *stress, double free_strain)
{
    if (model != UZ_PLANE_STRAIN)
        return 0;
    if (lame.general)
        return across(lame.general, stress, free_strain);
    const double poisson = poisson_of(lame), young = 2 * lame.mu * (1 + poisson);
    return poisson * (stress[0] + stress[1]) - young * free_strain;
}

double uz_kept_energy(uz_model model, uz_lame lame, double free_strain)
{
    if (model != UZ_PLANE_STRAIN)
        return 0;
    const double each = lame.general ? lame.general->kept : lame.mu * (1 + poisson_of(lame));
    return each * free_strain * free_strain;
}

double uz_strain_zz(uz_model model, uz_lame lame, const double *stress, double free_strain)
{
    if (model != UZ_PLANE_STRESS)
        return 0;
    if (lame.general)
        return across(lame.general, stress, free_strain);
    const double poisson = lame.lambda / (lame.lambda + 2 * lame.mu), young = 2 * lame.mu * (1 + poisson);
    return free_strain - poisson / young * (stress[0] + stress[1]);
}
