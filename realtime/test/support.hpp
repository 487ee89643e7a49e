// A model in text, elaborated and ready to run.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <string>

namespace bf::realtime {

struct Loaded {
    explicit Loaded(const std::string& text, const Library* more = nullptr) {
        registry.add(standard_library());
        if (more) registry.add(*more);
        diagram = elaborate(formats::read_yaml_text(text, "m.yaml"), registry);
    }
    Registry registry;
    Diagram diagram;
};

} // namespace bf::realtime
