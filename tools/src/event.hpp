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

/// An element of a signal as recordings call it, SIGNAL, SIGNAL[i], SIGNAL[name] or SIGNAL[row][column], from
/// 1; one of > >= < <= == ~=; a number. Throws CommandError.
Event parse_event(const Diagram& diagram, const std::string& text);

/// A signal of the diagram or of its root's inputs by its path; throws CommandError with the nearest names.
Node::End find_signal(const Diagram& diagram, const std::string& path);

/// Which element "x[2]", "s[l_knee]" or "M[1][2]" names, and the signal's path in front of it.
struct Element {
    std::string path;
    Node::End signal;
    int index = 0; ///< column by column, from 0
};
Element parse_element(const Diagram& diagram, const std::string& text);

} // namespace bf::tools
