/* uzawa_scene.h: an elastic body, its supports and loads, and what it may touch.
 * Part of uzawa.h. */
#ifndef UZAWA_SCENE_H
#define UZAWA_SCENE_H

#include "uzawa_matrices.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A scene: what a person says about a body. Plain data; strings are group names.
 * Numbers that a scene leaves out are NaN where the text says so. */
typedef enum { UZ_PLANE_STRESS, UZ_PLANE_STRAIN, UZ_AXISYMMETRIC /* x is the radius */, UZ_SOLID } uz_model;

/* How a stiffness is integrated where plain displacement elements lock. */
typedef enum {
    UZ_FORMULATION_AUTO,         /* mean dilatation where Poisson's ratio asks for it, else standard */
    UZ_FORMULATION_STANDARD,     /* full integration of the displacement's own strain */
    UZ_FORMULATION_BBAR,         /* quad4, hex8: mean dilatation (B-bar), for nearly incompressible material */
    UZ_FORMULATION_INCOMPATIBLE, /* quad4, hex8: incompatible modes, for bending */
    UZ_FORMULATIONS              /* how many */
} uz_formulation;

/* Nodes of each in VTK order. Everything else about a type of element is in its descriptor (element/element_type.h). */
typedef enum {
    UZ_TRI3,
    UZ_QUAD4,
    UZ_TRI6,
    UZ_QUAD8,
    UZ_TET4,
    UZ_HEX8,
    UZ_TET10,
    UZ_HEX20,
    UZ_WEDGE6,
    UZ_WEDGE15,
    UZ_ELEMENT_KINDS
} uz_element_kind;
const char *uz_element_name(uz_element_kind kind); /* "quad4"; never NULL */
bool uz_element_parse(uz_element_kind *out, const char *name);
int uz_element_node_count(uz_element_kind kind); /* 3 to 20 */

/* A rectangle or a cuboid in cells along the axes. Its sides are the groups left and right (x), bottom and top (y),
 * back and front (z, 3D only). */
typedef struct {
    double origin[3], size[3];
    int64_t cells[3];
    double grading[3]; /* last cell over first cell along each axis, > 0; 1 (or 0: not given): all equal */
    char element[16];  /* "quad4", "hex8", ... */
    int dim;           /* 2 or 3 */
    bool automatic;    /* uz_solve and uz_solve_cases choose the cells; those above are not read */
} uz_box;

/* A named part of a mesh as somebody gave it: by nodes, by edges or faces, or by elements. */
typedef struct {
    char name[64];
    int64_t n_nodes, *node;
    int64_t n_faces, *face_first, *face_node; /* nodes of face i: face_node[face_first[i]..face_first[i + 1]) */
    int64_t n_elements, *element;
} uz_given_group;

/* A mesh in numbers: of a request, or read from a file. Elements of all kinds are numbered together. */
typedef struct {
    int dim;
    int64_t n_nodes;
    double *xyz; /* n_nodes x dim */
    int64_t n_elements;
    unsigned char *kind;   /* n_elements: uz_element_kind */
    int64_t *first, *node; /* nodes of element e: node[first[e]..first[e + 1]); first has n_elements + 1 */
    uz_given_group *groups;
    int64_t n_groups;
    const char *from_file; /* where the file is in a request, as "/mesh/gmsh" (static text); NULL: in numbers. Of a
                            * file, nodes that no element uses (construction points) are left out, not refused */
    char digest[65];       /* SHA-256 of all that, where it is known already; "": it is not */
    /* Whose arrays those are, if not its own, and how they are given back (uz_mesh_read_kept); NULL: its own. */
    void *lender;
    void (*give_back)(void *lender);
} uz_given_mesh;
void uz_given_mesh_clear(uz_given_mesh *mesh);

/* Reads a whole Gmsh file, version 2.2, 4.0 or 4.1, ASCII or binary. Nodes and elements are numbered from 0 in the
 * order of the file; only the elements of the highest dimension are elements. Physical groups of that dimension become
 * groups of elements, of one less groups of edges or faces, of still less groups of nodes; one without a name is
 * "physical_7", or "physical_7_dim1" if a nameless one of higher dimension has that number too. A flat mesh (all z
 * equal) is plane; other surfaces are refused. max_bytes (0: none) bounds what the result may take. Errors:
 * UZ_ERR_FORMAT, _UNSUPPORTED, _NOT_FINITE, _LIMIT with the line (of a binary file the message says the byte), _MEMORY.
 * Source: Gmsh reference manual, section "Gmsh file formats". */
