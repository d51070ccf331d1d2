/* Ping-pong over PVM: `pvm default|direct near|far`; the near one prints "bytes half-round-trip-in-us" for each size.
 *
 * Both are started by hand, so that each can be pinned, and find each other in PVM's message mailbox. */
#include "sizes.h"
#include <pvm3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TAG = 7 };

static void check(int code, const char *doing)
{
    if (code < 0) {
        fprintf(stderr, "pvm: %s: error %d\n", doing, code);
        pvm_exit();
        exit(1);
    }
}

/* Data are sent in place and unpacked into `buffer`: the cheapest way that PVM has. */
static void give(int other, char *buffer, int bytes)
{
    check(pvm_initsend(PvmDataInPlace), "pvm_initsend");
    check(pvm_pkbyte(buffer, bytes, 1), "pvm_pkbyte");
    check(pvm_send(other, TAG), "pvm_send");
}

static void take(int other, char *buffer, int bytes)
{
    check(pvm_recv(other, TAG), "pvm_recv");
    check(pvm_upkbyte(buffer, bytes, 1), "pvm_upkbyte");
}

static void there_and_back(int near, int other, char *buffer, int bytes, int times)
{
    for (int i = 0; i < times; i++) {
        if (near) {
            give(other, buffer, bytes);
            take(other, buffer, bytes);
        } else {
            take(other, buffer, bytes);
            give(other, buffer, bytes);
        }
    }
}

/* Leaves this task's number under `mine` and waits for the one under `theirs`. */
static int meet(char *mine, char *theirs)
{
    int number = pvm_mytid();
    check(number, "pvm_mytid (is pvmd running?)");
    check(pvm_initsend(PvmDataDefault), "pvm_initsend");
    check(pvm_pkint(&number, 1, 1), "pvm_pkint");
    check(pvm_putinfo(mine, pvm_getsbuf(), PvmMboxDefault), "pvm_putinfo");
    check(pvm_recvinfo(theirs, 0, PvmMboxWaitForInfo), "pvm_recvinfo");
    check(pvm_upkint(&number, 1, 1), "pvm_upkint");
    return number;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: pvm default|direct near|far\n");
        return 2;
    }
    int near = strcmp(argv[2], "near") == 0;
    int other = near ? meet("near", "far") : meet("far", "near");
    check(pvm_setopt(PvmRoute, strcmp(argv[1], "direct") == 0 ? PvmRouteDirect : PvmDontRoute), "pvm_setopt");
    char *buffer = malloc(LARGEST);
    if (buffer == NULL)
        return 1;
    memset(buffer, 1, LARGEST);
    for (size_t i = 0; i < N_SIZES; i++) {
        int times = trips(SIZES[i]);
        there_and_back(near, other, buffer, (int)SIZES[i], times / 10);
        double start = seconds();
        there_and_back(near, other, buffer, (int)SIZES[i], times);
        double half = (seconds() - start) / (2.0 * times);
        if (near) {
            printf("%zu %.3f\n", SIZES[i], 1e6 * half);
            fflush(stdout);
        }
    }
    free(buffer);
    pvm_exit();
    return 0;
}
