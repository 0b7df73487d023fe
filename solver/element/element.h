/* element.h: one finite element: shape functions, stiffness, strain, loads, and one of its sides.
 *
 * Pure functions on one element: nothing here allocates, prints or knows a mesh. Every element is isoparametric with
 * its nodes in VTK order (element_type.h, also for local points); displacements, forces and coordinates of an element
 * are by node: x0 y0 [z0] x1 y1 ..., dim = 2 or 3 per node.
 *
 * Strain and stress, shear strains doubled (gamma = 2 epsilon):
 *   plane stress, plane strain   3: xx yy xy
 *   axisymmetric                 4: rr zz hoop rz   (x is the radius, y the axis; integrals are over the whole ring)
 *   solid                        6: xx yy zz xy yz zx
 *
 * Sources: Zienkiewicz and Taylor, "The Finite Element Method", vol. 1 (isoparametric elements, axisymmetric strain);
 * Hughes, "The Finite Element Method", ch. 3 and 4.5; those of the formulations stand beside them. */
#ifndef UZ_ELEMENT_ELEMENT_H
#define UZ_ELEMENT_ELEMENT_H

#include "element/element_type.h"
#include "uzawa.h"

/* ---------------------------------------------------------------- material */

/* Linear elasticity of a material with directions, over the strains that a model has. */
typedef struct {
    double C[6][6], S[6][6]; /* stress = C strain, strain = S stress */
    double expansion[6];     /* strain of a free body for a rise of temperature by 1, as of uz_thermal_strain */
    /* Across a plane model, of plane strain the stress, of plane stress the strain: across . (xx, yy, xy) of stress
     * and warmed for a rise by 1. */
    double across[3], warmed, kept; /* kept: as of uz_kept_energy */
    double poisson; /* of the isotropic material that is as compressible, and as stiff in shear in the mean */
} uz_anisotropy;

/* Isotropic linear elasticity of a model: stress = lambda trace(strain) I + 2 mu strain, over the strains that the
 * model has. In plane stress lambda is E nu / (1 - nu^2), in the others Lame's own E nu / ((1 + nu)(1 - 2 nu)).
 * general (borrowed) is NULL then; of another material lambda and mu are NaN, so that whoever takes it for an isotropic
 * one gets no number. */
typedef struct {
    double lambda, mu;
    const uz_anisotropy *general;
} uz_lame;

uz_lame uz_lame_of(uz_model model, double young, double poisson);
/* Poisson's ratios and axes must be such that every strain has a positive energy: uz_orthotropic_energy. */
void uz_orthotropic_make(uz_anisotropy *out, uz_model model, const uz_orthotropic *from);
/* The determinant of the compliance for direct strains, each over the root of its moduli: (1 + nu)^2 (1 - 2 nu) of an
 * isotropic material. With it the three 1 - nu_ij nu_ji, in the order xy, yz, xz, must be positive. */
double uz_orthotropic_energy(double pair[3], const uz_orthotropic *from);
uz_lame uz_lame_general(const uz_anisotropy *general);
/* A bound on strain' C strain for strains of length 1. */
double uz_most_stiffness(uz_lame lame);
/* Of those in plane stress, which have no stress across the plane, the constants of the material itself. */
uz_lame uz_lame_in_space(uz_model model, uz_lame lame);

/* Components of stress of a model: 3, 4 or 6. */
int uz_stress_count(uz_model model);

/* stress = C strain, each uz_stress_count(model) numbers; the two may be the same array. */
void uz_elastic_stress(double *stress, uz_model model, uz_lame lame, const double *strain);

/* stress' C^-1 stress. */
double uz_stress_work(uz_model model, uz_lame lame, const double *stress);

/* The strain of a free body whose temperature rose, `free_strain` = expansion * rise: that in each direct component.
 * In plane strain (1 + nu) times it, for what the held third direction adds. Of a material with directions
 * `free_strain` is the rise alone. */
void uz_thermal_strain(double *strain, uz_model model, uz_lame lame, double free_strain);

/* Energy per volume of a body of plane strain that is free to grow in its plane: of what is held across it,
 * E free_strain^2 / 2. 0 of the other models. */
double uz_kept_energy(uz_model model, uz_lame lame, double free_strain);

/* The third direct stress of a plane model: 0 in plane stress, in plane strain nu (xx + yy) - E free_strain. */
double uz_stress_zz(uz_model model, uz_lame lame, const double *stress, double free_strain);
/* The third direct strain: 0 in plane strain, in plane stress free_strain - nu / E (xx + yy). */
double uz_strain_zz(uz_model model, uz_lame lame, const double *stress, double free_strain);

