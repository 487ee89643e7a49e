// Events that end a run: 'controller.x > 0.3'.
#pragma once

#include "bf/engine/simulation.hpp"

#include <functional>
#include <string>

namespace bf::tools {

/// A comparison of one element of a signal with a number.
struct Event {
    std::string text;
    Node::End signal;
    int element = 0; ///< column-major
    std::function<bool(double)> holds;

    bool operator()(const Simulation& simulation) const;
};

/// SIGNAL, SIGNAL[i] or SIGNAL[row][column], all from 0 as in recordings; one of > >= < <= == ~=; a number.
/// Throws CommandError.
Event parse_event(const Diagram& diagram, const std::string& text);

/// A signal of the diagram or of its root's inputs by its path; throws CommandError with the nearest names.
Node::End find_signal(const Diagram& diagram, const std::string& path);

/// Which element "x[2]" or "M[0][1]" names, and the signal's path in front of it.
struct Element {
    std::string path;
    Node::End signal;
    int index = 0;
};
Element parse_element(const Diagram& diagram, const std::string& text);

} // namespace bf::tools
