/* pace.h: how long solves take here for what the library's model of cost says. Its rates are measured once in each
 * process, and machines change their speed from hour to hour; bodies and requests of one service are rather alike. */
#ifndef SERVER_WORK_PACE_H
#define SERVER_WORK_PACE_H

#include "uzawa.h"

enum { PACE_FORMS = UZ_OPERATOR_DISTRIBUTED + 1 };

typedef struct pace pace;

/* NULL: no memory. */
pace *pace_new(void);
void pace_free(pace *p);

/* A solve that ended: seconds that the model said, and those that it took. Short ones, and what is no number, tell
 * nothing and are left out. Any thread. */
void pace_add(pace *p, uz_operator op, double said, double took);

/* By what seconds of the model are to be multiplied, of each form of the operator: the median of the last solves; 1
 * where there were few. p NULL: 1. */
void pace_now(pace *p, double factor[PACE_FORMS]);

#endif
