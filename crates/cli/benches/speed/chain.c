/* A chain as one would write it down: it records nothing, and loops from block to block. The one-way rule only.
   Arguments: blocks, steps, k, eta, kt, dt, m, threshold, sliding friction, K, V.
   Prints nanoseconds per step, the displacement of block 1 and the number of switches. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

int main(int count, char **argument) {
    if (count != 12) return 2;
    const long blocks = atol(argument[1]), steps = atol(argument[2]), last = blocks - 1;
    double number[9];
    for (int i = 0; i < 9; i++) number[i] = atof(argument[3 + i]);
    const double k = number[0], eta = number[1], kt = number[2], dt = number[3], dt_over_m = dt / number[4];
    const double threshold = number[5], friction = number[6], drive_stiffness = number[7], speed = number[8];
    double *u = calloc(blocks, sizeof *u), *v = calloc(blocks, sizeof *v);
    double *stick = calloc(blocks, sizeof *stick), *tau = calloc(blocks, sizeof *tau);
    char *slides = calloc(blocks, 1);
    long switches = 0;
    struct timespec from, to;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (long step = 1; step <= steps; step++) {
        const double drive = drive_stiffness * (speed * (step * dt) - u[0]);
        tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]) + drive;
        for (long n = 1; n < last; n++)
            tau[n] = k * (u[n + 1] - 2 * u[n] + u[n - 1]) + eta * (v[n + 1] - 2 * v[n] + v[n - 1]);
        tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
        for (long n = 0; n < blocks; n++) {
            if (slides[n]) {
                const double sign = v[n] > 0 ? 1 : v[n] < 0 ? -1 : 0;
                v[n] += (tau[n] - friction * sign) * dt_over_m;
                u[n] += v[n] * dt;
                if (v[n] <= 0) {
                    slides[n] = 0;
                    stick[n] = u[n] - tau[n] / kt;
                    switches++;
                }
            } else {
                v[n] += (tau[n] - kt * (u[n] - stick[n])) * dt_over_m;
                u[n] += v[n] * dt;
                if (fabs(tau[n]) >= threshold) {
                    slides[n] = 1;
                    switches++;
                }
            }
        }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    const double elapsed_ns = (to.tv_sec - from.tv_sec) * 1e9 + (to.tv_nsec - from.tv_nsec);
    printf("%.3f %.17g %ld\n", elapsed_ns / steps, u[0], switches);
    return 0;
}
