// Models as text, elaborated with the standard blocks.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"

#include <string>
#include <vector>

namespace bf::test {

using Overrides = std::vector<ElaborateOptions::Override>;

/// A diagram with the registry whose code it uses.
struct Elaborated {
    std::unique_ptr<Registry> registry;
    Diagram diagram;

    const DiagramNode& node(const std::string& path) const {
        const int n = diagram.find_node(path);
        if (n < 0) throw std::runtime_error("no block " + path);
        return diagram.nodes[static_cast<std::size_t>(n)];
    }
    const Slot& slot(const std::string& path, const std::string& name) const {
        const Resolution& r = node(path).block->resolution();
        const int i = r.find(name);
        if (i < 0) throw std::runtime_error("no quantity " + path + "." + name);
        return r.slots[static_cast<std::size_t>(i)];
    }
    std::string size(const std::string& path, const std::string& name = "y") const {
        return slot(path, name).size.text();
    }
    const char* type(const std::string& path, const std::string& name = "y") const {
        return bf::name(slot(path, name).type);
    }
    SampleRate rate(const std::string& path) const {
        return diagram.rates[static_cast<std::size_t>(node(path).rate)];
    }
    /// Paths of the blocks in the order in which their outputs are computed; one per activity.
    std::vector<std::string> order() const {
        std::vector<std::string> paths;
        for (const auto& segment : diagram.plan.outputs)
            for (const auto& a : segment.activities)
                paths.push_back(a.node >= 0
                                    ? diagram.nodes[static_cast<std::size_t>(a.node)].path
                                    : "?" + diagram.conditions[static_cast<std::size_t>(a.condition)].path);
        return paths;
    }
};

inline Elaborated elaborate_model(const model::Model& model, const Overrides& overrides = {},
                                  const Library* more = nullptr) {
    Elaborated result{std::make_unique<Registry>(), {}};
    result.registry->add(standard_library());
    if (more) result.registry->add(*more);
    result.diagram = elaborate(model, *result.registry, {overrides, {}});
    return result;
}

inline Elaborated elaborate_text(const std::string& text, const Overrides& overrides = {},
                                 const Library* more = nullptr) {
    return elaborate_model(formats::read_yaml_text(text, "m.yaml"), overrides, more);
}

/// What elaboration says about a wrong model; empty when it accepts it.
inline std::string errors_of(const std::string& text, const Overrides& overrides = {},
                             const Library* more = nullptr) {
    try {
        elaborate_text(text, overrides, more);
    } catch (const model::Errors& errors) {
        return errors.what();
    }
    return {};
}

} // namespace bf::test
