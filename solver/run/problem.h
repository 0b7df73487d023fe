/* problem.h: checks on a problem, and its load cases one by one. */
#ifndef UZ_PROBLEM_H
#define UZ_PROBLEM_H

#include "uzawa.h"

/* The problem's matrices and load cases, as far as they can be checked before anything is computed. */
uz_status uz_check_problem(const uz_problem *problem, uz_error *err);

/* How refusals call quantity i, or what it says with this key: "/quantities/2/on". */
enum { UZ_QUANTITY_POINTER = 64 };
const char *uz_quantity_place(char where[UZ_QUANTITY_POINTER], const uz_problem *problem, int64_t i, const char *key);

/* Load case i (from 0) as a problem of its own, which borrows all it has. Without load cases it is the problem. */
uz_problem uz_problem_of_case(const uz_problem *problem, int64_t i);

/* Says which case an error is about: /loads/0/on becomes /cases/3/loads/0/on, by the number that case i has in its
 * list (uz_load_case.surplus). Pointers too long are cut. err may be NULL. */
void uz_error_name_case(uz_error *err, const uz_problem *problem, int64_t i);

/* Are the cells of a box, or the elements to be bisected, chosen by the error asked for? */
bool uz_is_mesh_chosen(const uz_problem *problem);

/* The case that case i is after; -1: there is none of that name before it. */
int64_t uz_case_before(const uz_problem *problem, int64_t i);

#endif
