/* bench.h: what the benchmark driver calls. Rates are in MB/s with MB = 1e6 bytes. */
#ifndef TESTS_BENCH_H
#define TESTS_BENCH_H

/* Reads a coordinate text of about 100 MB from memory, one thread: the median of 5 runs. *writer_rate (may be NULL) is
 * the rate at which the same matrix is written. 0 where there was no memory or the text was refused. */
double bench_mm_rate(double *writer_rate);

#endif
