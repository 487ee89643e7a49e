#include "bf/middleware/names.hpp"

namespace bf::middleware {

void check_name(NameRule rule, const std::string& argument, const std::string& name,
                std::vector<std::string>& problems) {
    if (const auto wrong = rule(name); !wrong.empty())
        problems.push_back("argument '" + argument + "': " + wrong);
}

void check_node(const NameRules& rules, const std::string& argument, const std::string& name,
                const std::string& name_space, const std::vector<std::string>& remap,
                std::vector<std::string>& problems) {
    check_name(rules.node, argument, name, problems);
    check_name(rules.name_space, "namespace", name_space, problems);
    for (const auto& rule : remap) check_name(rules.remapping, "remap", rule, problems);
}

} // namespace bf::middleware
