// The heavy top by TITLE: requests on standard input, answers on standard output.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
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

// METHOD

static void run(std::map<std::string, Numbers> &given)
{
    const Numbers &I = given["inertia"], &n = given["moment"];
    const double control = given.count("setting") ? given["setting"][0] : CONTROL;
    State y = given["state"];
    double t = 0, steps = 0, evaluations = 0;
    auto f = [&](const State &z) { return evaluations++, field(I, n, z); };
    Memory memory;
    for (std::size_t i = 1; i < given["times"].size(); i++) {
        const double end = given["times"][i], taken = advance(f, y, end - t, control, memory);
        if (taken < 0) {
            std::printf("failed step too small after time %.17g\n", t);
            return;
        }
        t = end;
        steps += taken;
        std::printf("state %.17g", t);
        for (double value : y)
            std::printf(" %.17g", value);
        std::puts("");
        std::fflush(stdout);
    }
    std::printf("done steps %.0f evaluations %.0f\n", steps, evaluations);
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
