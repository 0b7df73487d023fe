# Completion of uzawa for bash. Made from client/arguments/commands.c by make man.

# The newest jobs, if the service answers at once.
_uzawa_ids() {
    "${COMP_WORDS[0]}" list --quiet --limit 20 --retry 0 --timeout 1 2>/dev/null
}

_uzawa() {
    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
    local command='' options='' words='' files='' i commands='submit import upload status wait refine verify result path picture history plot report request list cancel delete factors nodes doctor mcp version help'
    COMPREPLY=()
    if [[ $current == '=' ]]; then current=''; previous='='; fi
    if [[ $previous == '=' ]]; then
        previous=${COMP_WORDS[COMP_CWORD-1]}
        [[ $previous != '=' ]] || previous=${COMP_WORDS[COMP_CWORD-2]}
    fi
    for ((i = 1; i < COMP_CWORD; i++)); do
        if [[ " $commands " == *" ${COMP_WORDS[i]} "* ]]; then command=${COMP_WORDS[i]}; break; fi
    done
    case $command in
    '') options='--server --timeout --retry --help --version'; words=$commands ;;
    submit) options='--K --N --h --p --mesh --size --surface --leave-out --set --vary --validate --wait --timeout --tag --name --key --junit --baseline --tolerance --progress --quiet --json --context --server --retry --help --version ' ;;
    import) options='--leave-out --output --quiet --json --context --server --timeout --retry --help --version ' ;;
    upload) options='--json --context --server --timeout --retry --help --version ' ;;
    status) options='--json --context --server --timeout --retry --help --version ' ;;
    wait) options='--timeout --junit --baseline --tolerance --progress --quiet --json --context --server --retry --help --version ' ;;
    refine) options='--accuracy --max-iterations --time-limit --wait --timeout --key --junit --baseline --tolerance --progress --quiet --json --context --server --retry --help --version ' ;;
    verify) options='--timeout --key --junit --baseline --tolerance --progress --quiet --json --context --server --retry --help --version ' ;;
    result) options='--format --fields --field --case --output --json --context --server --timeout --retry --help --version ' ;;
    path) options='--format --from --to --count --case --output --json --context --server --timeout --retry --help --version ' ;;
    picture) options='--colour --factor --view --up --width --case --output --json --context --server --timeout --retry --help --version ' ;;
    history) options='--csv --plot --width --height --ascii --case --output --json --context --server --timeout --retry --help --version ' ;;
    plot) options='--deformed --error --trade --path --x --with --view --up --colour --factor --width --ascii --case --output --json --context --server --timeout --retry --help --version ' ;;
    report) options='--case --output --json --context --server --timeout --retry --help --version ' ;;
    request) options='--output --json --context --server --timeout --retry --help --version ' ;;
    list) options='--format --status --tag --name --limit --quiet --json --context --server --timeout --retry --help --version ' ;;
    cancel) options='--quiet --json --context --server --timeout --retry --help --version ' ;;
    delete) options='--quiet --json --context --server --timeout --retry --help --version ' ;;
    factors) options='--json --context --server --timeout --retry --help --version ' ;;
    nodes) options='--json --context --server --timeout --retry --help --version ' ;;
    doctor) options='--quiet --json --context --server --timeout --retry --help --version ' ;;
    mcp) options='--json --context --server --timeout --retry --help --version ' ;;
    version) options='--json --help --version ' ;;
    help) options='--format --json --help --version ' ;;
    esac
    case $command$previous in
    -s|--server|-t|--timeout|--retry) words='' ;;
    submit--K) files=1 ;;
    submit--N) files=1 ;;
    submit--h) files=1 ;;
    submit--p) files=1 ;;
    submit--mesh) files=1 ;;
    submit--size) words='' ;;
    submit--surface) files=1 ;;
    submit--set) words='' ;;
    submit--vary) words='' ;;
    submit--timeout|submit-t) words='' ;;
    submit--tag) words='' ;;
    submit--name) words='' ;;
    submit--key|submit-k) words='' ;;
    submit--junit) files=1 ;;
    submit--baseline) words=$(_uzawa_ids) ;;
    submit--tolerance) words='' ;;
    submit--context) words='' ;;
    submit--server|submit-s) words='' ;;
    submit--retry) words='' ;;
    import--output|import-o) files=1 ;;
    import--context) words='' ;;
    import--server|import-s) words='' ;;
    import--timeout|import-t) words='' ;;
    import--retry) words='' ;;
    upload--context) words='' ;;
    upload--server|upload-s) words='' ;;
    upload--timeout|upload-t) words='' ;;
    upload--retry) words='' ;;
    status--context) words='' ;;
    status--server|status-s) words='' ;;
    status--timeout|status-t) words='' ;;
    status--retry) words='' ;;
    wait--timeout|wait-t) words='' ;;
    wait--junit) files=1 ;;
    wait--baseline) words=$(_uzawa_ids) ;;
    wait--tolerance) words='' ;;
    wait--context) words='' ;;
    wait--server|wait-s) words='' ;;
    wait--retry) words='' ;;
    refine--accuracy|refine-a) words='quick balanced precise exact' ;;
    refine--max-iterations) words='' ;;
    refine--time-limit) words='' ;;
    refine--timeout|refine-t) words='' ;;
    refine--key|refine-k) words='' ;;
    refine--junit) files=1 ;;
    refine--baseline) words=$(_uzawa_ids) ;;
    refine--tolerance) words='' ;;
    refine--context) words='' ;;
    refine--server|refine-s) words='' ;;
    refine--retry) words='' ;;
    verify--timeout|verify-t) words='' ;;
    verify--key|verify-k) words='' ;;
    verify--junit) files=1 ;;
    verify--baseline) words=$(_uzawa_ids) ;;
    verify--tolerance) words='' ;;
    verify--context) words='' ;;
    verify--server|verify-s) words='' ;;
    verify--retry) words='' ;;
    result--format|result-f) words='json table csv npz vtu pvd' ;;
    result--fields) words='summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain stress_gauss' ;;
    result--field) words='summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain stress_gauss' ;;
    result--case|result-c) words='' ;;
    result--output|result-o) files=1 ;;
    result--context) words='' ;;
    result--server|result-s) words='' ;;
    result--timeout|result-t) words='' ;;
    result--retry) words='' ;;
    path--format|path-f) words='table csv json' ;;
    path--from) words='' ;;
    path--to) words='' ;;
    path--count|path-n) words='' ;;
    path--case|path-c) words='' ;;
    path--output|path-o) files=1 ;;
    path--context) words='' ;;
    path--server|path-s) words='' ;;
    path--timeout|path-t) words='' ;;
    path--retry) words='' ;;
    picture--colour) words='von_mises displacements pressure' ;;
    picture--factor) words='' ;;
    picture--view) words='corner below front back left right top bottom' ;;
    picture--up) words='y z' ;;
    picture--width) words='' ;;
    picture--case|picture-c) words='' ;;
    picture--output|picture-o) files=1 ;;
    picture--context) words='' ;;
    picture--server|picture-s) words='' ;;
    picture--timeout|picture-t) words='' ;;
    picture--retry) words='' ;;
    history--width) words='' ;;
    history--height) words='' ;;
    history--case|history-c) words='' ;;
    history--output|history-o) files=1 ;;
    history--context) words='' ;;
    history--server|history-s) words='' ;;
    history--timeout|history-t) words='' ;;
    history--retry) words='' ;;
    plot--x) words='iterations seconds' ;;
    plot--with) words=$(_uzawa_ids) ;;
    plot--view) words='corner below front back left right top bottom' ;;
    plot--up) words='y z' ;;
    plot--colour) words='von_mises displacements pressure' ;;
    plot--factor) words='' ;;
    plot--width) words='' ;;
    plot--case|plot-c) words='' ;;
    plot--output|plot-o) files=1 ;;
    plot--context) words='' ;;
    plot--server|plot-s) words='' ;;
    plot--timeout|plot-t) words='' ;;
    plot--retry) words='' ;;
    report--case|report-c) words='' ;;
    report--output|report-o) files=1 ;;
    report--context) words='' ;;
    report--server|report-s) words='' ;;
    report--timeout|report-t) words='' ;;
    report--retry) words='' ;;
    request--output|request-o) files=1 ;;
    request--context) words='' ;;
    request--server|request-s) words='' ;;
    request--timeout|request-t) words='' ;;
    request--retry) words='' ;;
    list--format|list-f) words='table csv json' ;;
    list--status) words='accepted running successful failed dismissed' ;;
    list--tag) words='' ;;
    list--name) words='' ;;
    list--limit|list-n) words='' ;;
    list--context) words='' ;;
    list--server|list-s) words='' ;;
    list--timeout|list-t) words='' ;;
    list--retry) words='' ;;
    cancel--context) words='' ;;
    cancel--server|cancel-s) words='' ;;
    cancel--timeout|cancel-t) words='' ;;
    cancel--retry) words='' ;;
    delete--context) words='' ;;
    delete--server|delete-s) words='' ;;
    delete--timeout|delete-t) words='' ;;
    delete--retry) words='' ;;
    factors--context) words='' ;;
    factors--server|factors-s) words='' ;;
    factors--timeout|factors-t) words='' ;;
    factors--retry) words='' ;;
    nodes--context) words='' ;;
    nodes--server|nodes-s) words='' ;;
    nodes--timeout|nodes-t) words='' ;;
    nodes--retry) words='' ;;
    doctor--context) words='' ;;
    doctor--server|doctor-s) words='' ;;
    doctor--timeout|doctor-t) words='' ;;
    doctor--retry) words='' ;;
    mcp--context) words='' ;;
    mcp--server|mcp-s) words='' ;;
    mcp--timeout|mcp-t) words='' ;;
    mcp--retry) words='' ;;
    help--format|help-f) words='text man bash zsh fish json' ;;
    *)  if [[ $current == -* ]]; then words=$options; else case $command in
    submit) files=1 ;;
    import) files=1 ;;
    upload) files=1 ;;
    status) words=$(_uzawa_ids) ;;
    wait) words=$(_uzawa_ids) ;;
    refine) words=$(_uzawa_ids) ;;
    verify) files=1 ;;
    result) words=$(_uzawa_ids) ;;
    path) words=$(_uzawa_ids) ;;
    picture) words=$(_uzawa_ids) ;;
    history) words=$(_uzawa_ids) ;;
    plot) words=$(_uzawa_ids) ;;
    report) words=$(_uzawa_ids) ;;
    request) words=$(_uzawa_ids) ;;
    cancel) words=$(_uzawa_ids) ;;
    delete) words=$(_uzawa_ids) ;;
    help) words=$commands ;;
        esac; fi ;;
    esac
    if [[ $files ]]; then
        mapfile -t COMPREPLY < <(compgen -f -- "$current")
        compopt -o filenames 2>/dev/null
    else
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
    fi
    return 0
}
complete -F _uzawa uzawa
