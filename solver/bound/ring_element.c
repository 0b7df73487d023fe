/* ring_element.c: stresses in equilibrium within parts of macro elements of rings.
 *
 * With T = r sigma, and sigma_t the hoop stress, equilibrium with forces f per volume is
 *
 *     d_r T_rr + d_z T_rz - sigma_t + r f_r = 0,   d_r T_rz + d_z T_zz + r f_z = 0.
 *
 * The first one says what sigma_t is, whatever T; the second is for polynomials T as in the plane. Airy's functions
 * leave no hoop stress; with them T_rr of degrees that d_r T_rr takes to each polynomial of degree - 1 are all there
 * are. Energies are int T : C^-1 : T / r and finite where T vanishes on sides along the axis; as the true stress is
 * finite there, T vanishes at all places on the axis, in the elements that have but a corner there, too. Without that
 * their tractions would not match those of the others. */
#include "bound/macro.h"

static void stresses(double S[4][UZ_MACRO_FUNCTIONS + 1], const uz_macro *m, const double at[2])
{
    const double(*g)[2] = m->local, *force = m->body->force + 2 * m->element;
    const int airy = uz_airy_stresses(S, m, at);
    const double x = at[0] - m->centre[0], y = at[1] - m->centre[1];
    for (int b = 0; b < airy; b++)
        S[3][b] = 0;
    for (int k = 0; k < (m->degree == 1 ? 1 : 3); k++) { /* T_rr = x, and x times the local coordinates */
        const double t = m->times[airy + k], local = k == 0 ? 1 : g[k - 1][0] * x + g[k - 1][1] * y;
        S[0][airy + k] = t * x * local;
        S[1][airy + k] = S[2][airy + k] = 0;
        S[3][airy + k] = t * (local + (k == 0 ? 0 : x * g[k - 1][0]));
    }
    const int last = m->functions;
    S[0][last] = S[2][last] = 0;
    S[1][last] = -force[1] * at[0] * y;
    S[3][last] = at[0] * force[0];
}

static void strain(double e[4], const double s[4], uz_lame lame, double free_strain, uz_model model, double radius)
{
    double expansion[4];
    const double trace = s[0] / radius + s[1] / radius + s[3],
                 less = lame.lambda / (3 * lame.lambda + 2 * lame.mu) * trace;
    uz_thermal_strain(expansion, model, lame, free_strain);
    e[0] = (s[0] / radius - less) / (2 * lame.mu) + expansion[0];
    e[1] = (s[1] / radius - less) / (2 * lame.mu) + expansion[1];
    e[2] = s[2] / radius / lame.mu;
    e[3] = radius * ((s[3] - less) / (2 * lame.mu) + expansion[2]);
}

const uz_macro_stresses uz_ring_stresses = {{8, 15}, 4, stresses, strain};
