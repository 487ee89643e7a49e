#pragma once

#include "bf/matlab/interpreter.hpp"

/// The variables that the tables of expressions use.
inline bf::matlab::Workspace sample_variables() {
    bf::matlab::Workspace w;
    bf::matlab::Interpreter().run("v = [10 20 30]; A = [1 2; 3 4]; R = 4; names = {'hip', 'knee'};\n"
                                  "Config.t_step = 0.01; Config.Gain.KP = [1 2 3]; Config.end = 7;\n",
                                  w);
    return w;
}
