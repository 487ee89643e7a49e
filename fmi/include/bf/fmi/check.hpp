// What is wrong with an FMU, by the rules of the standards.
#pragma once

#include "bf/fmi/instance.hpp"

#include <functional>
#include <string>
#include <vector>

namespace bf::fmi {

/// What the description says against the standard, each with the variable and the section; nothing: empty.
std::vector<std::string> problems_of(const Description& description);

/// Lets an FMU run as one of its kinds: through all modes and some steps of `step` s, in several instances,
/// begun anew, and from saved states, which must all give the same. In model exchange these are steps of a
/// solver with events, too coarse for the numbers to mean much. `doing` is told what comes next, for whoever
/// waits. Gives what went wrong, empty: nothing.
std::vector<std::string> problems_of_run(const Library& library, double step,
                                         const std::function<void(const std::string&)>& doing);

} // namespace bf::fmi
