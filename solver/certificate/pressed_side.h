/* pressed_side.h: what a pressure does to a deformed side, for the certificate of finite kinematics: by code of its
 * own, in extended precision. */
#ifndef UZ_CERTIFICATE_PRESSED_SIDE_H
#define UZ_CERTIFICATE_PRESSED_SIDE_H

#include "element/element.h"

/* force (nodes x dim) = -p integral N n da over the side, whose nodes are at x (nodes x dim), n its outward normal
 * there; ke (full): the symmetric part of the derivative of -force in x: stiffness. */
void uz_pressed_side(long double *force, double *ke, const uz_side *side, const long double *x, double pressure);

#endif
