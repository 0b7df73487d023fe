/* sizes.h: the most that any type of element has, for arrays of fixed size. A type that has more raises it. */
#ifndef UZ_ELEMENT_SIZES_H
#define UZ_ELEMENT_SIZES_H

enum {
    UZ_ELEMENT_NODES = 20,   /* most nodes of an element */
    UZ_ELEMENT_DOFS = 60,    /* most displacements */
    UZ_ELEMENT_CORNERS = 8,  /* most corners */
    UZ_ELEMENT_SIDES = 6,    /* most sides */
    UZ_ELEMENT_PARTS = 6,    /* most elements of a cell of a box */
    UZ_ELEMENT_GAUSS = 27,   /* most integration points */
    UZ_ELEMENT_SAMPLES = 8,  /* most points that its stress is recovered from */
    UZ_ELEMENT_STRESSES = 6, /* most components of stress */
    UZ_ELEMENT_INTERNAL = 9, /* most internal parameters (incompatible modes) */
    UZ_SIDE_NODES = 8,       /* most nodes of a side */
    UZ_SIDE_GAUSS = 9        /* most integration points of a side */
};

#endif