/* --------------------------------------------------------- reference element */

/* Values of the shape functions at a local point; N has one per node. */
void uz_element_shape(double *N, uz_element_kind kind, const double point[3]);

/* Gauss rule of the stiffness; the reference volume is the sum of its weights. */
const uz_gauss_rule *uz_element_rule(uz_element_kind kind, uz_model model);

/* ------------------------------------------------------------------ element */

typedef struct {
    uz_element_kind kind;
    uz_model model;
    uz_formulation formulation; /* as uz_resolve_formulation gave it: never UZ_FORMULATION_AUTO */
    uz_lame lame;
    double thickness;  /* plane models; not read by the others */
    double across;     /* large deformation in plane strain: the stretch across the plane that makes stress, less 1 */
    const double *xyz; /* nodes x dim, the true coordinates: differences to the first node are taken here */
} uz_element;

/* What this element does for `asked`. AUTO: mean dilatation, of types that have it, from Poisson's ratio 0.4 on,
 * plane stress excepted, where nothing locks; else standard. BBAR is STANDARD for types without it and in plane stress,
 * INCOMPATIBLE is STANDARD for types without them and for rings (axisymmetric). */
uz_formulation uz_resolve_formulation(uz_formulation asked, uz_element_kind kind, uz_model model, double poisson);

/* What is wrong with an element's shape. */
typedef enum {
    UZ_SHAPE_GOOD,
    UZ_SHAPE_INVERTED,       /* the Jacobian is negative somewhere: nodes in the wrong order, or not convex */
    UZ_SHAPE_DEGENERATE,     /* it vanishes to rounding, or is not a number: nodes coincide or are in a line or plane */
    UZ_SHAPE_MIDDLES,        /* the corners alone are good: a node between two of them is too far off */
    UZ_SHAPE_NEGATIVE_RADIUS /* axisymmetric: a node has x < 0 */
} uz_shape_fault;
/* For a message, after "element 3 ": "is inverted or not convex", ... Never NULL. */
const char *uz_shape_fault_text(uz_shape_fault fault);

/* Is the Jacobian positive at nodes and Gauss points? It is measured against the product of its rows' lengths,
 * so that neither units nor flat elements matter. Everything below needs a good shape. */
uz_shape_fault uz_element_check(const uz_element *element);

/* The local point of an element at a place x, by Newton's iteration from its centre; xyz: of its nodes, extent: of the
 * mesh. False: it is far outside. */
bool uz_element_find(double point[3], const uz_element_type *type, const double *xyz, double extent, const double x[3]);
/* How deep a local point is within the element, in local coordinates: its least distance from a side, negative outside.
 */
double uz_element_depth(const uz_element_type *type, const double point[3]);
/* The inverse of a matrix of dim rows, 2 or 3, by its cofactors; returns its determinant. Singular: not finite. */
double uz_invert_small(double inverse[3][3], double J[3][3], int dim);

/* Derivatives by x, y [, z] of the shape functions at a local point: grad[node][direction]. Returns the Jacobian's
 * determinant. */
double uz_element_gradients(double grad[UZ_ELEMENT_NODES][3], const uz_element *element, const double point[3]);
/* Of rings: a radius of at most this part of the element's largest counts as on the axis. */
#define UZ_AXIS 1e-12
/* At the same point, of a ring: how displacements along the radius stretch it around, around[node] = N / r, which on
 * the axis is the derivative by r. Returns what an area there stands for: 2 pi r, of other plane models the thickness,
 * of solids (a volume) 1; and `around` is 0 then. */
double uz_element_around(double around[UZ_ELEMENT_NODES], const uz_element *element, double grad[UZ_ELEMENT_NODES][3],
                         const double point[3]);

/* One Gauss point of the stiffness' rule: derivatives of the shape functions by x, y, z, and the volume that the point
 * stands for. */
typedef struct {
    double point[3], grad[UZ_ELEMENT_NODES][3], det, volume;
    double N[UZ_ELEMENT_NODES], radius; /* axisymmetric only: shape functions, distance from the axis */
} uz_gauss_state;
void uz_gauss_state_at(uz_gauss_state *state, const uz_element *element, int g);

/* Volume by the Gauss rule of the stiffness. */
double uz_element_volume(const uz_element *element);

/* Stiffness ke, n x n with n = nodes x dim, both triangles and exactly symmetric, in the element's formulation. Its
 * null space is the rigid motions: 3 in a plane, 1 of a ring, 6 of a solid. Checks the shape first; ke is then zero
 * and not to be used. */
