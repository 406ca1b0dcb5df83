/* Reads commands, a line each, and answers each but `s` with a line of numbers. */
#define GAPSCOPE_HEADER_ONLY
#include "robot.c"
#include <stdio.h>

#define N GAPSCOPE_JOINTS

static int read_numbers(double *x, int count)
{
    int i;
    for (i = 0; i < count; i++)
        if (scanf("%lf", &x[i]) != 1) return 0;
    return 1;
}

static void tell(const double *x, int count)
{
    int i;
    for (i = 0; i < count; i++) printf(i ? " %.17g" : "%.17g", x[i]);
}

int main(void)
{
    gapscope_state state;
    gapscope_residual residual = { 0 };
    double x[4 * N] = { 0 }, y[N] = { 0 };
    char command, name[64];
    gapscope_start(&state, y, y);
    while (scanf(" %c", &command) == 1) {
        if (command == 'w') {
            double failed;
            if (scanf("%63s", name) != 1) return 1;
            failed = gapscope_residual_load(&residual, name);
            tell(&failed, 1);
        } else if (command == 's') {
            if (!read_numbers(x, 2 * N)) return 1;
            gapscope_start(&state, x, x + N);
            continue;
        } else if (command == 't' || command == 'h') {
            if (!read_numbers(x, N)) return 1;
            if (command == 't') gapscope_step(&state, x);
            else gapscope_hybrid_step(&state, &residual, x);
            tell(state.q, N);
            printf(" ");
            tell(state.v, N);
        } else if (command == 'i') {
            if (!read_numbers(x, 3 * N)) return 1;
            gapscope_inverse_dynamics(x, x + N, x + 2 * N, y);
            tell(y, N);
        } else if (command == 'f') {
            if (!read_numbers(x, 3 * N)) return 1;
            gapscope_forward_dynamics(x, x + N, x + 2 * N, y);
            tell(y, N);
        } else if (command == 'r') {
            if (!read_numbers(x, 4 * N)) return 1;
            gapscope_rest(x, x + N, x + 2 * N, x + 3 * N, y);
            tell(y, N);
        } else {
            return 1;
        }
        printf("\n");
    }
    gapscope_residual_free(&residual);
    return 0;
}
