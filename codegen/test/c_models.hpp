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

/// What calls functions that are more than arithmetic.
inline const char* const calling = R"m(model: library
step: 0.1
inputs: {u: {}, n: {type: int16}}
blocks:
  table: {block: Lookup2D, breakpoints1: [0, 1, 3], breakpoints2: [0, 2], table: [1, 2; 3, 4; 5, 7]}
  noise: {block: WhiteNoise}
  uniform: {block: RandomUniform}
  whole: {block: Convert, type: int8, rounding: nearest, on_overflow: saturate}
  wrapped: {block: Convert, type: uint8, rounding: convergent, on_overflow: wrap}
  checked: {block: Convert, type: int8, on_overflow: error}
  real_of: {block: Convert, type: double, on_overflow: error}
  truth_of: {block: Convert, type: boolean, on_overflow: error}
  same_of: {block: Convert, type: int16, on_overflow: error}
  bits: {block: Bitwise, operator: NAND}
  down: {block: ShiftBits, places: -3}
  spline: {block: Lookup1D, breakpoints: [0, 1, 3], table: [1, 2, 5], interpolation: spline}
  akima: {block: Lookup1D, breakpoints: [0, 1, 3], table: [1, 2, 5], interpolation: akima}
  past: {block: TransportDelay, delay: 0.25, buffer: 8}
  sum: {block: Sum, signs: "+-", on_overflow: error}
  product: {block: Product, operations: "*/", on_overflow: saturate}
  real: {block: Gain, K: 2, on_overflow: error}
  A: {block: Constant, value: [2, 1; 1, 3]}
  b: {block: Constant, value: [1, 2]}
  inverse: {block: MatrixInverse}
  damped: {block: PseudoInverse, method: damped}
  truncated: {block: PseudoInverse, method: truncated}
  lu: {block: LinearSolve}
  cholesky: {block: LinearSolve, method: cholesky}
  right: {block: LinearSolve, side: right}
  least: {block: LinearSolve, method: least_squares}
connections:
  u: [table.u1, table.u2, whole, wrapped, checked, spline, akima, past, real]
  n: [real_of, truth_of, same_of, bits, down, sum.u1, product.u1, product.u2]
  down: sum.u2
  A: [inverse, damped, truncated, lu.A, cholesky.A, right.A, right.b, least.A]
  b: [lu.b, cholesky.b, least.b]
)m";

} // namespace bf::codegen::test
