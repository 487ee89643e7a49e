// Names of topics, services and nodes, by the rules of the middleware that has them.
#pragma once

#include <string>
#include <vector>

namespace bf::middleware {

/// What is wrong with a name; empty: nothing.
using NameRule = std::string (*)(const std::string& name);

/// The rules of a middleware.
struct NameRules {
    NameRule topic; ///< of topics, services and actions, absolute or in a namespace
    NameRule name_space, node;
    NameRule remapping; ///< from:=to
};

/// `problems` gets what is wrong with the name that an argument has.
void check_name(NameRule rule, const std::string& argument, const std::string& name,
                std::vector<std::string>& problems);
/// The same of what a node is given; `argument` is the one that has its name.
void check_node(const NameRules& rules, const std::string& argument, const std::string& name,
                const std::string& name_space, const std::vector<std::string>& remap,
                std::vector<std::string>& problems);

} // namespace bf::middleware
