// One number of a diagram by its name.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <string>

namespace bf::analysis {

/// An element of a signal or state.
struct Element {
    Node::End end;
    int number = 0;   ///< from 0
    std::string name; ///< "controller.tau[l_knee]"
    std::string unit; ///< empty where any fits
};

/// "motor.omega", "controller.tau[3]", "controller.tau[l_knee]" or a state, "position.x". Throws RunError:
/// unknown names with the nearest one, several elements, no real numbers.
Element find_element(const Diagram& diagram, const std::string& name);

} // namespace bf::analysis