uz_status uz_gmsh_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);
/* Reads the mesh of an input file of Abaqus or CalculiX: *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE; the rest of the deck
 * is passed over, and what makes or moves nodes and elements refused. Numbering and errors as above. Sets become groups
 * of nodes and elements, surfaces and sets of elements on sides groups of sides; of one name for several of them, sides
 * keep it, then nodes, and the others get ".nodes" or ".elements" behind it.
 * Source: CalculiX CrunchiX user's manual. */
uz_status uz_abaqus_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);
/* The same of a file in any format that there is a reader for (io/mesh_reader.h): "gmsh", "abaqus", "nastran",
 * "vtk".
 * UZ_ERR_UNSUPPORTED: there is none of that name. */
uz_status uz_mesh_read(uz_given_mesh *out, const char *format, const char *text, size_t len, size_t max_bytes,
                       uz_error *err);

/* A surface in space: triangles by their corners, which go round counterclockwise seen from where their normals point.
 */
typedef struct {
    int64_t n;         /* triangles */
    double *x, *y, *z; /* 3 n: corners of triangle i are 3 i .. 3 i + 2 */
    int64_t left_out;  /* triangles of the file without an area */
} uz_triangles;
void uz_triangles_clear(uz_triangles *triangles);
/* Reads a surface: "stl" (ASCII or binary; normals follow from the order of corners, and a file in which most of those
 * that it states contradict it is refused), or "obj" (Wavefront: v and f; polygons are divided into triangles from
 * their first corner, names, materials, texture and normals are passed over; curves and free-form surfaces refused).
 * Corners that are no farther apart than 1e-6 of the surface's size are made one, as
 * numbers in texts are rounded. max_bytes as of uz_gmsh_read. Errors: UZ_ERR_FORMAT, _UNSUPPORTED, _NOT_FINITE and
 * _LIMIT with the line (of a binary file the message says the triangle), _MEMORY. */
uz_status uz_triangles_read(uz_triangles *out, const char *format, const char *text, size_t len, size_t max_bytes,
                            uz_error *err);
/* Can it be an obstacle? As a scene with it is refused: see uz_obstacle_new. UZ_ERR_SCENE, UZ_ERR_MEMORY. */
uz_status uz_triangles_check(const uz_triangles *triangles, bool inside, uz_error *err);

/* What a selection is made of. */
typedef enum {
    UZ_SELECT_WHAT_IS_THERE, /* sides, or where there are none, nodes */
    UZ_SELECT_SIDES,         /* outer edges or faces that lie there whole; on something round with their corners */
    UZ_SELECT_NODES,
    UZ_SELECT_ELEMENTS, /* whose middle (the mean of the corners) lies there */
    UZ_SELECT_KINDS     /* how many */
} uz_select_kind;
enum {
    UZ_SELECT_RANGE = 1,    /* low <= x <= high, each component; -+INFINITY: no limit */
    UZ_SELECT_PLANE = 2,    /* on the plane through plane_point with this normal */
    UZ_SELECT_ROUND = 4,    /* on the circle or the sphere of this centre and radius */
    UZ_SELECT_CYLINDER = 8, /* 3D: on the cylinder around this axis */
    UZ_SELECT_FACING = 16,  /* sides only: the outward normal in the middle is within so many degrees of `facing` */
    UZ_SELECT_NEAREST = 32  /* nodes only: of those that meet the rest the nearest to the point, of equals the first */
};
/* A named part of the mesh by where it is before anything moves: what meets all conditions of `by`. */
typedef struct {
    char name[64];
    char place[96]; /* where it is in the problem, "/groups/0/where" (a JSON pointer), for messages */
    uz_select_kind kind;
    unsigned by; /* UZ_SELECT_RANGE | ... */
    double low[3], high[3];
    double plane_point[3], plane_normal[3];
    double centre[3], radius;
    double axis_point[3], axis[3], axis_radius;
    double facing[3], within;
    double nearest[3];
    double tolerance; /* a length; 0: 1e-6 of the diagonal of the body's bounding box */
} uz_selection;

