/* The heavy top by the classical Runge-Kutta method: requests on standard input, answers on standard output. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double inertia[3], n[3]; /* principal moments I; n = P r */

/* Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega */
static void field(const double y[6], double f[6])
{
    const double *I = inertia, *w = y, *g = y + 3;
    f[0] = ((I[1] - I[2]) * w[1] * w[2] + g[1] * n[2] - g[2] * n[1]) / I[0];
    f[1] = ((I[2] - I[0]) * w[2] * w[0] + g[2] * n[0] - g[0] * n[2]) / I[1];
    f[2] = ((I[0] - I[1]) * w[0] * w[1] + g[0] * n[1] - g[1] * n[0]) / I[2];
    f[3] = g[1] * w[2] - g[2] * w[1];
    f[4] = g[2] * w[0] - g[0] * w[2];
    f[5] = g[0] * w[1] - g[1] * w[0];
}

/* y after one step of size h: replace this by your method */
static void step(double y[6], double h)
{
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double k[6] = {0}, sum[6] = {0}, z[6];
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < 6; i++)
            z[i] = y[i] + at[stage] * h * k[i];
        field(z, k);
        for (int i = 0; i < 6; i++)
            sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < 6; i++)
        y[i] += h / 6.0 * sum[i];
}

static void take(char *text, double *values, long count)
{
    for (long i = 0; i < count; i++)
        values[i] = strtod(text, &text);
}

int main(void)
{
    char *line = NULL, *rest;
    size_t size = 0;
    double y[6] = {0}, h = 0.01, *times = NULL;
    long count = 0;
    while (getline(&line, &size, stdin) > 0) {
        const char *name = strtok_r(line, " \n", &rest);
        if (name == NULL)
            continue;
        if (!strcmp(name, "heavytop-integrator"))
            puts("ready mine 1.0");
        else if (!strcmp(name, "inertia"))
            take(rest, inertia, 3);
        else if (!strcmp(name, "moment"))
            take(rest, n, 3);
        else if (!strcmp(name, "state"))
            take(rest, y, 6);
        else if (!strcmp(name, "setting"))
            take(rest, &h, 1);
        else if (!strcmp(name, "times")) {
            count = strtol(rest, &rest, 10);
            times = realloc(times, (count + 1) * sizeof *times);
            take(rest, times, count);
        } else if (!strcmp(name, "go")) {
            double t = 0.0, steps = 0.0;
            for (long i = 0; i < count; i++) {
                double parts = ceil(fabs(times[i] - t) / h), length = (times[i] - t) / parts;
                for (double k = 0; k < parts; k++)
                    step(y, length);
                t = times[i];
                steps += parts;
                printf("state %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", t, y[0], y[1], y[2], y[3], y[4], y[5]);
                fflush(stdout);
            }
            printf("done steps %.0f evaluations %.0f\n", steps, 4 * steps);
        } else if (!strcmp(name, "quit"))
            break;
        fflush(stdout);
    }
    return 0;
}
