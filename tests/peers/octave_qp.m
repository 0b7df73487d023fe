% Octave's qp, a null-space active set method on dense matrices: method "primal" on K, N, h, p, and "dual" on the
% condensed problem with z >= 0, r = -z. It has no tolerance.
% usage: octave-cli octave_qp.m primal PROBLEM | dual CONDENSED D_OF_THE_PROBLEM
1;

function A = read_matrix(file, rows, cols, nnz)
    start = fread(file, cols + 1, 'int64');
    row = fread(file, nnz, 'int64');
    value = fread(file, nnz, 'double');
    col = repelems(1:cols, [1:cols; diff(start)']);
    A = sparse(row + 1, col', value, rows, cols);
end

function q = read_problem(path)
    file = fopen(path, 'rb');
    head = fread(file, 4, 'int64');
    q.d = head(1);
    q.m = head(2);
    q.K = read_matrix(file, q.d, q.d, head(3));
    q.K = q.K + tril(q.K, -1)';
    q.N = read_matrix(file, q.m, q.d, head(4));
    q.h = fread(file, q.m, 'double');
    q.p = fread(file, q.d, 'double');
    fclose(file);
end

function q = read_condensed(path)
    file = fopen(path, 'rb');
    q.m = fread(file, 1, 'int64');
    q.D = fread(file, [q.m, q.m], 'double');
    q.g0 = fread(file, q.m, 'double');
    fclose(file);
end

function write_answer(path, d, m, u, r)
    file = fopen(path, 'wb');
    fwrite(file, [d, m, !isempty(u), 1], 'int64');
    fwrite(file, u, 'double');
    fwrite(file, r, 'double');
    fclose(file);
end

function [u, r, info, seconds] = solve_primal(q)
    options = struct('MaxIter', 10000);
    start = cputime();
    [u, objective, how, lambda] = qp(zeros(q.d, 1), full(q.K), -q.p, [], [], [], [], [], full(q.N), q.h, options);
    seconds = cputime() - start;
    r = -lambda(1:q.m);
    info = how;
end

function [r, info, seconds] = solve_dual(q)
    options = struct('MaxIter', 10000);
    start = cputime();
    [z, objective, how] = qp(zeros(q.m, 1), q.D, q.g0, [], [], zeros(q.m, 1), [], options);
    seconds = cputime() - start;
    r = -z;
    info = how;
end

function [u, r, info, seconds] = answer(method, q)
    u = [];
    if strcmp(method, 'primal')
        [u, r, info, seconds] = solve_primal(q);
    else
        [r, info, seconds] = solve_dual(q);
    end
end

function serve(method, q, d)
    printf('{"status": "ready"}\n');
    fflush(stdout);
    while !isempty(line = input('', 's')) % fgetl(stdin) waits for a full buffer
        word = strsplit(strtrim(line), ' ');
        status = 'ok';
        seconds = 0;
        iterations = 0;
        start = cputime();
        try
            [u, r, info, seconds] = answer(method, q);
            iterations = info.solveiter;
            if info.info != 0
                status = sprintf('Octave info %d', info.info);
            end
            write_answer(word{3}, d, q.m, u, r);
        catch problem
            seconds = cputime() - start;
            status = strrep(strrep(problem.message(1:min(end, 80)), '"', ''''), "\n", ' ');
        end
        printf('{"status": "%s", "seconds": %.9g, "iterations": %d}\n', status, seconds, iterations);
        fflush(stdout);
    end
end

arguments = argv();
if strcmp(arguments{1}, 'primal')
    q = read_problem(arguments{2});
    serve('primal', q, q.d);
else
    serve('dual', read_condensed(arguments{2}), str2double(arguments{3}));
end
