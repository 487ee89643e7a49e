#include "values.hpp"

namespace bf::service {

Values values_of_variables(const Tuning& tuning) {
    Values all;
    for (auto& variable : tuning.variables()) all[variable.path] = std::move(variable.values);
    return all;
}

Values values_of_parameters(const Diagram& diagram) {
    Values all;
    for (const auto& node : diagram.nodes) {
        const auto& declared = node.block->declaration().slots;
        for (std::size_t s = 0; s < declared.size(); ++s)
            if (declared[s].role == Role::parameter)
                all[node.path + "." + declared[s].name] = node.block->resolution().slots[s].initial;
    }
    return all;
}

} // namespace bf::service
