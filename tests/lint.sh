#!/usr/bin/env bash
# Formatting, static analysis, a syntax pass of both compilers and the rules of the house that a program can check.
# Prints one "ok" or "not ok" line per check.
set -uo pipefail
cores=$(nproc)
sources=$(make -s print-sources)
c_files=$(printf '%s\n' $sources | grep '\.c$' | grep -v '^solver/group/worker/')
group_files=$(printf '%s\n' $sources | grep '^solver/group/worker/.*\.c$') # where PETSc is
group_flags=$(make -s print-GROUP_FLAGS)
includes=$(make -s print-INC)
cflags=$(make -s print-SERVER_CFLAGS)
strict="$(make -s print-STD) $(make -s print-WARN)"
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
unbuilt() { # what no build has read, whose warnings are errors: nor the one with AddressSanitizer, where there is one
    local build left=$c_files
    [ "$(make -s print-CC)" = gcc ] || { printf '%s\n' $left && return; }
    for build in "$(make -s print-BUILD)"{,/asan}; do
        [ ! -d "$build" ] || [ -z "$left" ] ||
            left=$(make -n BUILD="$build" PLAIN="${build%/asan}" $(printf "$build/obj/%s.o " ${left//.c/}) | sed -n 's/.* -c -o [^ ]* //p')
    done
    printf '%s\n' $left
}
gcc_warnings() { # those that need no optimization
    unbuilt | xargs -r -P "$cores" -n 8 gcc -fsyntax-only $strict $includes $cflags -Itests -Itests/support
}
tidy() { # every warning of clang, and the quick checks that find mistakes; those left out see one in correct code here
    tidy_files "" $c_files && { [ -z "$group_files" ] || tidy_files "$group_flags" $group_files; }
}
tidy_files() { # FLAGS FILE...
    local flags=$1
    shift
    printf '%s\n' "$@" | xargs -P "$cores" -n 8 sh -c 'options=$1; shift; clang-tidy --quiet --warnings-as-errors="*" \
        --checks="-*,clang-diagnostic-*,bugprone-*,misc-redundant-expression,readability-misleading-indentation,
            -bugprone-branch-clone,-bugprone-easily-swappable-parameters,-bugprone-implicit-widening-of-multiplication-result,
            -bugprone-misplaced-widening-cast,-bugprone-narrowing-conversions,-bugprone-not-null-terminated-result,
            -bugprone-reserved-identifier,-bugprone-sizeof-expression,-bugprone-suspicious-memory-comparison" \
        "$@" -- $options 2>&1' tidy "$strict $includes $cflags $flags -Itests -Itests/support" |
        grep -Ev '^[0-9]+ warnings? (generated|treated as error)'
    return "${PIPESTATUS[1]}"
}
long_files() { # names every source of more than 1,000 lines
    wc -l $sources | awk '$2 != "total" && $1 > 1000 {print; bad = 1} END {exit bad}'
}
long_interfaces() { # names every interface of a plug point (docs/architecture.md) of more than 80 lines
    wc -l solver/{element/element_type,dual/form,law/law,assembly/discretization,obstacle/shape,io/mesh_reader,methods/method}.h \
        server/{store/engine,http/output}.h | awk '$2 != "total" && $1 > 80 {print; bad = 1} END {exit bad}'
}
long_functions() { # names every function of more than 80 lines: its braces stand alone in column one
    awk 'FNR == 1 {start = 0}
         /^\{$/ {start = FNR}
         /^\}$/ && start {if (FNR - start - 1 > 80) {print FILENAME ":" start ": " FNR - start - 1 " lines"; bad = 1} start = 0}
         END {exit bad}' $sources
}
impatient() { # what a test waits for takes PATIENT_S where it never comes: another period has a reason beside it
    ! grep -nE 'monotonic\(\) \+ [0-9.]+ *$' tests/{api,browser}/*.py
}
shell_syntax() {
    local file bad=0
    for file in $(find tests .ci -name '*.sh' -o -path '.ci/*'); do bash -n "$file" || bad=1; done
    return $bad
}
only_in() { # HEADER PATTERN: the header is included nowhere but in files that match
    ! grep -ln "include [<\"]$1" $(printf '%s\n' $sources | grep -v '^tests/') | grep -Ev "$2"
}
headers_alone() { # a header says all that it needs: one that a source includes first has shown it
    local file
    for file in $c_files; do
        echo "${file%/*}/ $(grep -m1 '^#include' "$file")"
    done | awk -F '[ "]+' -v headers="$(printf '%s\n' $sources | grep '\.h$')" '
        BEGIN {split(headers, all, "\n"); for (i in all) left[all[i]] = 1}
        {n = split($1 " solver/include/ solver/ server/ client/ tests/ tests/support/", at, " ")
         for (i = 1; i <= n && !(at[i] $3 in left); i++);
         left[at[i] $3] = 0}
        END {for (one in left) if (left[one]) print one}' | xargs -r -P "$cores" -n 4 sh -c 'options=$1; shift; status=0
        for header; do printf "#include \"%s\"\n" "$header" | gcc -fsyntax-only -x c $options -I. - || status=255; done
        exit $status' headers "$strict $includes $cflags $group_flags -Itests -Itests/support"
}
check format clang-format --dry-run -Werror $sources
check gcc gcc_warnings
check clang tidy
# C tests, all of which run under sanitizers, have shown there what it looks for.
check cppcheck cppcheck -j "$cores" --quiet --std=c11 --error-exitcode=1 --inline-suppr --enable=warning,portability \
    --suppress=missingIncludeSystem --suppress=normalCheckLevelMaxBranches $includes \
    $(printf '%s\n' $c_files | grep -v '^tests/unit/') $group_files
check headers_alone headers_alone
check rooms python3 -B tests/rooms.py
check file_length long_files
check interface_length long_interfaces
check function_length long_functions
check patience impatient
check shell shell_syntax
check cholmod_only_in_factor only_in 'cholmod' '^solver/factor/'
check sqlite_only_in_its_engine only_in 'sqlite3' '^server/store/sqlite/'
check libpq_only_in_its_engine only_in 'libpq' '^server/store/postgresql/'
check microhttpd_only_in_transport only_in 'microhttpd' '^server/http/transport/'
check petsc_only_in_worker only_in 'petsc' '^solver/group/worker/'
check mpi_only_in_worker only_in 'mpi' '^solver/group/worker/'
check jansson_only_in_client only_in 'jansson' '^client/'
exit $status
