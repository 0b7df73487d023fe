#compdef uzawa
# Completion of uzawa for zsh. Made from client/arguments/commands.c by make man.

# The newest jobs, if the service answers at once.
_uzawa_ids() {
    local -a ids
    ids=(${(f)"$(uzawa list --quiet --limit 20 --retry 0 --timeout 1 2>/dev/null)"})
    compadd -V jobs -a ids
}

_uzawa_commands() {
    local -a commands
    commands=(
        'submit:send a problem, and wait for its answer if told to'
        'import:make a request of a deck of Abaqus or CalculiX'
        'upload:send a file that requests then name'
        'status:show a job'
        'wait:wait until a job has ended, then print its summary'
        'refine:go on where an ended job stopped, to a new accuracy'
        'verify:certify an answer from elsewhere'
        'result:fetch the answer as JSON, a table, or a file for ParaView'
        'path:tabulate displacement and stress along a line'
        'picture:draw the deformed body of a scene as SVG'
        'history:fetch or draw the convergence history'
        'plot:draw the convergence, the body, a path or the price of accuracy'
        'report:write all that is known of an answer into one HTML file'
        'request:fetch the request that a job was made of'
        'list:list jobs, newest first'
        'cancel:dismiss a waiting or running job'
        'delete:delete an ended job and its answer'
        'factors:list the factors that the service keeps for the next job'
        'nodes:list the daemons that share the service'\''s jobs, and what they hold'
        'doctor:check the way to the service and the service itself'
        'mcp:offer the service to a language model as tools'
        'version:print the version'
        'help:explain a command'
    )
    _describe -V command commands
}

