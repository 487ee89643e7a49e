// Models whose generated code is compared with the engine.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"

#include <memory>
#include <vector>

namespace bf::codegen::test {

/// A model, elaborated, with the registry that its blocks come from.
struct Elaborated {
    std::unique_ptr<Registry> registry = std::make_unique<Registry>();
    Diagram diagram;

    explicit Elaborated(const model::Model& model) {
        registry->add(standard_library());
        registry->add_search_path(BF_TEST_PLUGINS);
        diagram = elaborate(model, *registry);
        // Everything that can be seen is recorded: outputs and states.
        diagram.record = diagram.signals();
        diagram.plots.clear();
        for (std::size_t n = 0; n < diagram.nodes.size(); ++n) {
            const auto& slots = diagram.nodes[n].block->resolution().slots;
            for (std::size_t s = 0; s < slots.size(); ++s)
                if (slots[s].role == Role::discrete_state || slots[s].role == Role::continuous_state)
                    diagram.record.push_back({diagram.nodes[n].path + "." + slots[s].name + " (state)",
                                              {static_cast<int>(n), static_cast<int>(s)}});
        }
    }
};

/// One model. Its diagram's name is an identifier of its own.
struct Case {
    Elaborated elaborated;
    int steps = 6;
    Options options = {};
};

/// Every standard block in all wirings that it accepts, one model per block and settings.
std::vector<Case> block_cases();
/// Rates, conditions, solvers, names, failures, long models.
std::vector<Case> structure_cases();
/// Subsystems that are triggered, reset, called or chosen; loops; zero crossings.
std::vector<Case> control_cases();
/// The models of examples/ that stand for themselves, those of adaptive solvers with a fixed step.
std::vector<Case> example_cases();
/// Models with a function per rate.
std::vector<Case> rate_cases();
/// Three rates with what can stand in each; also continuous states beside the fastest one.
Case three_rates();

inline Files c_files(const Case& one) {
    Options options = one.options;
    options.language = Language::c;
    return generate(one.elaborated.diagram, options);
}
/// Can it be plain C? Variants of other options cannot.
inline bool is_c_case(const Case& one) {
    if (one.options.has_runtime_sizes || one.options.embedded) return false;
    try {
        c_files(one);
        return true;
    } catch (const GenerationError&) {
        return false;
    }
}

/// A block for each function that formulas know, of one or two inputs in (0, 1), or from 1 on where it needs
/// that.
std::string functions_model();

/// All that one program of models writes.
std::vector<std::vector<Case> (*)()> families();

} // namespace bf::codegen::test
