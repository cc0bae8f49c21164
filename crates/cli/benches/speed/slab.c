/* Single steps of a slab from node to node, as one would write them down.
   Arguments: file of the displacements at the start, columns, rows, driven node, steps, k, eta, k_f, k_t,
   mu_s, mu_d, load on a node of the top row, K, V, dt, m.
   Prints nanoseconds per step, the displacement of the driven node and the number of switches. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static long columns, rows;
static double k, eta;

/* What springs and dashpots pull a node with, over the bonds that it has. */
static inline void bond(double *fx, double *fz, const double *ux, const double *uz, const double *vx,
                        const double *vz, long n, long m, double ex, double ez, double stiffness) {
    const double stretch = ex * (ux[m] - ux[n]) + ez * (uz[m] - uz[n]);
    *fx += stiffness * ex * stretch + eta * (vx[m] - vx[n]);
    *fz += stiffness * ez * stretch + eta * (vz[m] - vz[n]);
}

int main(int count, char **argument) {
    if (count != 17) return 2;
    columns = atol(argument[2]), rows = atol(argument[3]);
    const long driven = atol(argument[4]), steps = atol(argument[5]), nodes = columns * rows;
    double number[11];
    for (int i = 0; i < 11; i++) number[i] = atof(argument[6 + i]);
    k = number[0], eta = number[1];
    const double kf = number[2], kt = number[3], mu_s = number[4], mu_d = number[5], load = number[6];
    const double drive_stiffness = number[7], speed = number[8], dt = number[9], dt_over_m = dt / number[10];
    double *ux = calloc(nodes, sizeof *ux), *uz = calloc(nodes, sizeof *uz);
    double *vx = calloc(nodes, sizeof *vx), *vz = calloc(nodes, sizeof *vz);
    double *fx = calloc(nodes, sizeof *fx), *fz = calloc(nodes, sizeof *fz);
    double *stick = calloc(columns, sizeof *stick);
    char *slides = calloc(columns, 1);
    FILE *start = fopen(argument[1], "rb");
    if (!start || fread(ux, sizeof *ux, nodes, start) != (size_t)nodes) return 2;
    if (fread(uz, sizeof *uz, nodes, start) != (size_t)nodes) return 2;
    fclose(start);
    const double relaxed = ux[driven], diagonal = sqrt(0.5);
    long switches = 0;
    struct timespec from, to;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (long step = 1; step <= steps; step++) {
        for (long row = 0; row < rows; row++) {
            for (long column = 0; column < columns; column++) {
                const long n = row * columns + column;
                const int left = column > 0, right = column + 1 < columns, down = row > 0, up = row + 1 < rows;
                double x = 0, z = 0;
                if (left) bond(&x, &z, ux, uz, vx, vz, n, n - 1, 1, 0, k);
                if (right) bond(&x, &z, ux, uz, vx, vz, n, n + 1, 1, 0, k);
                if (down) bond(&x, &z, ux, uz, vx, vz, n, n - columns, 0, 1, k);
                if (up) bond(&x, &z, ux, uz, vx, vz, n, n + columns, 0, 1, k);
                if (left && down)
                    bond(&x, &z, ux, uz, vx, vz, n, n - columns - 1, diagonal, diagonal, k / 2);
                if (right && up)
                    bond(&x, &z, ux, uz, vx, vz, n, n + columns + 1, diagonal, diagonal, k / 2);
                if (right && down)
                    bond(&x, &z, ux, uz, vx, vz, n, n - columns + 1, diagonal, -diagonal, k / 2);
                if (left && up)
                    bond(&x, &z, ux, uz, vx, vz, n, n + columns - 1, diagonal, -diagonal, k / 2);
                fx[n] = x, fz[n] = z;
            }
        }
        for (long n = nodes - columns; n < nodes; n++) fz[n] -= load;
        fx[driven] += drive_stiffness * (speed * (step * dt) - (ux[driven] - relaxed));
        for (long n = 0; n < columns; n++) {
            const double tau = fx[n], p = uz[n] < 0 ? -kf * uz[n] : 0, v = vx[n];
            fz[n] += p;
            if (slides[n])
                fx[n] -= v > 0 ? mu_d * p : v < 0 ? -mu_d * p : 0;
            else
                fx[n] -= kt * (ux[n] - stick[n]);
            const double new_v = v + fx[n] * dt_over_m;
            if (slides[n] && new_v <= 0) {
                slides[n] = 0;
                stick[n] = ux[n] + new_v * dt - tau / kt;
                switches++;
            } else if (!slides[n] && fabs(tau) >= mu_s * p) {
                slides[n] = 1;
                switches++;
            }
        }
        for (long n = 0; n < nodes; n++) {
            vx[n] += fx[n] * dt_over_m, vz[n] += fz[n] * dt_over_m;
            ux[n] += vx[n] * dt, uz[n] += vz[n] * dt;
        }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    const double elapsed_ns = (to.tv_sec - from.tv_sec) * 1e9 + (to.tv_nsec - from.tv_nsec);
    printf("%.3f %.17g %ld\n", elapsed_ns / steps, ux[driven], switches);
    return 0;
}