uz_shape_fault uz_element_stiffness(double *ke, const uz_element *element);

/* f += integral N' b over the volume: b (dim) is force per volume, constant. */
void uz_element_add_body_force(double *f, const uz_element *element, const double *b);
/* f += integral B' C strain: the nodal forces that a thermal strain, constant in the element, asks for. */
void uz_element_add_thermal_load(double *f, const uz_element *element, const double *thermal_strain);

/* ------------------------------------------------------- strain and stress */

/* A deformed element, once per element and displacement; then strains at as many points as wanted. Refers to the
 * element and to u, which must outlive it. */
typedef struct {
    const uz_element *element;
    const double *u;                      /* nodes x dim */
    double dilatation;                    /* BBAR: the mean over the volume */
    double internal[UZ_ELEMENT_INTERNAL]; /* INCOMPATIBLE: mode m along c is internal[m * dim + c] */
    double centre[3][3], centre_det;      /* INCOMPATIBLE: Jacobian's inverse at the centre, [x][local], and det */
} uz_element_motion;
void uz_element_move(uz_element_motion *motion, const uz_element *element, const double *u);

/* Total strain at a local point, as the stiffness takes it: u' K u = sum over Gauss points of weight * measure *
 * strain' C strain. On the axis of a ring, where the hoop strain u_r / r has no value, it is that of rr. The stress is
 * uz_elastic_stress of the strain less the thermal strain. */
void uz_element_strain(double *strain, const uz_element_motion *motion, const double point[3]);
/* u' K u / 2 from the strains at the Gauss points: a tenth of the time that K takes. */
double uz_element_strain_energy(const uz_element *element, const double *u);

/* -------------------------------------------------------------------- sides */

/* A side: an edge of 2 or 3 nodes (dim 2), a face of 3, 4, 6 or 8 (dim 3). Nodes as in uz_element_side: seen from
 * outside a face runs counter-clockwise, an edge has the element on its left; the normal points out of the element.
 * Local points: edges s in [-1, 1]; triangles the unit simplex; quadrilaterals [-1, 1]^2. */
typedef struct {
    int dim, nodes;
    uz_model model;
    double thickness;  /* plane models */
    const double *xyz; /* nodes x dim, in the side's order, true coordinates */
} uz_side;

/* A face is, in its own plane, the element of as many nodes: 3, 4, 6 or 8. */
const uz_element_type *uz_face_type(int nodes);
void uz_side_shape(double *N, const uz_side *side, const double point[2]);
/* With derivatives: slope[node][reference coordinate]. */
void uz_side_gradients(double *N, double slope[][3], const uz_side *side, const double point[2]);
/* Reference coordinates of the nodes: [node][3], of which one or two are used. */
const double (*uz_side_local_nodes(const uz_side *side))[3];
/* Gauss rule that integrates the mass matrix of an undistorted side exactly: edges 2 or 3 points, faces 3, 4, 7
 * or 9. */
int uz_side_gauss_count(const uz_side *side);
double uz_side_gauss(double point[2], const uz_side *side, int g);

/* Outward area vector per reference area at a local point: unit normal times area, with thickness or 2 pi r.
 * area[dim]. */
void uz_side_area_vector(double *area, const uz_side *side, const double point[2]);
double uz_side_area(const uz_side *side);

/* w[node] = integral of its shape function over the area: the weights of a constant traction. They sum to the area. At
 * the corners of a straight tri6 face they are 0. */
void uz_side_weights(double *w, const uz_side *side);
/* Weights that are positive and sum to the area: those above, but that on a face of eight nodes, whose corners have
 * -1/12 of it, each middle gives UZ_MIDDLE_SHARE of its own to each end of its edge: corners have 1/20, middles 1/5.
 * They are the integrals of the shape functions transformed as in A. Popp, B. Wohlmuth, M. Gee, W. Wall, "Dual
 * quadratic mortar finite element methods for 3D finite deformation contact", SIAM J. Sci. Comput. 34 (2012) B421-B446.
 */
#define UZ_MIDDLE_SHARE 0.2
void uz_side_positive_weights(double *w, const uz_side *side);
/* f (nodes x dim) += integral N' t over the area: t (dim) constant, force per area. */
void uz_side_add_traction(double *f, const uz_side *side, const double *t);
/* f += integral -N' p n: pressure p (nodes), given at the nodes, against the outward normal. */
void uz_side_add_pressure(double *f, const uz_side *side, const double *pressure);

#endif
