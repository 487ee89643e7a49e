// What an exported FMU builds on that computes its signals again and again.
#include "cases.hpp"

#include "bf/engine/simulation.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <optional>

namespace bf::codegen::test {

TEST(BlockCases, PutOutTheSameWhateverStoodThereBefore) {
    int compared = 0;
    for (const auto& one : block_cases()) {
        const Diagram& diagram = one.elaborated.diagram;
        SCOPED_TRACE(diagram.name);
        Simulation run(diagram);
        run.start();
        if (!run.step()) continue;
        std::vector<std::byte> here;
        try {
            here = run.snapshot();
        } catch (const RunError&) {
            continue;
        }
        std::vector<Node::End> outputs; // of all that is computed in each step
        for (int n = 0; n < static_cast<int>(diagram.nodes.size()); ++n) {
            const auto& node = diagram.nodes[static_cast<std::size_t>(n)];
            const auto& rate = diagram.rates[static_cast<std::size_t>(node.rate)];
            const bool is_computed = !node.block->declaration().traits.is_root_input && !rate.is_constant &&
                                     rate.trigger == 0 && rate.ticks == 1 && rate.offset == 0 &&
                                     node.condition == 0;
            const auto& slots = node.block->resolution().slots;
            for (int s = 0; is_computed && s < static_cast<int>(slots.size()); ++s)
                if (slots[static_cast<std::size_t>(s)].role == Role::output) outputs.push_back({n, s});
        }
        const auto step_from = [&](double before) -> std::optional<std::vector<double>> {
            run.restore(here);
            for (const auto& end : outputs)
                write_values(run.context().data(end.node, end.slot), diagram.slot(end).type,
                             diagram.slot(end).size.count(), {before});
            if (!run.step()) return std::nullopt;
            std::vector<double> values;
            for (const auto& end : outputs)
                for (int e = 0; e < diagram.slot(end).size.count(); ++e)
                    values.push_back(
                        read_value(run.context().data(end.node, end.slot), diagram.slot(end).type, e));
            return values;
        };
        const auto zeros = step_from(0), ones = step_from(1);
        ASSERT_EQ(zeros.has_value(), ones.has_value());
        if (!zeros || zeros->empty()) continue;
        EXPECT_EQ(std::memcmp(zeros->data(), ones->data(), zeros->size() * sizeof(double)), 0);
        ++compared;
    }
    EXPECT_GT(compared, 200);
}

} // namespace bf::codegen::test
