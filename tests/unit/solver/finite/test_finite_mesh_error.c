/* The estimate of what the mesh loses under large deformation: what that of small deformation is where strains are
 * small, and the same however the body is turned. */
#include "assembly/assembly.h"
#include "body_fixture.h"
#include "finite/mesh_error.h"
#include "qp_fixture.h"

static double signed_of(qp_random *rng)
{
    return 2 * random_unit(rng) - 1;
}

static const uz_model PLANE[] = {UZ_PLANE_STRESS, UZ_PLANE_STRAIN, UZ_AXISYMMETRIC};

static double error_of(const uz_body_model *model, const double *free_strain, const double *u)
{
    double error;
    CHECK_INT(uz_finite_mesh_error(&error, NULL, model, NULL, free_strain, u, NULL), UZ_OK);
    return error;
}

static uz_scene scene_of(uz_element_kind kind, int way)
{
    const bool solid = uz_element_type_of(kind)->dim == 3;
    uz_scene s = body_scene(solid ? UZ_SOLID : PLANE[way % 3], uz_element_name(kind), (double[3]){5, 3, 2},
                            (int64_t[3]){4, 3, 2});
    s.formulation = way > 2 && (kind == UZ_QUAD4 || kind == UZ_HEX8) ? UZ_FORMULATION_BBAR : UZ_FORMULATION_STANDARD;
    s.kinematics = UZ_KINEMATICS_FINITE;
    s.box.grading[0] = way % 2 ? 1.7 : 1;
    s.box.origin[0] = 1;
    s.materials[0].law = (uz_elasticity)(UZ_ELASTIC_ST_VENANT_KIRCHHOFF + way % 3);
    body_hold(&s, "top", 0, 0, 0);
    return s;
}

TEST(of_small_strain_it_is_that_of_small_deformation)
{
    qp_random rng = {21};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int way = 0; way < 9; way++) {
            uz_scene s = scene_of((uz_element_kind)k, way);
            uz_body_model model = body_model(&s);
            const int64_t n = model.mesh.n_nodes * model.mesh.dim;
            double *u = body_room(n, sizeof *u);
            for (int64_t i = 0; i < n; i++)
                u[i] = 1e-7 * (model.mesh.xyz[i] + 0.3 * signed_of(&rng));
            const double small = uz_estimate_mesh_error(NULL, NULL, &model, NULL, u);
            const double large = error_of(&model, NULL, u);
            CHECK_MSG(small > 0.01 && fabs(large - small) < 1e-5 * small, "%s, way %d: %.12g, not %.12g",
                      uz_element_name((uz_element_kind)k), way, large, small);
            free(u);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
}

