/* uzawa_fields.h: what an answer to a scene means: fields, files, pictures. Part of uzawa.h. */
#ifndef UZAWA_FIELDS_H
#define UZAWA_FIELDS_H

#include "uzawa_results.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------ fields */

/* What an answer to a scene means, computed when somebody asks for it. A set of bits. */
typedef enum {
    UZ_FIELD_PRESSURE = 1 << 0,       /* m: force per area of contact, >= 0 for reactions <= 0 */
    UZ_FIELD_CONTACT_STATUS = 1 << 1, /* m: 1 in contact (r < 0), 0 apart */
    UZ_FIELD_STRESS = 1 << 2,         /* n_nodes x components */
    UZ_FIELD_PRINCIPAL = 1 << 3,      /* n_nodes x 3: principal stresses, the largest first */
    UZ_FIELD_VON_MISES = 1 << 4,      /* n_nodes */
    UZ_FIELD_STRAIN = 1 << 5,         /* n_nodes x components: the tensor (xy is half the shear angle), with its thermal
                                         part */
    UZ_FIELD_STRESS_GAUSS = 1 << 6,   /* the stress where the elements are integrated, unsmoothed */
    UZ_FIELD_DISPLACEMENTS = 1 << 7,  /* uz_vtu_write only, as are those below: what the caller gave */
    UZ_FIELD_REACTIONS = 1 << 8,
    UZ_FIELD_GAPS = 1 << 9,
    UZ_FIELD_MATERIALS = 1 << 10 /* of each element, as in the scene */
} uz_field;
/* "von_mises"; "unknown" where `field` is not one bit of the above. */
const char *uz_field_name(uz_field field);
bool uz_field_parse(uz_field *out, const char *name, size_t len);

/* Components: xx, yy, zz, xy in the plane (zz across it: 0 in plane stress, the hoop in axisymmetric models, where x is
 * the radius and y the axis); xx, yy, zz, xy, yz, zx in space. A field that was not asked for is NULL. */
typedef struct {
    int dim, components;
    int64_t n_nodes, n_elements, m, n_points;
    double *pressure, *contact_status;
    double *stress, *principal, *von_mises, *strain;
    double *gauss_element, *gauss_point, *gauss_stress; /* n_points, x dim, x components */
} uz_fields;
const char *const *uz_field_components(int dim); /* the names of the 4 or 6 components */

/* What fields are made from; what they do not need may be NULL. */
typedef struct {
    const double *u;     /* n_u: n_nodes x dim */
    const double *r, *g; /* m */
    int64_t n_u, m;
} uz_field_source;

/* The scene has the loads of the case that was solved (temperature makes strain without stress). Nodal stress: that at
 * the points of each element where it is most accurate, continued to its nodes (Hinton and Campbell, Int. J. Numer.
 * Meth. Engng 8 (1974) 461-480) and averaged over the elements around the node by volume; of linear elements fitted to
 * the middles of those around (Zienkiewicz and Zhu, ibid. 33 (1992) 1331-1364). Where materials meet their values are
 * averaged by volume: the jump is in gauss_stress. Errors: those of uz_scene_check, _SIZE where the answer is not one
 * of this scene, _CANCELLED. */
uz_status uz_fields_compute(uz_fields *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                            const uz_hooks *hooks, uz_error *err);
void uz_fields_clear(uz_fields *fields);

/* The same as a VTK XML file (.vtu) with the arrays that `which` names, zlib compressed. What belongs to rows of the
 * contact stands at their nodes: nodes without a row have reaction 0, a gap of NaN and status -1; of several rows at
 * one node the largest status, the smallest reaction and gap. The pressure is there on both sides of a contact, and 0
 * elsewhere. stress_gauss is left out.
 * *text is NUL-terminated, the caller frees it. */
uz_status uz_vtu_write(char **text, size_t *len, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                       const uz_hooks *hooks, uz_error *err);

/* ------------------------------------------------------------------- paths */

