# daemon.sh: sourced with $build set: starts the daemon on a free port with a database in a folder of its own, and ends
# both with the script. Sets UZAWA_SERVER for the client.
folder=$(mktemp -d)
daemon=

finish() {
    if [ -n "$daemon" ] && kill -TERM "$daemon" 2>/dev/null; then wait "$daemon" || true; fi
    rm -rf "$folder"
}
trap finish EXIT
trap 'exit 130' INT TERM

start_daemon() {
    "$build/uzawad" --listen 127.0.0.1:0 --db "$folder/contact.db" >"$folder/out" 2>"$folder/log" &
    daemon=$!
    for _ in $(seq 200); do
        grep -q '^listening on ' "$folder/out" && break
        kill -0 "$daemon" 2>/dev/null || break
        sleep 0.05
    done
    if ! grep -q '^listening on ' "$folder/out"; then
        echo "the daemon did not start; its log says:" >&2
        cat "$folder/log" >&2
        exit 1
    fi
    UZAWA_SERVER=$(sed -n 's/^listening on //p' "$folder/out")
    export UZAWA_SERVER
}

# Its exit status is left in `status`.
stop_daemon() {
    status=0
    kill -TERM "$daemon"
    wait "$daemon" || status=$?
    daemon=
}
