/* peer.h: what each program that solves problems for the comparison has in common.
 *
 * usage: PROGRAM PROBLEM. It reads the problem, prints {"status": "ready"}, and then answers each line
 * "METHOD TOLERANCE FILE" on its input: it solves from scratch, writes the answer to FILE and prints one line,
 * {"status": "ok" or why not, "seconds": ..., "iterations": ...}. Reading, writing and loading of libraries are not in
 * the seconds; everything that starts from K, N, h, p is. */
#ifndef TESTS_PEERS_PEER_H
#define TESTS_PEERS_PEER_H

#include "uzawa.h"

typedef struct {
    double *u, *r;     /* d, m: room, zero at first; r <= 0 as in uzawa.h */
    bool has_u, has_r; /* what the answer is made of, whatever the status: both true at first */
    double seconds;
    int64_t iterations;
    char status[64]; /* "ok", which it is at first, or why there is no answer */
} peer_answer;

/* There is no answer. */
void peer_fail(peer_answer *answer, const char *why);

/* tolerance: as the peer's own option has it. file: for what is no answer. */
typedef void (*peer_method)(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file);

/* Seconds of processor that this process has used: what a quiet machine's clock shows of one thread, and what a busy
 * one's does not. */
double peer_seconds(void);

/* Answers the lines of standard input; the exit status of the program. */
int peer_serve(const uz_qp *qp, peer_method solve, void *ctx);
/* The same of the problem that the command line names, which is also ctx. */
int peer_main(int argc, char **argv, peer_method solve);
/* What a program is without its library: no answer. */
void peer_not_installed(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file);

/* Each row of N has one entry: rows are bounds. lower, upper (d): the tightest; by_lower, by_upper (d): the row that
 * each comes from, -1: none, and the bound is -+`infinity`. False, with nothing to free, where a row is none, or
 * there was no memory. */
typedef struct {
    double *lower, *upper;
    int64_t *by_lower, *by_upper;
} peer_bounds;
bool peer_bounds_of(peer_bounds *out, const uz_qp *qp, double infinity);
void peer_bounds_clear(peer_bounds *bounds);
/* r (m, zero) from the forces f (d) = K u - p of the bounds. */
void peer_bounds_reactions(double *r, const peer_bounds *bounds, const uz_qp *qp, const double *f);

#endif
