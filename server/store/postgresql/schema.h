/* schema.h: the tables and functions in the database, and the rule for changing them:
 *   - A released version never changes. A change adds 1 to SCHEMA_VERSION and brings schema_N.sql, which turns version
 *     N - 1 into N in one transaction. Daemons of the version before go on meanwhile and afterwards: a step adds, and
 *     what it makes superfluous goes with the step after it. A function whose arguments change gets another name.
 *   - A daemon refuses a database that is newer than it knows by more than that one version. */
#ifndef SERVER_STORE_POSTGRESQL_SCHEMA_H
#define SERVER_STORE_POSTGRESQL_SCHEMA_H

#include "store/postgresql/connection.h"

#define SCHEMA_VERSION 6

/* Brings the database to the present version where it is older or empty, under a lock, so that of several daemons that
 * start one does it. False: l->message has the cause and a remedy, and nothing was changed. */
bool schema_bring(link_to *l);
/* The version that is there; 0: none. -1: it can't be read, or is no version of ours: l->message. Changes nothing. */
int schema_version(link_to *l);

#endif
