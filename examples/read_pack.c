/* Read a table of the reference pack: cc read_pack.c -o read_pack && ./read_pack FILE.csv
   Every second column is a hexadecimal double, which strtod reads without rounding. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv) {
    char line[8192];
    FILE *file = argc > 1 ? fopen(argv[1], "r") : NULL;
    if (!file || !fgets(line, sizeof line, file)) return 2;
    while (fgets(line, sizeof line, file)) {
        double row[16] = {0}; /* t, Omega (3), gamma (3), q (4), position (3) */
        int column = 0;
        for (char *cell = strtok(line, ",\n"); cell; cell = strtok(NULL, ",\n"), column++)
            if (column % 2) row[column / 2] = strtod(cell, NULL);
        printf("t = %-22.17g q = %.17g %.17g %.17g %.17g\n", row[0], row[7], row[8], row[9], row[10]);
    }
    return fclose(file);
}
