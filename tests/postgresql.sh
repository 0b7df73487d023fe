#!/usr/bin/env bash
# A PostgreSQL server of the package for tests, on a socket in FOLDER, with everything below it; ends with its parent.
# usage: tests/postgresql.sh FOLDER [SETTING=VALUE...] (exec'd by a test; FOLDER/.s.PGSQL.5432 appears when it listens)
# Exit status 77: there is no server, or no other user for it where it is started as root.
set -euo pipefail
folder=$1
shift
bin=$(ls -d /usr/lib/postgresql/*/bin 2>/dev/null | sort -V | tail -1)
[ -x "${bin:-}/initdb" ] || exit 77
as=(setpriv --pdeathsig QUIT)
if [ "$(id -u)" -eq 0 ]; then
    getent passwd postgres >/dev/null || exit 77
    chown postgres: "$folder"
    as=(setpriv --reuid postgres --regid postgres --clear-groups --pdeathsig QUIT)
fi
cd /
# What initdb makes takes it seconds and is always the same: the first test of this machine keeps it for the others.
made=${TMPDIR:-/tmp}/uzawa-initdb-$(id -u)-$("$bin/postgres" --version | tr -cd '0-9.')
if [ ! -d "$folder/data" ] && [ ! -O "$made" ] && [ ! -e "$made" ]; then
    "${as[@]}" "$bin/initdb" --pgdata "$folder/data" --username postgres --auth trust --encoding UTF8 --locale C \
        --no-sync --no-instructions >/dev/null
    mkdir -m 700 "$folder/made" && cp -a "$folder/data" "$folder/made/" && mv -T "$folder/made" "$made" 2>/dev/null ||
        rm -rf "$folder/made"
elif [ ! -d "$folder/data" ]; then
    [ -O "$made" ] # another's would be no surprise here, but a risk
    cp -a "$made/data" "$folder/data"
fi
settings=()
for setting; do settings+=(-c "$setting"); done
exec "${as[@]}" "$bin/postgres" -D "$folder/data" -k "$folder" -c listen_addresses= -c shared_buffers=64MB \
    -c max_connections=200 "${settings[@]}"
