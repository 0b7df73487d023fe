#!/usr/bin/env bash
# Formatting, static analysis and a syntax pass of both compilers. Prints one "ok" or "not ok" line per check.
set -uo pipefail
sources=$(make -s print-sources)
c_files=$(printf '%s\n' $sources | grep '\.c$')
includes=$(make -s print-INC)
cflags=$(make -s print-SERVER_CFLAGS)
status=0
check() { # NAME COMMAND...
    local name=$1 out
    shift
    if out=$("$@" 2>&1); then echo "ok lint.$name"; else
        printf '%s\n' "$out" | tail -40
        echo "not ok lint.$name"
        status=1
    fi
}
syntax() { # COMPILER
    local file
    for file in $c_files; do
        "$1" -fsyntax-only -std=c11 -D_GNU_SOURCE -Wall -Wextra -Wconversion -Wshadow -Werror $includes $cflags -Itests "$file" || return 1
    done
}
long_files() { # names every source of more than 520 lines
    wc -l $sources | awk '$2 != "total" && $1 > 520 {print; bad = 1} END {exit bad}'
}
only_in() { # HEADER PATTERN: the header is included nowhere but in files that match
    ! grep -ln "include [<\"]$1" $(printf '%s\n' $sources | grep -v '^tests/') | grep -Ev "$2"
}
check format clang-format --dry-run -Werror $sources
check gcc syntax gcc
check clang syntax clang
check cppcheck cppcheck --quiet --std=c11 --error-exitcode=1 --inline-suppr --enable=warning,portability \
    --suppress=missingIncludeSystem --suppress=normalCheckLevelMaxBranches $includes $c_files
check file_length long_files
check cholmod_only_in_factor only_in 'cholmod' '^solver/factor/'
check sqlite_only_in_store only_in 'sqlite3' '^server/store/'
check microhttpd_only_in_http only_in 'microhttpd' '^server/http/'
check jansson_only_in_codec only_in 'jansson' '^(server/codec|client)/'
exit $status