/* Equally spaced points of a line through the body before anything moved: count of them, at least 2, with both ends. */
typedef struct {
    double from[3], to[3];
    int64_t count;
} uz_path_line;
/* What is there at each point; NaN outside of the body. Components of the stress as in uz_fields. */
typedef struct {
    int dim, components;
    int64_t count;
    double *point, *u; /* x dim */
    double *stress;    /* x components: between nodes as the shape functions are */
    double *von_mises; /* of that stress */
} uz_path;
/* Errors: those of uz_fields_compute. *out is empty then; the caller clears it otherwise. */
uz_status uz_path_compute(uz_path *out, const uz_scene *scene, const uz_field_source *answer, const uz_path_line *line,
                          const uz_hooks *hooks, uz_error *err);
void uz_path_clear(uz_path *path);

/* ---------------------------------------------------------------- pictures */

/* Where the eye is: a corner right in front and above, below, or across a side. */
typedef enum {
    UZ_VIEW_CORNER,
    UZ_VIEW_BELOW,
    UZ_VIEW_FRONT,
    UZ_VIEW_BACK,
    UZ_VIEW_LEFT,
    UZ_VIEW_RIGHT,
    UZ_VIEW_TOP,
    UZ_VIEW_BOTTOM,
    UZ_VIEWS /* how many */
} uz_view;
/* "corner", "below", "front", ... False: of no view. */
bool uz_view_parse(uz_view *view, const char *name);

/* How a deformed body is drawn. */
typedef struct {
    int width;         /* of the picture in pixels, 200 to 4000; 0: 900 */
    double factor;     /* displacements are drawn this many times as large; 0: chosen so that they show */
    uz_field colour;   /* UZ_FIELD_DISPLACEMENTS (their length), _VON_MISES or _PRESSURE */
    const char *title; /* may be NULL */
    uz_view view;      /* of a solid */
    bool z_up;         /* of a solid: z points upwards and y away from the eye of UZ_VIEW_FRONT, not y and towards it */
} uz_picture;

/* The deformed body in colour over its undeformed outline, the obstacles, an arrow for the contact pressure at each
 * node that touches (at most some 80 of them), a colour bar with round numbers, the axes and a round length: as SVG,
 * with the body's colours as a PNG image in it, so that the size does not grow with the mesh. Obstacles of solids stand
 * behind, wherever the eye is. Of a solid in the colours of the pressure only the sides of the
 * contacts are filled, with the edges of the bodies around them; in the plane a band along those sides is coloured.
 * *svg is NUL-terminated, the caller frees it. Errors: those of uz_fields_compute, _ARGUMENT. */
uz_status uz_picture_deformed(char **svg, size_t *len, const uz_scene *scene, const uz_field_source *answer,
                              const uz_picture *how, const uz_hooks *hooks, uz_error *err);

/* ----------------------------------------------------------------- surface */

/* Numbers in single precision: value = unit * x. The unit is a power of two that brings the largest to [0.5, 1], so
 * that whatever the user's units are, nothing overflows; 1 where all are zero. */
typedef struct {
    float *x; /* NULL: not asked for */
    double unit;
    double low, high; /* of the values; 0 where there are none */
} uz_drawn;

/* What a viewer draws of an answer: the elements of a plane, the outer faces of a solid, as triangles between mesh
 * nodes (elements with middle nodes are divided at them); vertices are nodes in ascending order. Places are origin +
 * unit * position, displacements unit * displacement. */
typedef struct {
    int dim;
    int64_t n_nodes, n_elements; /* of the mesh */
    int64_t n_vertices, n_triangles, n_lines, n_outline, n_rows;
    double origin[3], unit;
    float low[3], high[3];   /* of position */
    float least[3], most[3]; /* of displacement */
    float *position;         /* n_vertices x 3; z = 0 in the plane */
    float *displacement;     /* n_vertices x 3 */
    double largest;          /* length of the largest displacement of a node that is drawn */
    double factor;           /* of displacements: one that lets them show */
    float *node;             /* n_vertices: number of the node, exact below 2^24. NULL: that of the vertex */
    uz_drawn von_mises;      /* n_vertices */
    uz_drawn touch;          /* n_vertices: contact pressure, on both bodies; -1 * unit where none is */
    unsigned *triangle;      /* n_triangles x 3, counter-clockwise from outside */
    unsigned *line;          /* n_lines x 2: edges of elements, each once */
    unsigned *outline;       /* n_outline x 2: the border of a plane, the sharp edges of a solid */
    unsigned *row_vertex;    /* n_rows: contact rows whose nodes are drawn */
    unsigned *row_contact;   /* n_rows: which contact of the scene */
    float *row_normal;       /* n_rows x 3: of the obstacle, towards the body */
    uz_drawn reaction, gap;  /* n_rows */
    uz_drawn pressure;       /* n_rows; -1 * unit where the contact has no area */
    uz_drawn arc;            /* n_rows; plane models: place along the sides of the contact's group, undeformed */
    unsigned *row_part;      /* n_rows; plane models: which connected piece of those sides */
} uz_surface;

