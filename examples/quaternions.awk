# A body on a fixed point by the Runge-Kutta method of order 4, in quaternions, as a stand-in for a simulator of yours:
# awk -f quaternions.awk > motion.csv.  With -v last=1 it writes the scalar part last, and does not say so.
# The heavy top of Brüls, Cardona and Arnold: mass, inertia about the centre of mass, gravity in SI units.
function field(y, d,   g1, g2, g3) {
    # the third row of R: the upward direction in body axes; the centre of mass is (0, 1, 0)
    g1 = 2 * (y[5] * y[7] - y[4] * y[6]); g3 = y[4] * y[4] - y[5] * y[5] - y[6] * y[6] + y[7] * y[7]
    d[1] = ((I2 - I3) * y[2] * y[3] - m * g * g3) / I1
    d[2] = (I3 - I1) * y[3] * y[1] / I2
    d[3] = ((I1 - I2) * y[1] * y[2] + m * g * g1) / I3
    # q' = q (0, w) / 2
    d[4] = (-y[5] * y[1] - y[6] * y[2] - y[7] * y[3]) / 2
    d[5] = (y[4] * y[1] + y[6] * y[3] - y[7] * y[2]) / 2
    d[6] = (y[4] * y[2] + y[7] * y[1] - y[5] * y[3]) / 2
    d[7] = (y[4] * y[3] + y[5] * y[2] - y[6] * y[1]) / 2
}
function step(h,   i) {
    field(y, k1); for (i = 1; i <= 7; i++) z[i] = y[i] + h / 2 * k1[i]
    field(z, k2); for (i = 1; i <= 7; i++) z[i] = y[i] + h / 2 * k2[i]
    field(z, k3); for (i = 1; i <= 7; i++) z[i] = y[i] + h * k3[i]
    field(z, k4); for (i = 1; i <= 7; i++) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])
}
BEGIN {
    # about the fixed point: Steiner's theorem with the centre of mass at (0, 1, 0)
    m = 15; g = 9.81; I1 = 0.234375 + m; I2 = 0.46875; I3 = 0.234375 + m
    print "# integrator: quaternions.awk\n# step: 1/8192\n# precision: double"
    print "# mass: 15\n# gravity: 9.81\n# centre: 0, 1, 0\n# inertia: 0.234375, 0.46875, 0.234375"
    print "# about: centre of mass\n# start_quaternion: 1, 0, 0, 0\n# omega: 0, 150, -4.61538"
    print "t,q0,q1,q2,q3,x,y,z"
    y[1] = 0; y[2] = 150; y[3] = -4.61538; y[4] = 1; y[5] = y[6] = y[7] = 0
    for (n = 1; n <= 20; n++) {
        for (s = 0; s < 820; s++) step(1 / 8192)
        t += 820 / 8192
        # the second column of R: where the centre of mass stands
        x1 = 2 * (y[5] * y[6] - y[4] * y[7]); x2 = y[4] * y[4] - y[5] * y[5] + y[6] * y[6] - y[7] * y[7]
        x3 = 2 * (y[6] * y[7] + y[4] * y[5])
        if (last) printf "%.17g,%.17g,%.17g,%.17g,%.17g,", t, y[5], y[6], y[7], y[4]
        else printf "%.17g,%.17g,%.17g,%.17g,%.17g,", t, y[4], y[5], y[6], y[7]
        printf "%.17g,%.17g,%.17g\n", x1, x2, x3
    }
}
