// What is wrong with an FMU, by the rules of the standards.
#pragma once

#include "bf/fmi/instance.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace bf::fmi {

/// What the description says against the standard, each with the variable and the section; nothing: empty.
std::vector<std::string> problems_of(const Description& description);

/// What is wrong in terminalsAndIcons of an FMU of FMI 3.0 that was extracted into `folder`, which is
/// optional: variables that there are not, names that are none or several, pictures that are missing
/// (FMI 3.0, section 2.4.9). `fmu` is what messages call it.
std::vector<std::string> problems_of_terminals(const std::filesystem::path& folder, const std::string& fmu,
                                               const Description& description);

/// Lets an FMU run as one of its kinds: through all modes and some steps of `step` s, in several instances,
/// begun anew, and from saved states, which must all give the same. In model exchange these are steps of a
/// solver with events, too coarse for the numbers to mean much. `doing` is told what comes next, for whoever
/// waits, and `function` (LocalInstance::longest_name) has the function that is being called. Gives what went
/// wrong, empty: nothing.
std::vector<std::string> problems_of_run(const Library& library, double step,
                                         const std::function<void(const std::string&)>& doing,
                                         char* function = nullptr);

} // namespace bf::fmi
