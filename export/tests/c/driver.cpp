// Reads the commands of driver.c that a class of C++ can do.
#include "robot.hpp"
#include <cstdio>
#include <iostream>

static gapscope::Vector numbers()
{
    gapscope::Vector x;
    for (double &value : x) std::cin >> value;
    return x;
}

int main()
{
    gapscope::Robot robot(gapscope::Vector{}, gapscope::Vector{});
    std::string command, name;
    while (std::cin >> command) {
        if (command == "s") {
            const gapscope::Vector q = numbers();
            robot.start(q, numbers());
        } else if (command == "t") {
            const gapscope::Vector tau = numbers();
            // A copy is another robot in the same moment: stepping it leaves this one alone.
            gapscope::Robot copy = robot;
            copy.step(tau);
            robot.step(tau);
            if (robot.position() != copy.position() || robot.time() != copy.time()) return 1;
            for (double x : robot.position()) std::printf("%.17g ", x);
            for (std::size_t j = 0; j < gapscope::joints(); j++)
                std::printf(j + 1 < gapscope::joints() ? "%.17g " : "%.17g\n", robot.velocity()[j]);
        } else if (command == "w") {
            std::cin >> name;
            try {
                gapscope::Residual residual(name);
                return 1;
            } catch (const std::runtime_error &error) {
                std::printf("%zu\n", std::string(error.what()).size());
            }
        } else {
            return 1;
        }
    }
    return 0;
}
