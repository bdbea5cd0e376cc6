/* The heavy top by TITLE: requests on standard input, answers on standard output. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double inertia[3], n[3]; /* principal moments I; n = P r */
static int size = 6;            /* of a state: 9 where the attitude is asked for, with xi behind gamma */
static double evaluations;

/* Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega; xi' = xi x Omega */
static void field(const double y[9], double f[9])
{
    const double *I = inertia, *w = y, *g = y + 3;
    evaluations++;
    f[0] = ((I[1] - I[2]) * w[1] * w[2] + g[1] * n[2] - g[2] * n[1]) / I[0];
    f[1] = ((I[2] - I[0]) * w[2] * w[0] + g[2] * n[0] - g[0] * n[2]) / I[1];
    f[2] = ((I[0] - I[1]) * w[0] * w[1] + g[0] * n[1] - g[1] * n[0]) / I[2];
    for (int i = 3; i < size; i += 3) {
        f[i] = y[i + 1] * w[2] - y[i + 2] * w[1];
        f[i + 1] = y[i + 2] * w[0] - y[i] * w[2];
        f[i + 2] = y[i] * w[1] - y[i + 1] * w[0];
    }
}

/* METHOD */

/* the numbers of the text, at most so many; how many there are */
static long take(char *text, double *values, long most)
{
    char *end;
    for (long i = 0; i < most; i++, text = end) {
        values[i] = strtod(text, &end);
        if (end == text)
            return i;
    }
    return most;
}

int main(void)
{
    char *line = NULL, *rest;
    size_t room = 0;
    double y[9] = {0}, control = CONTROL, *times = NULL;
    long count = 0;
    while (getline(&line, &room, stdin) > 0) {
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
            size = take(rest, y, 9);
        else if (!strcmp(name, "setting"))
            take(rest, &control, 1);
        else if (!strcmp(name, "times")) {
            count = strtol(rest, &rest, 10);
            times = realloc(times, (count + 1) * sizeof *times);
            take(rest, times, count);
        } else if (!strcmp(name, "go")) {
            double t = 0.0, steps = 0.0, taken = 0.0;
            evaluations = 0.0;
            for (long i = 0; i < count; i++) {
                taken = advance(y, times[i] - t, control, i == 0);
                if (taken < 0)
                    break;
                t = times[i];
                steps += taken;
                printf("state %.17g", t);
                for (int j = 0; j < size; j++)
                    printf(" %.17g", y[j]);
                puts("");
                fflush(stdout);
            }
            if (taken < 0)
                printf("failed step too small after time %.17g\n", t);
            else
                printf("done steps %.0f evaluations %.0f\n", steps, evaluations);
        } else if (!strcmp(name, "quit"))
            break;
        fflush(stdout);
    }
    return 0;
}