/* How stress follows from strain. E is the Green-Lagrange strain, C = I + 2 E, J the root of det C, lambda and mu
 * Lame's constants, K = lambda + 2/3 mu. All of them are the linear law where strains are small. */
typedef enum {
    UZ_ELASTIC_LINEAR,
    UZ_ELASTIC_ST_VENANT_KIRCHHOFF, /* W = lambda/2 (tr E)^2 + mu E:E */
    UZ_ELASTIC_NEO_HOOKE,           /* W = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2 */
    UZ_ELASTIC_NEO_HOOKE_ISOCHORIC, /* W = mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2 */
    UZ_ELASTICITIES                 /* how many */
} uz_elasticity;

/* Three planes of symmetry, as of wood, rolled sheet or fibres in one direction. A number with two axes i, j has first
 * that which is pulled: poisson is -strain j over strain i under a stress along i, so that poisson_ij / young_i is the
 * same for ij and ji. */
typedef struct {
    double young[3];     /* along the material's own axes */
    double poisson[3];   /* xy, yz, xz */
    double shear[3];     /* xy, yz, xz */
    double expansion[3]; /* strain per unit of temperature */
    double axes[2][3];   /* its x and y, of any length, across each other; plane models and rings: in the plane. All 0:
                          * those of the scene */
} uz_orthotropic;

typedef struct {
    char on[64];
    uz_elasticity law; /* kinematics FINITE: any but the linear one; FIXED, MOVING: that one */
    double young, poisson;
    bool is_orthotropic; /* of the linear law; young, poisson and expansion are not read, and yield is 0 */
    uz_orthotropic orthotropic;
    double density;   /* mass per volume: 0 where no gravity asks for it */
    double expansion; /* strain per unit of temperature */
    double yield;     /* von Mises' stress that it may bear; 0: not known */
} uz_material;

typedef enum {
    UZ_SUPPORT_COMPONENTS, /* u along the axes */
    UZ_SUPPORT_NORMAL,     /* u along one direction: a symmetry plane, a slide */
    UZ_SUPPORT_SPRING,     /* elastic ground along the axes */
    /* The group moves as a rigid body: `about` is its point, u how that moves, turn how the group turns (radians), each
     * NaN where it is free; rings have u[1] alone, plane bodies turn[2]. */
    UZ_SUPPORT_RIGID
} uz_support_kind;
typedef struct {
    uz_support_kind kind;
    char on[64];
    double u[3]; /* components; NaN: that direction is free */
    /* Components: to u comes what a turn about this point does, by an angle (radians) along its axis, of plane models
     * z; 0: none. It is linear in the angle, a x (x - about), but exact where the answer is of finite kinematics. */
    double about[3], turn[3];
    double normal[3], value; /* normal: u . normal / ||normal|| = value */
    double spring[3];        /* force per length, of the whole group, spread over it by area; >= 0 */
} uz_support;

typedef enum {
    UZ_LOAD_TRACTION,    /* v: force per area on edges or faces */
    UZ_LOAD_PRESSURE,    /* value: force per area against the outward normal */
    UZ_LOAD_FORCE,       /* v: the sum, spread over edges or faces by area, nodes equally */
    UZ_LOAD_BODY_FORCE,  /* v: force per volume of elements */
    UZ_LOAD_GRAVITY,     /* v: acceleration; times the density of each material */
    UZ_LOAD_NODE_FORCE,  /* v: at `node`; refused where nodes of a file are left out, as the others are numbered anew */
    UZ_LOAD_TEMPERATURE, /* value: rise of temperature of elements */
    UZ_LOAD_KINDS
} uz_load_kind;
typedef struct {
    uz_load_kind kind;
    char on[64];
    int64_t node;
    double v[3], value;
    /* FORCE: at this point, and with this moment (plane: [2]) about it, spread so that the group bears both as a rigid
     * body would pass them on: by its shares s, f = s (v + w x (x - c)), c their centre. Else at c, without one. */
    bool has_point;
    double point[3], moment[3];
} uz_load;

