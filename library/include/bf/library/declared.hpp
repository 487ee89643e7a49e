// What a class of blocks declares, as texts for people: terminal, JSON and reference pages.
#pragma once

#include "bf/core/registry.hpp"

#include <string>
#include <vector>

namespace bf {

struct DeclaredArgument {
    std::string name, type, initial, doc;
    std::vector<std::string> choices; ///< empty: any
    Limits limits;
};

/// A port, parameter or state.
struct DeclaredQuantity {
    Role role;
    std::string name, size, type, unit, doc;
    std::string initial; ///< default of a parameter or an optional input, first value of a state; else empty
    std::string condition; ///< the argument that brings it, e.g. "use_lb: true"; empty: always there
    Limits limits;         ///< of a parameter
    std::string at_least;  ///< the parameter that no element of this one is below; empty: none
};

struct Declared {
    std::string library, name, qualified_name, group, doc;
    std::vector<DeclaredArgument> arguments;
    std::vector<DeclaredQuantity> quantities; ///< without workspace and guards
    struct Resource {
        std::string type, doc;
    };
    std::vector<Resource> needs, provides;
};

/// Makes blocks of the class, with default arguments and with others, to see what each argument brings.
Declared declared(const BlockClass& type);

/// What the text says up to its first full stop, without that.
std::string first_sentence(const std::string& doc);

/// What a value means and what it may be: "of the lag; greater than 0", "largest y; at least lower".
std::string with_limits(const std::string& doc, const Limits& limits, const std::string& at_least = {});

/// The roles that people see, in the order in which they are shown, and their headings.
inline constexpr std::pair<Role, const char*> shown_roles[] = {{Role::input, "inputs"},
                                                               {Role::output, "outputs"},
                                                               {Role::parameter, "parameters"},
                                                               {Role::discrete_state, "discrete states"},
                                                               {Role::continuous_state, "continuous states"}};

} // namespace bf
