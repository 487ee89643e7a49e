// Settings that change what a standard block declares, for tests that go through all of them.
#pragma once

#include "bf/core/value.hpp"

#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace bf::conformance {

using Settings = std::vector<std::pair<std::string, Value>>;

inline Value row(std::initializer_list<double> values) {
    return Value(Matrix(
        Eigen::Map<const Vector>(values.begin(), static_cast<Eigen::Index>(values.size())).transpose()));
}

/// By block: settings beside the defaults that change which ports or rules it has.
inline const std::multimap<std::string, Settings>& variants() {
    static const std::multimap<std::string, Settings> all = [] {
        std::multimap<std::string, Settings> v{
            {"Gain", {{"multiplication", "K*u"}}},
            {"Gain", {{"K", 0.1}}},
            {"Constant", {{"value", row({1.5, -2, 0.1})}}},
            {"Sine", {{"frequency", row({200, 300})}, {"phase", 0.3}}},
            {"Step", {{"time", 0.02}}},
            {"RepeatingStair", {{"values", row({1, -2, 3})}}},
            {"Ramp", {{"slope", row({0.1, -0.3})}, {"start", 0.01}}},
            {"Pulse", {{"cycle", 0.03}, {"amplitude", 2.5}}},
            {"Chirp", {{"f0", 3}, {"f1", 40}, {"target", 1}}},
            {"Sum", {{"signs", "+-+"}}},
            {"Sum", {{"signs", "-"}}},
            {"Product", {{"operations", "*/"}}},
            {"Product", {{"operations", "/"}}},
            {"Product", {{"operations", "/"}, {"multiplication", "matrix"}}},
            {"Product", {{"operations", "/*"}, {"multiplication", "matrix"}}},
            {"Product", {{"operations", "*/*"}, {"multiplication", "matrix"}}},
            {"Fcn", {{"expression", "p(1)*u1^2 - sin(u2(1)) + (u1 > 0)"}, {"p", 0.3}}},
            {"Minimum", {{"inputs", 1}}},
            {"Norm", {{"kind", "1"}}},
            {"Norm", {{"kind", "inf"}}},
            {"Reshape", {{"size", row({3, 3})}}},
            {"ConcatenateMatrices", {{"direction", "vertical"}}},
            {"PseudoInverse", {{"method", "truncated"}}},
            {"LinearSolve", {{"method", "cholesky"}}},
            {"LinearSolve", {{"method", "least_squares"}}},
            {"LinearSolve", {{"side", "right"}}},
            {"RotationAboutAxis", {{"axis", "x"}}},
            {"Demux", {{"sizes", row({1, 2})}}},
            {"Selector", {{"indices", row({3, 1})}, {"columns", 2}}},
            {"StateSpace",
             {{"A", Matrix{{-1.0, 2.0}, {0.0, -3.0}}}, {"B", Matrix{{0.0}, {1.0}}}, {"C", row({1, 1})}}},
            {"StateSpace",
             {{"A", Matrix{{-1.0, 2.0}, {0.0, -3.0}}},
              {"B", Matrix{{0.0}, {1.0}}},
              {"C", row({1, 1})},
              {"D", 0.5}}},
            {"Assign", {{"indices", 2}, {"columns", row({1, 3})}}},
            {"Convert", {{"type", "uint8"}, {"on_overflow", "saturate"}}},
            {"Sum", {{"on_overflow", "error"}}},
            {"Gain", {{"on_overflow", "error"}}},
            {"Product", {{"on_overflow", "saturate"}}},
            {"SumOfElements", {{"along", "columns"}}},
            {"SumOfElements", {{"along", "rows"}}},
            {"RunningExtreme", {{"function", "min"}, {"reset", "level"}}},
            {"Lookup1D", {{"interpolation", "spline"}}},
            {"Lookup1D", {{"interpolation", "akima"}, {"extrapolation", "linear"}}},
            {"DirectLookup", {{"dimensions", 2}, {"outside", "error"}}},
            {"Bitwise", {{"operator", "NAND"}, {"inputs", 2}}},
            {"Bitwise", {{"operator", "NOR"}}},
            {"Bitwise", {{"operator", "NOT"}}},
            {"EdgeDetect", {{"edge", "change"}}},
            {"Delay", {{"reset", "either"}}},
            {"TappedDelay", {{"include_current", true}}},
            {"RateTransition", {{"mode", "delay"}}},
            {"DiscreteTransferFunction", {{"numerator", row({1, 2})}}},
            {"DiscreteStateSpace",
             {{"A", Matrix{{0.5, 0.2}, {0.0, -0.3}}},
              {"B", Matrix{{0.0}, {1.0}}},
              {"C", row({1, 1})},
              {"D", 0.5}}},
            {"DiscretePID", {{"reset", "level"}, {"tracking", true}, {"method", "backward"}}},
            {"DiscretePID2", {{"anti_windup", "clamping"}, {"filter_method", "trapezoidal"}}},
            {"TransferFunction", {{"numerator", row({1, 2})}}},
            {"PID", {{"reset", "falling"}, {"tracking", true}}},
            {"PID", {{"anti_windup", "clamping"}}},
            {"LimitedIntegrator",
             {{"reset", "either"},
              {"initial_source", "external"},
              {"saturation_port", true},
              {"state_port", true}}},
            {"TransportDelay", {{"delay_source", "external"}}},
            {"FirstOrderHold", {{"interval", 0.02}}},
            {"Convert", {{"type", "int16"}, {"rounding", "nearest"}}},
            {"Logic", {{"operator", "NOT"}}},
            {"Logic", {{"operator", "XOR"}, {"inputs", 1}}},
            {"Switch", {{"criterion", ">"}}},
            {"Switch", {{"criterion", "~="}}},
            {"StateMachine", {{"transitions", row({1, 1, 1, 0})}}},
            {"StateMachine", {{"chart", R"x({"inputs": ["u"], "events": ["go"], "parameters": ["T"],
                 "variables": {"n": 1, "m": 0}, "outputs": ["n"], "states": {
                 "a": {"exit": "n = 0.1*n + 1", "transitions": [{"to": "p", "after": "0.01 + abs(T)", "if": "u > 0.2"},
                                                         {"to": "j", "on": "go", "do": "raise own"}]},
                 "j": {"junction": true, "transitions": [{"to": "h", "if": "u < 0"}, {"to": "p"}]},
                 "p": {"regions": {
                     "b": {"states": {"c": {"during": "m = m + sin(n)", "transitions": [{"to": "d", "after": 0.02}]},
                                      "d": {"entry": "if u > 0; n = n/2; else; n = -n; end",
                                            "transitions": [{"to": "c", "every": 0.03}]}}},
                     "e": {"states": {"h": {"history": "deep", "to": "f"},
                                      "f": {"transitions": [{"to": "g", "on": "own"}]},
                                      "g": {"states": {"g1": {"transitions": [{"to": "g2", "if": "c"}]}, "g2": {}}}}}},
                     "transitions": [{"to": "a", "if": "u < -0.5"}]}}})x"}}},
            {"StateMachine",
             {{"chart", R"x({"run_to_completion": true, "events": ["go"], "variables": {"n": 0}, "states": {
                 "a": {"entry": "send late after 0.02", "transitions": [{"to": "b", "on": "go", "do": "raise own"}]},
                 "b": {"transitions": [{"to": "c", "on": "own"}]},
                 "c": {"exit": "n = n + 1", "transitions": [{"to": "a", "on": ["late", "go"]}]}}})x"}}},
            {"DiscreteIntegrator", {{"method", "backward"}, {"reset", "level"}}},
            {"DiscreteIntegrator", {{"method", "trapezoidal"}, {"initial_source", "external"}}},
            {"DiscreteIntegrator", {{"reset", "rising"}, {"initial_source", "external"}}},
        };
        for (const char* kind : {"final", "maximum", "minimum", "rms", "mean"})
            v.insert({"Check", {{"kind", kind}}});
        return v;
    }();
    return all;
}

} // namespace bf::conformance
