/* postgresql.h: the engine of stores in a PostgreSQL database (15 or newer), which any number of daemons share. */
#ifndef SERVER_STORE_POSTGRESQL_POSTGRESQL_H
#define SERVER_STORE_POSTGRESQL_POSTGRESQL_H

#include "store/engine.h"

extern const store_engine STORE_POSTGRESQL;

#endif
