#!/usr/bin/env bash
# Builds the container image as server/Containerfile says and solves a problem in it. By buildah, which needs no service;
# where the registry with Debian's base image cannot be reached, one is made of Debian's packages by mmdebstrap.
# usage: tests/image.sh BUILD_DIR     minutes; what it takes is removed again
set -uo pipefail
build=$1
command -v buildah >/dev/null || { echo "skip image: buildah is not installed"; exit 0; }
work=$(mktemp -d -p "$build")
images() { buildah --root "$work/root" --runroot "$work/run" --storage-driver vfs "$@"; }
trap 'images rm -a >/dev/null 2>&1; rm -rf "$work"' EXIT
passed=0 failed=0
check() { # NAME COMMAND...
    local name=$1 out
    shift
    if out=$("$@" 2>&1); then
        echo "ok image.$name" && passed=$((passed + 1))
    else
        printf '%s\n' "$out" | tail -40
        echo "not ok image.$name" && failed=$((failed + 1))
        return 1
    fi
}
bare() { # NAME: Debian's base image, from packages
    local container
    mmdebstrap --quiet --variant=minbase bookworm "$work/base.tar" && container=$(images from scratch) &&
        images add -q "$container" "$work/base.tar" / && images commit -q --rm "$container" "$1" && rm "$work/base.tar"
}
in_image() { images run --isolation chroot "$container" -- "$@"; }
says() { # PATTERN COMMAND...: whatever its exit status
    local pattern=$1
    shift
    "$@" >"$work/said" 2>&1
    grep -qE "$pattern" "$work/said" || { cat "$work/said" && false; }
}
solves() {
    local address
    address=127.0.0.1:$(/usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
    says "outcome +converged" in_image sh -c "
        uzawad --token-file '' --insecure-public --listen $address & until uzawa --server http://$address list >/dev/null 2>&1; do kill -0 \$! || exit 1; sleep 0.2; done
        uzawa --server http://$address submit /paper_body.json --wait; kill \$!; wait"
}

base=$(sed -n 's/^FROM \([^ ]*\).*/\1/p' server/Containerfile | sort -u)
if ! images pull -q "$base" >/dev/null 2>&1; then
    command -v mmdebstrap >/dev/null || { echo "skip image: $base cannot be had, and mmdebstrap is not installed"; exit 0; }
    check base bare "$base" || exit 1
fi
if check build images bud -q --isolation chroot --layers=false --pull-never -f server/Containerfile -t uzawad .; then
    container=$(images from --pull-never localhost/uzawad)
    images copy -q "$container" tests/data/paper_body.json /paper_body.json >/dev/null
    settings=$(images inspect --type image localhost/uzawad)
    check settings grep -q '"uzawad"' <(printf '%s' "$settings" | grep '"User"')
    check version says "^uzawad [0-9]" in_image uzawad --version
    check user says "^uzawad 990$" in_image sh -c 'echo $(id -un) $(id -u)'
    check tokens_are_needed says "token" in_image uzawad --insecure-public
    check solves solves
fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