_uzawa() {
    local curcontext=$curcontext state line
    typeset -A opt_args
    _arguments -C \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:command:_uzawa_commands' '*::rest:->rest'
    [[ $state == rest ]] || return
    case $words[1] in
    submit)
        _arguments \
            '--K[the stiffness matrix\: .mtx, .npy or .npz]:FILE:_files' \
            '--N[the contact normals, a row for each contact]:FILE:_files' \
            '--h[the initial gaps]:FILE:_files' \
            '--p[the load]:FILE:_files' \
            '--mesh[a mesh file (Gmsh, Abaqus, CalculiX, NASTRAN, VTK) or a part from CAD (STEP, IGES, BREP) in place of the scene'\''s mesh]:FILE:_files' \
            '--size[of a part from CAD\: the length of its elements, in mm]:H: ' \
            '--surface[an STL or OBJ file for each obstacle {"surface"\: {}} of the scene that names no file itself]:FILE:_files' \
            '--leave-out[of a deck, leave out what a scene has no words for, although the answer is another one with it]' \
            '*--set[put VALUE, as JSON or else as a string, at PATH of the request; may be repeated]:PATH=VALUE: ' \
            '*--vary[solve for each of VALUES at PATH\: FIRST\:LAST\:COUNT in equal steps, or a list A,B,C; may be repeated]:PATH=VALUES: ' \
            '--validate[only check the request\: tell all mistakes, or what it will take; nothing is solved]' \
            '(-w --wait)'{-w,--wait}'[wait until the job has ended and print the summary]' \
            '(-t --timeout)'{-t,--timeout}'[with --wait\: stop waiting after S seconds]:S: ' \
            '*--tag[label the job; may be repeated]:WORD: ' \
            '--name[what to call the job in lists]:NAME: ' \
            '(-k --key)'{-k,--key}'[idempotency key (default\: random); the same key and request give the same job]:KEY: ' \
            '--junit[write a JUnit report\: whether the job converged, each assertion, each comparison]:FILE:_files' \
            '--baseline[compare with another job\: energy, reactions, pressure, displacements and what touches]:ID:_uzawa_ids' \
            '--tolerance[what the comparison lets pass, relative (default 1e-3)]:T: ' \
            '--progress[show progress on stderr even where it is no terminal]' \
            '(-q --quiet)'{-q,--quiet}'[print the id and nothing else]' \
            '(-j --json)'{-j,--json}'[print the job as JSON, and what is wrong too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:FILE:_files' ;;
    import)
        _arguments \
            '--leave-out[of a deck, leave out what a scene has no words for, although the answer is another one with it]' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-q --quiet)'{-q,--quiet}'[tell nothing of what is not in the request]' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:FILE:_files' ;;
    upload)
        _arguments \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:FILE:_files' ;;
    status)
        _arguments \
            '(-j --json)'{-j,--json}'[print the job as JSON, and what is wrong too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    wait)
        _arguments \
            '(-t --timeout)'{-t,--timeout}'[stop waiting after S seconds]:S: ' \
            '--junit[write a JUnit report\: whether the job converged, each assertion, each comparison]:FILE:_files' \
            '--baseline[compare with another job\: energy, reactions, pressure, displacements and what touches]:ID:_uzawa_ids' \
            '--tolerance[what the comparison lets pass, relative (default 1e-3)]:T: ' \
            '--progress[show progress on stderr even where it is no terminal]' \
            '(-q --quiet)'{-q,--quiet}'[print nothing; the exit status tells]' \
            '(-j --json)'{-j,--json}'[print the job as JSON, and what is wrong too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    refine)
        _arguments \
            '(-a --accuracy)'{-a,--accuracy}'[a relative error such as 1e-8, or quick, balanced, precise, exact]:A:(quick balanced precise exact)' \
            '--max-iterations[counted from the start of the first run]:N: ' \
            '--time-limit[of the new run, in seconds]:S: ' \
            '(-w --wait)'{-w,--wait}'[wait until the job has ended and print the summary]' \
            '(-t --timeout)'{-t,--timeout}'[with --wait\: stop waiting after S seconds]:S: ' \
            '(-k --key)'{-k,--key}'[idempotency key (default\: random)]:KEY: ' \
            '--junit[write a JUnit report\: whether the job converged, each assertion, each comparison]:FILE:_files' \
            '--baseline[compare with another job\: energy, reactions, pressure, displacements and what touches]:ID:_uzawa_ids' \
            '--tolerance[what the comparison lets pass, relative (default 1e-3)]:T: ' \
            '--progress[show progress on stderr even where it is no terminal]' \
            '(-q --quiet)'{-q,--quiet}'[print the id and nothing else]' \
            '(-j --json)'{-j,--json}'[print the job as JSON, and what is wrong too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    verify)
        _arguments \
            '(-t --timeout)'{-t,--timeout}'[stop waiting after S seconds]:S: ' \
            '(-k --key)'{-k,--key}'[idempotency key (default\: random)]:KEY: ' \
            '--junit[write a JUnit report\: whether the job converged, each assertion, each comparison]:FILE:_files' \
            '--baseline[compare with another job\: energy, reactions, pressure, displacements and what touches]:ID:_uzawa_ids' \
            '--tolerance[what the comparison lets pass, relative (default 1e-3)]:T: ' \
            '--progress[show progress on stderr even where it is no terminal]' \
            '(-q --quiet)'{-q,--quiet}'[print nothing; the exit status tells]' \
            '(-j --json)'{-j,--json}'[print the job as JSON, and what is wrong too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:FILE:_files' ;;
    result)
        _arguments \
            '(-f --format)'{-f,--format}'[json (default), table\: with five digits, csv\: with all, npz\: arrays for NumPy; scenes only\: vtu, or pvd\: a vtu of each load case, as one series]:F:(json table csv npz vtu pvd)' \
            '*--fields[such as displacements, reactions, gaps, pressure, stress, von_mises (default\: reactions,gaps; of vtu\: everything useful)]:A,B:(summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain stress_gauss)' \
            '*--field[one of them; may be repeated]:NAME:(summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain stress_gauss)' \
            '(-c --case)'{-c,--case}'[of this load case alone]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    path)
        _arguments \
            '(-f --format)'{-f,--format}'[table (default) with five digits, csv or json with all]:F:(table csv json)' \
            '--from[the first point, such as 0,20]:P: ' \
            '--to[the last point]:P: ' \
            '(-n --count)'{-n,--count}'[how many points, both ends among them (default 101)]:N: ' \
            '(-c --case)'{-c,--case}'[of this load case; needed where the job has some]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    picture)
        _arguments \
            '--colour[von_mises (default), displacements or pressure]:C:(von_mises displacements pressure)' \
            '--factor[displacements are drawn X times as large (default\: so that they show)]:X: ' \
            '--view[of a solid\: corner (default), below, front, back, left, right, top or bottom]:V:(corner below front back left right top bottom)' \
            '--up[of a solid\: what points upwards, y (default) or z]:AXIS:(y z)' \
            '--width[of the picture, in pixels (default 900)]:N: ' \
            '(-c --case)'{-c,--case}'[of this load case; needed where the job has some]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[with --output\: print what was written as JSON]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    history)
        _arguments \
            '--csv[as CSV instead of JSON]' \
            '--plot[draw it\: log10 of the error bound and of the residual]' \
            '--width[of the drawing, in characters (default 72, less on a narrow terminal)]:N: ' \
            '--height[of the drawing, in lines (default 20)]:N: ' \
            '--ascii[draw in plain ASCII (default where the locale is not UTF-8)]' \
            '(-c --case)'{-c,--case}'[of this load case; needed where the job has some]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    plot)
        _arguments \
            '--deformed[draw the deformed body of a scene]' \
            '--error[draw the whole error over time and, where the mesh was chosen, over unknowns]' \
            '--trade[print what each certified digit took, as a table and a drawing]' \
            '--path[draw, in the terminal, force over displacement along the load cases of large deformation]' \
            '--x[of the convergence\: over iterations (default) or seconds]:AXIS:(iterations seconds)' \
            '*--with[draw another job'\''s convergence beside it; may be repeated]:ID:_uzawa_ids' \
            '--view[of a solid\: corner (default), below, front, back, left, right, top or bottom]:V:(corner below front back left right top bottom)' \
            '--up[of a solid\: what points upwards, y (default) or z]:AXIS:(y z)' \
            '--colour[with --deformed\: von_mises (default), displacements or pressure]:C:(von_mises displacements pressure)' \
            '--factor[with --deformed\: displacements are drawn X times as large]:X: ' \
            '--width[with --deformed and --error\: of the picture, in pixels; with --path and --trade\: of the drawing, in characters]:N: ' \
            '--ascii[draw in plain ASCII (default where the locale is not UTF-8)]' \
            '(-c --case)'{-c,--case}'[of this load case; needed where the job has some]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[with --output\: print what was written as JSON; with --path and --trade\: print the numbers]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    report)
        _arguments \
            '(-c --case)'{-c,--case}'[of this load case (default\: the worst)]:NAME: ' \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[with --output\: print what was written as JSON]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    request)
        _arguments \
            '(-o --output)'{-o,--output}'[write to FILE, whole or not at all]:FILE:_files' \
            '(-j --json)'{-j,--json}'[with --output\: print what was written as JSON]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    list)
        _arguments \
            '(-f --format)'{-f,--format}'[table (default), csv with whole names, or json with all that is known]:F:(table csv json)' \
            '--status[accepted, running, successful, failed or dismissed]:S:(accepted running successful failed dismissed)' \
            '*--tag[only jobs with this tag]:WORD: ' \
            '--name[only jobs that are called so]:NAME: ' \
            '(-n --limit)'{-n,--limit}'[at most N jobs (default 20)]:N: ' \
            '(-q --quiet)'{-q,--quiet}'[print the ids and nothing else]' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    cancel)
        _arguments \
            '(-q --quiet)'{-q,--quiet}'[print nothing; the exit status tells]' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    delete)
        _arguments \
            '(-q --quiet)'{-q,--quiet}'[print nothing; the exit status tells]' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:ID:_uzawa_ids' ;;
    factors)
        _arguments \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    nodes)
        _arguments \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    doctor)
        _arguments \
            '(-q --quiet)'{-q,--quiet}'[print only what is wrong]' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    mcp)
        _arguments \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '--context[the service that ~/.config/uzawa/config has under this name, with its token (default\: $UZAWA_CONTEXT, else what the file says; $UZAWA_SERVER and --server come before that)]:NAME: ' \
            '(-s --server)'{-s,--server}'[the service (default\: $UZAWA_SERVER, else http\://127.0.0.1\:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust]:URL: ' \
            '(-t --timeout)'{-t,--timeout}'[give up after S seconds; for wait and --wait\: stop waiting]:S: ' \
            '--retry[keep trying to reach the server for S seconds (default 3; 30 while waiting)]:S: ' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    version)
        _arguments \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' ;;
    help)
        _arguments \
            '(-f --format)'{-f,--format}'[text (default); of all commands together\: man, a manual page, bash, zsh, fish, a completion, or json]:F:(text man bash zsh fish json)' \
            '(-j --json)'{-j,--json}'[print JSON, and what is wrong as JSON too]' \
            '(-h --help)'{-h,--help}'[explain the command]' \
            '(-V --version)'{-V,--version}'[print the version]' \
            '1:COMMAND:_uzawa_commands' ;;
    esac
}

_uzawa "$@"