/* A new obstacle: docs/architecture/obstacle.md. */
typedef enum {
    UZ_OBSTACLE_PLANE,    /* half space: point, normal (out of the obstacle) */
    UZ_OBSTACLE_ROUND,    /* circle (2D) or sphere (3D): point is the centre, radius, inside */
    UZ_OBSTACLE_CYLINDER, /* 3D: point on the axis, normal is the axis, radius, inside */
    UZ_OBSTACLE_POLYLINE, /* 2D: n_x points (x[i], y[i]), the obstacle on the right of the line as it goes on */
    UZ_OBSTACLE_HEIGHT,   /* z over x (2D: n_y = 0, z has n_x) or over x and y (z[j * n_x + i]): the obstacle below */
    UZ_OBSTACLE_SURFACE,  /* 3D: n_x / 3 triangles, whose corners are (x[i], y[i], z[i]) in order; inside */
    UZ_OBSTACLE_BODY      /* the group `with` of the mesh, which may be or overlap `on`: the body may touch itself */
} uz_obstacle_kind;
/* Several groups that make one surface. */
typedef struct {
    int64_t n;
    char (*name)[64]; /* ascending, each once */
} uz_names;
/* Sorts them, drops what is there twice, and gives what they are called together: "bottom + side"; of a long list the
 * beginning, and a number that follows from all of it. */
void uz_name_together(char name[64], uz_names *groups);

/* Between two parts of the body, or a part and itself. */
typedef enum {
    UZ_CONTACT_SURFACES, /* the two surfaces in the mean, by dual mortar rows; on and with may be exchanged */
    UZ_CONTACT_NODES     /* nodes of `on` against faces of `with` */
} uz_contact_between;
typedef struct {
    char on[64];
    uz_names on_groups, with_groups; /* n > 0: on, with are what uz_name_together calls them */
    uz_obstacle_kind kind;
    double point[3], normal[3];
    double radius;
    bool inside; /* the body is within: a hole, a bowl, what a closed surface encloses */
    int64_t n_x, n_y;
    double *x, *y, *z;
    char with[64];
    uz_contact_between between;
    bool faceted;         /* surfaces: their facets are what they are, and stand for no smooth curve */
    double feature_angle; /* surfaces: those that turn by more keep their corner; degrees, 0: 40 */
} uz_contact;

/* Two surfaces that stay together where they are near each other, in all directions. */
typedef struct {
    char on[64], to[64];
    double tolerance; /* how far apart they may be where they are tied; 0: a tenth of the longest edge there */
} uz_tie;

typedef enum { UZ_MESH_BOX, UZ_MESH_GIVEN } uz_mesh_source;

/* Where gaps, normals and what faces what are taken. */
typedef enum {
    /* before anything moves, unless that changes the answer by more than is tolerable; with laws of finite strain
     * FIXED or FINITE, by the same rule */
    UZ_KINEMATICS_AUTO,
    UZ_KINEMATICS_FIXED,  /* before anything moves */
    UZ_KINEMATICS_MOVING, /* where the answer itself has moved the surfaces to */
    UZ_KINEMATICS_FINITE  /* there, too, and rotations and strains are as large as they are */
} uz_kinematics;

/* What a person calls the units of a scene: words that stand beside numbers, and nothing else. "": not said. */
typedef struct {
    char length[32], force[32], stress[72];
} uz_units;

typedef struct {
    uz_model model;
    uz_units units;
    uz_formulation formulation;
    double thickness; /* plane models */
    uz_mesh_source source;
    uz_box box;
    uz_given_mesh given;
    uz_selection *selections; /* parts of either mesh by where they are; no name is one of the mesh's own */
    int64_t n_selections;
    bool refine; /* no wedges: uz_solve and uz_solve_cases divide elements where the error is */
    /* n_bisected, borrowed: the mesh is refined by this list (uz_grid_sequence.bisected). NULL: not yet. The functions
     * that refine make lists themselves and take none. */
    const int64_t *bisected;
    int64_t n_bisected;
    uz_material *materials;
    int64_t n_materials;
    uz_support *supports;
    int64_t n_supports;
    double stabilizer; /* stiffness of the last support, springs that hold what nothing else does; 0: there are none */
    uz_load *loads;
    int64_t n_loads;
    uz_contact *contacts;
    int64_t n_contacts;
    uz_tie *ties;
    int64_t n_ties;
    bool all_candidates; /* solve with every contact row, also those far from any obstacle */
    bool peak_stress;    /* the evaluation tells the largest stress, as it does where a material has a yield stress */
    uz_kinematics kinematics;
    /* Only to be compared with small deformation: sides between bodies may stand for smooth surfaces, as far off these
     * as they were at first */
    bool compared;
    /* n_nodes x dim, borrowed: contacts are found where the body has been displaced by this, and linear about it: a
     * uz_result's place. NULL: before anything moves. uz_solve finds places itself (kinematics) and takes none. */
    const double *place;
    /* Of an answer of large deformation: expansion times rise of temperature of each element, as uz_result has it;
     * NULL: the loads tell. Borrowed */
    const double *free_strain;
    int64_t n_free_strain;
} uz_scene;
void uz_scene_clear(uz_scene *scene);
/* Dimensions of the bodies that its model is for: 2 or 3. */
int uz_scene_dim(const uz_scene *scene);

