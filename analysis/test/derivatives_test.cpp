// The exact derivatives of every standard block, beside central differences of it.
#include "bf/analysis/linearize.hpp"

#include "../../codegen/test/cases.hpp"
#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <set>

namespace bf::analysis::test {

TEST(Derivatives, OfEveryStandardBlockAreThoseOfCentralDifferences) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(0.1, 0.9);
    int compared = 0;
    std::set<std::string> exact;
    for (const auto& [elaborated, steps, unused] : codegen::test::block_cases()) {
        const Diagram& d = elaborated.diagram;
        LinearizeOptions options{.all_states = true};
        for (const auto& input : d.inputs)
            if (d.slot(input.end).type == Type::float64) options.from.push_back(input.path);
        for (const auto& node : d.nodes)
            for (const auto& slot : node.block->resolution().slots)
                if (slot.role == Role::output && slot.type == Type::float64 && slot.size.count() > 0 &&
                    !node.block->declaration().traits.is_root_input)
                    options.to.push_back(node.path + "." + slot.name);
        if (options.from.empty() || options.to.empty()) continue;
        // Its states are whole numbers, though of real type.
        if (std::any_of(d.nodes.begin(), d.nodes.end(),
                        [](const auto& node) { return node.type == "StateMachine"; }))
            continue;
        const auto found = [&](bool by_differences) -> std::optional<LinearSystem> {
            random.seed(7);
            Simulation run(d);
            run.start();
            options.by_differences = by_differences;
            try {
                for (int k = 0; k < 4; ++k) {
                    for (const auto& input : run.inputs())
                        for (std::size_t i = 0; i < input.info.elements(); ++i)
                            write_values(input.data + i * static_cast<std::size_t>(bytes(input.type)),
                                         input.type, 1, {number(random)});
                    if (k < 3 && !run.step()) return {};
                }
                return linearize(run, options);
            } catch (const RunError&) {
                return {};
            }
        };
        const auto a = found(false), b = found(true);
        if (!a || !b || a->A.rows() != b->A.rows()) continue;
        const auto expect_near = [&](const Matrix& x, const Matrix& y, const char* which) {
            if (x.size() == 0) return;
            const double scale = 1 + y.cwiseAbs().maxCoeff();
            // Single precision is differenced roughly, and so is what is nearly singular.
            EXPECT_LT((x - y).cwiseAbs().maxCoeff(), (scale > 1e5 ? 1 : 1e-5) * scale)
                << d.nodes.front().type << " of " << d.name << ": " << which << "\n"
                << (x - y).cwiseAbs().maxCoeff() / scale;
        };
        expect_near(a->A, b->A, "A");
        expect_near(a->B, b->B, "B");
        expect_near(a->C, b->C, "C");
        expect_near(a->D, b->D, "D");
        ++compared;
        if (a->differenced.empty())
            for (const auto& node : d.nodes) exact.insert(node.type);
    }
    EXPECT_GT(compared, 150);
    // Most blocks have exact ones; those that have not are named in the reference of linearize.
    EXPECT_GT(exact.size(), 105u);
}

TEST(Derivatives, OfAnInputBehindAnyStandardBlockDoNotEnterItsOwnStates) {
    int compared = 0;
    for (const auto& [elaborated, steps, unused] : codegen::test::block_cases()) {
        const Diagram& d = elaborated.diagram;
        Simulation run(d);
        run.start();
        for (const auto& input : run.inputs())
            for (std::size_t i = 0; i < input.info.elements(); ++i)
                write_values(input.data + i * static_cast<std::size_t>(bytes(input.type)), input.type, 1,
                             {0.3 + 0.05 * static_cast<double>(i)});
        for (const auto& node : d.nodes)
            for (const auto& slot : node.block->resolution().slots) {
                if (slot.role != Role::output || slot.type != Type::float64 || slot.size.count() == 0 ||
                    node.block->declaration().traits.is_root_input)
                    continue;
                const std::string signal = node.path + "." + slot.name;
                for (const bool is_cut : {false, true}) {
                    LinearizeOptions options{.from = {signal}, .to = {signal}, .all_states = true};
                    if (is_cut) options.open = {signal};
                    LinearSystem system;
                    try {
                        system = linearize(run, options);
                    } catch (const RunError&) {
                        continue;
                    }
                    const auto n = slot.size.count();
                    const Matrix through = Matrix::Identity(n, n) * (is_cut ? 0 : 1);
                    EXPECT_EQ(system.D, through) << node.type << (is_cut ? ", cut" : "");
                    for (std::size_t i = 0; i < system.states.size(); ++i) {
                        if (!system.states[i].starts_with(node.path + ".")) continue;
                        EXPECT_TRUE((system.B.row(static_cast<Eigen::Index>(i)).array() == 0).all())
                            << node.type << " of " << d.name << ": " << system.states[i]
                            << (is_cut ? ", cut" : "");
                    }
                    ++compared;
                }
            }
    }
    EXPECT_GT(compared, 300);
}

namespace {

/// y = x and x⁺ = 0.8 y + sin u by methods, of which the second reads an output and an input.
struct Lag final : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    DiscreteState<double> x{this, "x"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[x];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = 0.8 * at[y] + std::sin(at[u]);
        return ok;
    }
};

} // namespace

TEST(Derivatives, OfAMethodThatUpdatesGoThroughTheInputsAndOutputsThatItReads) {
    Library library("");
    library.group("test").add<Lag>("Lag", "");
    const bf::test::Session session(
        "model: m\nstep: 0.1\ninputs: [u]\noutputs: [y]\nblocks:\n  lag: {block: Lag}\n"
        "connections: {u: lag, lag: y}\n",
        &library);
    Simulation run(session.diagram);
    run.start();
    *reinterpret_cast<double*>(run.inputs()[0].data) = 0.5;
    const auto found = linearize(run, {});
    EXPECT_NEAR(found.A(0, 0), 0.8, 1e-9);
    EXPECT_NEAR(found.B(0, 0), std::cos(0.5), 1e-9);
    EXPECT_NEAR(found.C(0, 0), 1, 1e-9);
    EXPECT_NEAR(found.D(0, 0), 0, 1e-9);
}

} // namespace bf::analysis::test
