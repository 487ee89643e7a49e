// The block that the claims of this folder are about.
#pragma once

#include "bf/core/block.hpp"
#include "bf/core/rule.hpp"
#include "bf/kernels/elementwise.hpp"

struct Base : bf::Block {
    bf::Input<bf::Vector> u{this, "u", {.shape = {3}}};
    bf::Output<bf::Vector> y{this, "y", {.shape = {3}}};
    bf::Parameter<double> k{this, "k"};
    bf::DiscreteState<bf::Vector> x{this, "x", {.shape = {3}}};
    bf::ContinuousState<bf::Vector> s{this, "s", {.shape = {3}}};
    bf::Input<> any{this, "any"};
    bf::Guard guard{this, "guard"};
};
