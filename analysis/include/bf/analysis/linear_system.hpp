// Linear systems with names: what linearising gives, and what is computed of it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace bf::analysis {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// x' = A x + B u, y = C x + D u in continuous time (period 0), x⁺ = A x + B u, y = C x + D u from sample to
/// sample otherwise: deviations from the operating point at which it was found.
struct LinearSystem {
    Matrix A, B, C, D;
    std::vector<std::string> states, inputs, outputs; ///< "plant.x[2]", one per row or column
    std::vector<std::string> input_units, output_units;
    double period = 0; ///< s; 0: continuous time
    Vector x, u, y;    ///< the operating point
    double time = 0;   ///< of the operating point [s]
    /// Blocks of which no exact derivative is known: their part was found by central differences.
    std::vector<std::string> differenced;
    /// What was held although it may move: "world: its state lives outside of the diagram".
    std::vector<std::string> held;
    /// Blocks that jump or have a corner right here: the derivative is that of one side.
    std::vector<std::string> kinks;
    /// Of a loop that is cut, where the cut holds what is no longer held without it: is the model stable
    /// uncut? That does not follow from these matrices then.
    std::optional<bool> is_stable_uncut;
};

} // namespace bf::analysis
