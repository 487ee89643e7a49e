#include "bf/fmi/instance.hpp"

#include <cctype>
#include <set>

namespace bf::fmi {

std::vector<std::string> block_names(const Description& d, Kind kind) {
    // Arguments of the blocks, and what model exchange has besides; what a model says of any block is no
    // parameter.
    std::set<std::string> taken{"fmu", "structure", "process", "timeout"};
    const std::set<std::string> said_of_blocks{"block", "doc", "period", "offset", "when"};
    if (kind == Kind::model_exchange) taken.insert({"states", "indicators", "event"});
    std::vector<std::string> names;
    for (const Variable& v : d.variables) {
        names.emplace_back();
        const bool is_quantity =
            has_values(v.type) && (v.causality == Causality::input || v.causality == Causality::output ||
                                   (v.causality == Causality::parameter && !v.start.empty()));
        if (!is_quantity) continue;
        std::string name;
        for (const char c : v.name) {
            const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || c == '_';
            if (is_plain)
                name += c;
            else if (!name.empty() && name.back() != '_')
                name += '_';
        }
        if (!v.name.ends_with('_'))
            while (!name.empty() && name.back() == '_') name.pop_back();
        if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front()))) name = "v" + name;
        names.back() = name;
        const auto is_free = [&](const std::string& its) {
            return !(v.causality == Causality::parameter && said_of_blocks.contains(its)) &&
                   taken.insert(its).second;
        };
        for (int i = 2; !is_free(names.back()); ++i) names.back() = name + "_" + std::to_string(i);
    }
    return names;
}

} // namespace bf::fmi