/* What warmth does across a plane that cannot grow is no part of what the mesh has to tell. */
TEST(warmth_across_the_plane_hides_nothing)
{
    qp_random rng = {23};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        if (uz_element_type_of((uz_element_kind)k)->dim == 3)
            continue;
        uz_scene s = scene_of((uz_element_kind)k, 4);
        s.materials[0].expansion = 1e-3;
        uz_body_model model = body_model(&s);
        CHECK_INT(model.kind, UZ_PLANE_STRAIN);
        const int64_t n = model.mesh.n_nodes * 2;
        double *u = body_room(n, sizeof *u), *warm = body_room(model.mesh.n_elements, sizeof *warm);
        const double nu = s.materials[0].poisson, growth = 1e-3;
        for (int64_t e = 0; e < model.mesh.n_elements; e++)
            warm[e] = growth;
        for (int64_t i = 0; i < n; i++)
            u[i] = 1e-4 * signed_of(&rng);
        const double cold = error_of(&model, NULL, u);
        for (int64_t i = 0; i < n; i++) /* as it grows freely in the plane */
            u[i] += (1 + nu) * growth * model.mesh.xyz[i];
        const double there = error_of(&model, warm, u);
        CHECK_MSG(cold > 0.1 && fabs(there - cold) < 0.02 * cold, "%s: %g, not %g", uz_element_name((uz_element_kind)k),
                  there, cold);
        free(u);
        free(warm);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* By 2 about an axis that is none of the body's, and carried along. */
TEST(a_turn_changes_nothing)
{
    const double angle = 2, along[3] = {2. / 3, -1. / 3, 2. / 3};
    qp_random rng = {22};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int way = 0; way < 6; way++) {
            uz_scene s = scene_of((uz_element_kind)k, way);
            uz_body_model model = body_model(&s);
            const int dim = model.mesh.dim;
            const int64_t n = model.mesh.n_nodes * dim;
            double *u = body_room(n, sizeof *u), *turned = body_room(n, sizeof *turned);
            for (int64_t i = 0; i < n; i++) {
                u[i] = 0.04 * signed_of(&rng);
                turned[i] = u[i];
            }
            for (int64_t a = 0; a < n && model.kind != UZ_AXISYMMETRIC; a += dim) {
                double x[3] = {0}, w[3] = {0, 0, 1}, across[3], inner = 0;
                for (int c = 0; c < dim; c++) {
                    x[c] = model.mesh.xyz[a + c] + u[a + c];
                    w[c] = dim == 3 ? along[c] : w[c];
                }
                for (int c = 0; c < 3; c++) {
                    across[c] = w[(c + 1) % 3] * x[(c + 2) % 3] - w[(c + 2) % 3] * x[(c + 1) % 3];
                    inner += w[c] * x[c];
                }
                for (int c = 0; c < dim; c++)
                    turned[a + c] = cos(angle) * x[c] + sin(angle) * across[c] + (1 - cos(angle)) * inner * w[c] -
                                    model.mesh.xyz[a + c] + 7;
            }
            const double at_rest = error_of(&model, NULL, u), there = error_of(&model, NULL, turned);
            CHECK_MSG(at_rest > 0.01 && fabs(there - at_rest) < 1e-9, "%s, way %d: %.12g, not %.12g",
                      uz_element_name((uz_element_kind)k), way, there, at_rest);
            free(turned);
            free(u);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
}

/* Squares of elements are those of the body, and belong to where the strain jumps. */
TEST(elements_have_their_parts)
{
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        uz_scene s = scene_of((uz_element_kind)k, 3);
        uz_body_model model = body_model(&s);
        const int dim = model.mesh.dim;
        const int64_t n = model.mesh.n_nodes * dim;
        double *u = body_room(n, sizeof *u), *eta2 = body_room(model.mesh.n_elements, sizeof *eta2), sum = 0, here = 0,
               error;
        for (int64_t i = 0; i < n; i += dim) {
            const double x = model.mesh.xyz[i] - 1;
            u[i] = 0.1 * x + (x > 4 ? 0.3 * (x - 4) * (x - 4) : 0);
        }
        CHECK_INT(uz_finite_mesh_error(&error, eta2, &model, NULL, NULL, u, NULL), UZ_OK);
        for (int64_t e = 0; e < model.mesh.n_elements; e++) {
            int count;
            const int64_t *node = uz_mesh_element(&model.mesh, e, &count);
            double right = 0;
            for (int a = 0; a < count; a++)
                right = fmax(right, model.mesh.xyz[node[a] * dim] - 1);
            CHECK(eta2[e] >= 0);
            sum += eta2[e];
            here += right > 3 ? eta2[e] : 0;
        }
        CHECK_MSG(error > 0.01 && sum > 0 && here > 0.9 * sum, "%s: %g, %g of %g", uz_element_name((uz_element_kind)k),
                  error, here, sum);
        free(u);
        free(eta2);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* Layers that are sheared differently keep the volume, and with mean dilatation means of them do: the modulus of bulk
 * is none of the difference's, whether the body is warm or not. Means of E have another volume, a square of the
 * difference. */
TEST(sheared_layers_say_nothing_of_the_modulus_of_bulk)
{
    static const struct {
        uz_element_kind kind;
        int way;
    } OF[] = {{UZ_QUAD4, 4}, {UZ_QUAD4, 5}, {UZ_HEX8, 4}, {UZ_HEX8, 5}};
    static const double POISSON[] = {0.4, 0.4999};
    for (int k = 0; k < 4; k++) {
        double found[2][3];
        for (int i = 0; i < 2; i++) {
            uz_scene s = scene_of(OF[k].kind, OF[k].way);
            s.materials[0].poisson = POISSON[i];
            s.materials[0].young = 2 * (1 + POISSON[i]);
            s.materials[0].expansion = 1;
            uz_body_model model = body_model(&s);
            const bool ring = model.kind == UZ_AXISYMMETRIC; /* its layers are around the axis */
            const int dim = model.mesh.dim, along = ring ? 1 : 0, across = ring ? 0 : 1;
            const int64_t n = model.mesh.n_nodes * dim;
            const double growth = model.kind == UZ_PLANE_STRAIN ? 0 : 0.05;
            double *u = body_room(n, sizeof *u), *z = body_room(n, sizeof *z), error,
                   *eta2 = body_room(model.mesh.n_elements, sizeof *eta2),
                   *warm = body_room(model.mesh.n_elements, sizeof *warm);
            for (int64_t a = 0; a < n; a += dim) {
                const double x = model.mesh.xyz[a + across] - (ring ? 1 : 0);
                u[a + along] = 0.1 * x * x;
                z[a + along] = sin(x);
            }
            CHECK_INT(uz_finite_mesh_error(&error, eta2, &model, NULL, NULL, u, NULL), UZ_OK);
            found[i][0] = 0;
            for (int64_t e = 0; e < model.mesh.n_elements; e++)
                found[i][0] += eta2[e];
            CHECK_INT(uz_finite_error_energy(&found[i][1], NULL, &model, NULL, u, z, 0.5, 0.7, NULL), UZ_OK);
            for (int64_t e = 0; e < model.mesh.n_elements; e++)
                warm[e] = growth;
            for (int64_t j = 0; j < n; j++)
                u[j] += growth * (model.mesh.xyz[j] + u[j]);
            CHECK_INT(uz_finite_mesh_error(&error, eta2, &model, NULL, warm, u, NULL), UZ_OK);
            found[i][2] = 0;
            for (int64_t e = 0; e < model.mesh.n_elements; e++)
                found[i][2] += eta2[e] / pow(1 + growth, 3);
            CHECK_MSG(fabs(found[i][2] - found[i][0]) < 1e-9 * found[i][0], "%g warm, %g", found[i][2], found[i][0]);
            uz_free_all(u, z, eta2, warm);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
        for (int j = 0; j < 2; j++)
            CHECK_MSG(found[0][j] > 1e-3 && fabs(found[1][j] - found[0][j]) < 1e-6 * found[0][j],
                      "%s: %.12g, not %.12g", uz_element_name(OF[k].kind), found[1][j], found[0][j]);
    }
}
