# A heavy top by the Runge-Kutta method of order 4, as a stand-in for a program of yours: awk -f rk4.awk > motion.csv
# What `heavytop score` reads: the top and the start in comments, then a time and a state in each line.
function field(y, d,   i) {
    d[1] = ((I2 - I3) * y[2] * y[3] + P * (y[5] * c - y[6] * b)) / I1
    d[2] = ((I3 - I1) * y[3] * y[1] + P * (y[6] * a - y[4] * c)) / I2
    d[3] = ((I1 - I2) * y[1] * y[2] + P * (y[4] * b - y[5] * a)) / I3
    d[4] = y[5] * y[3] - y[6] * y[2]
    d[5] = y[6] * y[1] - y[4] * y[3]
    d[6] = y[4] * y[2] - y[5] * y[1]
}
function step(h,   i) {
    field(y, k1); for (i = 1; i <= 6; i++) z[i] = y[i] + h / 2 * k1[i]
    field(z, k2); for (i = 1; i <= 6; i++) z[i] = y[i] + h / 2 * k2[i]
    field(z, k3); for (i = 1; i <= 6; i++) z[i] = y[i] + h * k3[i]
    field(z, k4); for (i = 1; i <= 6; i++) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])
}
BEGIN {
    I1 = 2; I2 = 2; I3 = 1; P = 1; a = 0; b = 0; c = 0.5
    print "# integrator: rk4.awk\n# step: 1/128\n# precision: double"
    print "# inertia: 2, 2, 1\n# weight: 1\n# centre: 0, 0, 0.5\n# omega: 0.25, -0.5, 1.75\n# gamma: 0.6, 0, 0.8"
    print "t,omega1,omega2,omega3,gamma1,gamma2,gamma3"
    y[1] = 0.25; y[2] = -0.5; y[3] = 1.75; y[4] = 0.6; y[5] = 0; y[6] = 0.8
    for (n = 1; n <= 20; n++) {
        for (s = 0; s < 128; s++) step(1 / 128)
        printf "%d,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", n, y[1], y[2], y[3], y[4], y[5], y[6]
    }
}
