/* What every program of this folder measures: the same sizes, the same number of round trips. */
#ifndef SIZES_H
#define SIZES_H

#include <stddef.h>
#include <time.h>

/* Bytes of payload: from one number to a large exchange. */
static const size_t SIZES[] = {8, 64, 512, 4096, 16384, 65536, 262144, 1048576, 4194304};
#define N_SIZES (sizeof SIZES / sizeof SIZES[0])
#define LARGEST 4194304

/* Round trips per size that are timed; a tenth as many go before, untimed. */
static int trips(size_t bytes)
{
    return bytes <= 4096 ? 1000 : bytes <= 65536 ? 500 : bytes <= 262144 ? 200 : 40;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
