/* Ping-pong over MPI: prints "bytes half-round-trip-in-us" for each size, from rank 0. */
#include "sizes.h"
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void there_and_back(int rank, char *buffer, int bytes, int times)
{
    int other = 1 - rank;
    for (int i = 0; i < times; i++) {
        if (rank == 0) {
            MPI_Send(buffer, bytes, MPI_BYTE, other, 0, MPI_COMM_WORLD);
            MPI_Recv(buffer, bytes, MPI_BYTE, other, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        } else {
            MPI_Recv(buffer, bytes, MPI_BYTE, other, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
            MPI_Send(buffer, bytes, MPI_BYTE, other, 0, MPI_COMM_WORLD);
        }
    }
}

int main(int argc, char **argv)
{
    int rank, ranks;
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    char *buffer = malloc(LARGEST);
    if (ranks != 2 || buffer == NULL) {
        fprintf(stderr, "mpi: %d ranks, expected 2; or no memory\n", ranks);
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    memset(buffer, 1, LARGEST);
    for (size_t i = 0; i < N_SIZES; i++) {
        int times = trips(SIZES[i]);
        there_and_back(rank, buffer, (int)SIZES[i], times / 10);
        double start = seconds();
        there_and_back(rank, buffer, (int)SIZES[i], times);
        double half = (seconds() - start) / (2.0 * times);
        if (rank == 0)
            printf("%zu %.3f\n", SIZES[i], 1e6 * half);
    }
    free(buffer);
    MPI_Finalize();
    return 0;
}