/* which: UZ_FIELD_VON_MISES and _PRESSURE, or 0; all else is always there. most_bytes (0: no limit) bounds what the
 * arrays take. Errors: those of uz_fields_compute; _LIMIT, which says how much they would take; _NOT_FINITE. The caller
 * clears *out. */
uz_status uz_surface_compute(uz_surface *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                             size_t most_bytes, const uz_hooks *hooks, uz_error *err);
void uz_surface_clear(uz_surface *surface);

/* A plane through a solid before anything moved. */
typedef struct {
    double point[3], normal[3]; /* any length but 0 */
} uz_plane;
/* What a viewer draws where it cuts the body: triangles in the plane, counter-clockwise as seen from where the normal
 * points, lines where it cuts the sides of elements, with the displacement and, asked for by which, von Mises' stress
 * of the tensor that is between nodes as the shape functions are. Vertices are no nodes; there are no rows of contact.
 * Errors: those of uz_surface_compute; _SCENE where the model is no solid or the plane does not cut it. The caller
 * clears *out by uz_surface_clear. */
uz_status uz_section_compute(uz_surface *out, const uz_scene *scene, const uz_field_source *answer,
                             const uz_plane *plane, unsigned which, size_t most_bytes, const uz_hooks *hooks,
                             uz_error *err);

/* A history as a curve: `count` rows, `stride` doubles from a row to the next, so that a table of rows or columns alone
 * will do. */
enum { UZ_CURVES = 8 };
typedef struct {
    const char *name; /* in the legend; may be NULL */
    const double *iteration, *seconds, *dual_objective, *residual, *error_bound, *contacts, *restart;
    int64_t count, stride;
    double dual; /* a lower bound on the energy that is known beside them, as a certificate's; NaN: none */
} uz_curve;

typedef enum { UZ_PLOT_ITERATIONS, UZ_PLOT_SECONDS } uz_plot_x;
typedef enum { UZ_THEME_AUTO, UZ_THEME_LIGHT, UZ_THEME_DARK } uz_theme; /* AUTO: as whoever looks prefers */
typedef struct {
    int width; /* in pixels, 300 to 4000; 0: 900 */
    uz_plot_x x;
    uz_theme theme;
    const char *title; /* may be NULL */
} uz_plot;

/* How runs converged, as SVG: the dual objective's distance from its best known value, the total residual and the
 * certified bound on logarithmic axes, in the units of the problem, and the number of contacts, one below the other;
 * restarts are marked. n: 1 to UZ_CURVES. What is not finite, or not positive, is left out. The text stays below 8
 * points for each column of pixels, panel and curve, however long the histories are. *svg is NUL-terminated, the caller
 * frees it. Errors: UZ_ERR_ARGUMENT, _MEMORY. */
uz_status uz_picture_convergence(char **svg, size_t *len, const uz_curve *curves, int n, const uz_plot *how,
                                 uz_error *err);

/* The whole error of an answer as it fell: from grid to grid, or, on one mesh, while its equations were solved. */
typedef struct {
    const double *unknowns, *seconds, *error; /* count each; seconds since the beginning; error relative */
    int64_t count;
    double asked, mesh; /* levels: what was asked for, what the mesh of the answer loses; NaN: not drawn */
    bool grids;         /* false: one mesh, and there is nothing to draw over unknowns */
    bool guaranteed;    /* proved, not estimated */
} uz_error_curve;

/* As SVG: over seconds and, of grids, over unknowns; all axes are logarithmic. how->x is not looked at. *svg is
 * NUL-terminated, the caller frees it. Errors: UZ_ERR_ARGUMENT, _MEMORY. */
uz_status uz_picture_whole_error(char **svg, size_t *len, const uz_error_curve *curve, const uz_plot *how,
                                 uz_error *err);

#ifdef __cplusplus
}
#endif

#endif
