// Tries gains on all processors and prints the best: tune_in_parallel MODEL.yaml, for docs/start/motor.yaml.
#include <bf/library/sweep.hpp>

#include <algorithm>
#include <iostream>
#include <limits>

int main(int, char** arguments) try {
    bf::Sweep gains;
    gains.file = arguments[1];
    gains.points.axes = {{"Gain.Kp", {"0.05", "0.1", "0.2", "0.4"}}, {"Gain.Ki", {"0.5", "1", "2"}}};
    const auto rows = bf::sweep(gains);
    const auto error = [&](std::size_t i) {
        for (const auto& [name, value] : rows[i]->results)
            if (name == "speed_error" && rows[i]->error.empty()) return value;
        return std::numeric_limits<double>::infinity();
    };
    std::size_t best = 0;
    for (std::size_t i = 1; i < rows.size(); ++i)
        if (error(i) < error(best)) best = i;
    for (const auto& [name, value] : gains.points[best]) std::cout << name << " = " << value << "\n";
    std::cout << "speed_error " << error(best) << " rad/s\n";
} catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
}
