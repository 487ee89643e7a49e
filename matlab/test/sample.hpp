#pragma once

#include "bf/matlab/formula.hpp"

/// The variables that the tables of expressions use.
inline bf::matlab::Workspace sample_variables() {
    using namespace bf::matlab;
    Workspace w;
    for (const auto& [name, text] :
         {std::pair{"v", "[10 20 30]"}, std::pair{"A", "[1 2; 3 4]"}, std::pair{"R", "4"},
          std::pair{"names", "{'hip', 'knee'}"}, std::pair{"gain", "struct('KP', [1 2 3])"}})
        w.set(name, evaluate(text, w));
    w.set("Config", Value::structure({{"t_step", Value(0.01)}, {"Gain", w.at("gain")}, {"end", Value(7)}}));
    return w;
}

/// Within limits.
inline bf::matlab::Value evaluated(const std::string& text, const bf::matlab::Workspace& variables,
                                   const bf::matlab::Limits& limits) {
    return bf::matlab::resolve(*bf::matlab::parse_expression(text), {{}, variables, false, {}, limits}).value;
}