/* What of a deck is not in the scene that it became. */
typedef enum {
    UZ_DECK_IRRELEVANT, /* says nothing about the answer of a static step: output, control of increments */
    UZ_DECK_REPLACED,   /* what the scene has in its place is meant to be the same: hard contact for a stiff spring */
    UZ_DECK_LEFT_OUT    /* the answer would be another one with it */
} uz_deck_effect;
typedef struct {
    int64_t line;
    uz_deck_effect effect;
    char keyword[40]; /* with its asterisk, in capitals */
    char text[200];   /* what becomes of it */
} uz_deck_note;
/* An input file of Abaqus or CalculiX as a scene: mesh, materials, supports, loads, and contacts between its parts. */
typedef struct {
    uz_scene scene;
    uz_deck_note *notes; /* n_notes, by line */
    int64_t n_notes;
    int64_t *node_number; /* the deck's number of each node of the scene */
} uz_deck;
void uz_deck_clear(uz_deck *deck);
/* Reads a whole deck: its first step, which has to be a static one, at its end. The mesh is as uz_abaqus_read has it,
 * less the nodes that no element has, and with groups for what supports and loads name by number. leave_out: what a
 * scene has no words for is left out; else it is refused (UZ_ERR_UNSUPPORTED), since the answer would be another one.
 * Errors as those of uz_abaqus_read. *out is for uz_deck_clear, and empty on failure. */
uz_status uz_deck_read(uz_deck *out, const char *text, size_t len, size_t max_bytes, bool leave_out, uz_error *err);

/* Where a scene's unknowns live. */
typedef struct {
    int dim;
    int64_t n_nodes, n_elements;
    double *xyz;           /* n_nodes x dim, row by row */
    int64_t *contact_node; /* m: the node of each contact row */
    double *contact_area;  /* m: tributary area of each contact node (length x thickness in 2D; of a ring all around) */
    double *contact_normal; /* m x dim: unit normal of the obstacle at the contact, pointing towards the body */
    int64_t *contact_of;    /* m: which contact of the scene */
    int64_t *contact_face;  /* m x 2: element and side that the node meets of another part of the body, else -1, -1 */
    int64_t n_rotated;      /* uz_scene_to_qp only: nodes whose dofs are not along the axes */
    int64_t *rotated_node;  /* n_rotated */
    double *frame;          /* n_rotated x dim x dim: row c of a node's matrix is the direction of its dof c */
} uz_mesh_info;
void uz_mesh_info_clear(uz_mesh_info *info);

/* Mesh, assembly, boundary conditions: the scene as matrices. Their dofs are the free ones, node by node, along x, y,
 * z; at a node with a support along an inclined normal along that normal and tangents (info->frame), and so at one
 * whose first contact has an oblique normal: an obstacle's row of N then has one entry. Errors: UZ_ERR_SCENE,
 * _FREE_BODY (message names the modes), _NOT_FINITE, with `where` a JSON pointer into the problem. Nothing is factored.
 */
uz_status uz_scene_to_qp(uz_qp *qp, uz_mesh_info *info, const uz_scene *scene, uz_error *err);
/* The same refusals without the stiffness matrix: milliseconds where the assembly takes seconds. A box whose cells are
 * chosen here is checked on the first grid that would be tried; the other functions of a scene refuse it. */
uz_status uz_scene_check(const uz_scene *scene, uz_error *err);
/* What an answer's vectors measure, without the stiffness matrix: directions, nodes and contact rows m. */
uz_status uz_scene_sizes(int *dim, int64_t *n_nodes, int64_t *m, const uz_scene *scene, uz_error *err);

#ifdef __cplusplus
}
#endif

#endif
