// The heavy top by the classical Runge-Kutta method: requests on standard input, answers on standard output.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

using Numbers = std::vector<double>;
using State = std::vector<double>; // six numbers; nine where the attitude is asked for, with xi behind gamma

// Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega, n = P r; xi' = xi x Omega
static State field(const Numbers &I, const Numbers &n, const State &y)
{
    const double *w = y.data(), *g = y.data() + 3;
    State f = {((I[1] - I[2]) * w[1] * w[2] + g[1] * n[2] - g[2] * n[1]) / I[0],
               ((I[2] - I[0]) * w[2] * w[0] + g[2] * n[0] - g[0] * n[2]) / I[1],
               ((I[0] - I[1]) * w[0] * w[1] + g[0] * n[1] - g[1] * n[0]) / I[2]};
    for (const double *x = g; x < w + y.size(); x += 3) {
        f.push_back(x[1] * w[2] - x[2] * w[1]);
        f.push_back(x[2] * w[0] - x[0] * w[2]);
        f.push_back(x[0] * w[1] - x[1] * w[0]);
    }
    return f;
}

// y after one step of size h: replace this by your method
template <class Field> static State step(Field f, const State &y, double h)
{
    auto moved = [&](const State &k, double share) {
        State z = y;
        for (std::size_t i = 0; i < y.size(); i++)
            z[i] += share * h * k[i];
        return z;
    };
    const State k1 = f(y), k2 = f(moved(k1, 0.5)), k3 = f(moved(k2, 0.5)), k4 = f(moved(k3, 1.0));
    State mean(y.size());
    for (std::size_t i = 0; i < y.size(); i++)
        mean[i] = (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) / 6;
    return moved(mean, 1.0);
}

static void run(std::map<std::string, Numbers> &given)
{
    const Numbers &I = given["inertia"], &n = given["moment"];
    const double h = given.count("setting") ? given["setting"][0] : 0.01;
    State y = given["state"];
    double t = 0, steps = 0;
    for (std::size_t i = 1; i < given["times"].size(); i++) {
        const double end = given["times"][i], count = std::ceil(std::fabs(end - t) / h), length = (end - t) / count;
        for (double k = 0; k < count; k++)
            y = step([&](const State &z) { return field(I, n, z); }, y, length);
        t = end;
        steps += count;
        std::printf("state %.17g", t);
        for (double value : y)
            std::printf(" %.17g", value);
        std::puts("");
        std::fflush(stdout);
    }
    std::printf("done steps %.0f evaluations %.0f\n", steps, 4 * steps);
}

int main()
{
    std::map<std::string, Numbers> given;
    for (std::string line, name; std::getline(std::cin, line);) {
        std::istringstream words(line);
        words >> name;
        if (name == "heavytop-integrator")
            std::puts("ready mine 1.0");
        else if (name == "go") {
            run(given);
            given.clear();
        } else if (name == "quit")
            break;
        else {
            Numbers &values = given[name];
            values.clear();
            for (std::string word; words >> word;)
                values.push_back(std::strtod(word.c_str(), nullptr));
        }
        std::fflush(stdout);
    }
}
