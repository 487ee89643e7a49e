// Models whose text in C is looked at.
#pragma once

#include "cases.hpp"

#include "bf/formats/yaml.hpp"

#include <string>

namespace bf::codegen::test {

inline Files in_c(const std::string& model) {
    const Elaborated elaborated(formats::read_yaml_text(model, "m.yaml"));
    return generate(elaborated.diagram, {.language = Language::c});
}

inline const char* const motor = R"m(model: m
step: 0.1
inputs: {u: {}, v: {shape: [12]}, on: {type: boolean}, n: {type: int8}}
blocks:
  difference: {block: Sum, signs: "+-"}
  wave: {block: Sine}
  limited: {block: Saturate, lower: -1, upper: 1}
  spread: {block: Gain, K: 2}
  sum: {block: DiscreteIntegrator}
  either: {block: Switch, criterion: "~="}
  twice: {block: Gain, K: 2}
  ratio: {block: Product, operations: "*/"}
  rest: {block: Mod}
  size: {block: Abs}
  opposite: {block: Sum, signs: "--"}
connections: {u: [difference.u1, limited, either.u1], wave: [difference.u2, either.u3], difference: sum, v: spread, on: either.u2, n: [twice, ratio.u1, rest.u1, size, opposite.u1], twice: [ratio.u2, rest.u2, opposite.u2]}
)m";

} // namespace bf::codegen::test
