/* abaqus_deck.h: what a deck of Abaqus or CalculiX says beside its mesh, on its way to a scene. Private to
 * uz_deck_read.
 *
 * The mesh is read first, by the reader of meshes (abaqus.c); then the lines are gone through again for what the deck
 * does with it (abaqus_deck.c). Decks speak of nodes, elements and sides one by one, and a later line overrides an
 * earlier one for those that both name. So what is said is kept of each node and element, and groups are made at the
 * end of those that are treated alike (abaqus_scene.c). */
#ifndef UZ_IO_ABAQUS_DECK_H
#define UZ_IO_ABAQUS_DECK_H

#include "io/abaqus.h"

typedef struct {
    char name[ABAQUS_NAME];
    int64_t line;
    bool elastic; /* young and poisson are there */
    double young, poisson, density, expansion;
} deck_material;

typedef struct {
    char name[ABAQUS_NAME];
    abaqus_text table; /* before its data lines */
} deck_amplitude;

typedef struct {
    int64_t line;
    char slave[ABAQUS_NAME], master[ABAQUS_NAME];
    char interaction[ABAQUS_NAME]; /* of contact; one that is tied makes a tie of the pair */
    bool tie;
    double tolerance; /* of a tie; 0: not given */
} deck_pair;

/* *SURFACE INTERACTION with TIED behavior. */
typedef struct {
    char name[ABAQUS_NAME];
} deck_tied;

/* What stands between surfaces in contact, in place of which a scene has nothing. */
typedef struct {
    int64_t line;
    double stiffness; /* pressure per length where they begin to touch */
    bool tie;         /* of tied ones, across or along them */
} deck_spring;

/* *RIGID BODY: nodes, or elements of the file, that move as one. */
typedef struct {
    int64_t line;
    int64_t point, turner; /* nodes whose displacements are the motion of the point, and the rotation; -1: none */
    bool of_nodes;
    int64_t count, one;
    const int64_t *index;       /* count, of a set of the file; NULL: one */
    double motion[6], force[6]; /* of the point: displacement, rotation (NaN: free); force, moment */
} deck_rigid;

/* A pressure on a side of an element (of the file), or on a surface. */
typedef struct {
    int64_t element, line; /* element -1: the surface */
    int face;
    double value;
    char surface[ABAQUS_NAME];
} deck_pressure;

typedef struct {
    abaqus_file *file;
    const int64_t *new_element;
    uz_deck *out;
    uz_given_mesh *mesh; /* out's */
    abaqus_text text;    /* the second reading */
    int64_t notes_room;

    int steps;
    bool is_static, ended; /* ended: the first step is over and another one has begun */
    double period;         /* of the static step */

    bool models[4];                           /* by uz_model: elements of its kinds are there */
    bool incompatible, plain_linear, reduced; /* elements with incompatible modes, linear ones without, reduced ones */
    double thickness;                         /* 0: not given */

    deck_material *materials;
    deck_amplitude *amplitudes;
    deck_pair *pairs;
    deck_tied *tied;
    char interaction[ABAQUS_NAME]; /* the one that is being read */
    deck_spring *springs;
    deck_pressure *pressures;
    deck_rigid *rigids;
    int64_t n_materials, n_amplitudes, n_pairs, n_tied, n_springs, n_pressures, n_rigids;
    int64_t materials_room, amplitudes_room, pairs_room, tied_room, springs_room, pressures_room, rigids_room;

    int64_t n_met; /* materials that the lines read so far begin: data are of the last of them */

    double *fixed, *force;         /* nodes x 3; fixed NaN: free */
    double *temperature, *initial; /* nodes; NaN: not said */
    int64_t *material;             /* elements of the body: index, -1: none */
    double *gravity, *body_force;  /* elements of the body x 3 */
} abaqus_deck;

/* Adds a note of at most 199 bytes, about a keyword ("*FRICTION"). */
uz_status deck_note(abaqus_deck *d, int64_t line, const char *keyword, uz_deck_effect effect, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* Has a *SURFACE INTERACTION of this name TIED behavior, as far as the lines are read? */
bool deck_is_tied(const abaqus_deck *d, const char *interaction);
/* Goes through the lines (abaqus_deck.c). */
uz_status deck_read_lines(abaqus_deck *d);

#endif
