// What is seen of models that adaptive solvers run.
#pragma once

#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {

/// Time and a signal whenever observers are called.
class Log final : public Simulation::Observer {
  public:
    Log(Session& session, const std::string& path) : end_(session.diagram.find_signal(path)) {
        session.simulation->add_observer(*this);
    }
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const Simulation&>(run);
        times.push_back(simulation.time());
        values.push_back(*static_cast<const double*>(simulation.context().data(end_.node, end_.slot)));
    }
    /// When the value jumped: the last of equal times.
    std::vector<double> jumps() const {
        std::vector<double> found;
        for (std::size_t k = 1; k < values.size(); ++k)
            if (values[k] != values[k - 1]) found.push_back(times[k]);
        return found;
    }
    std::vector<double> times, values;

  private:
    Node::End end_;
};

inline constexpr const char* adaptive_solvers[] = {"dormand_prince45", "cvode_bdf", "cvode_adams"};

/// Runs a model of that step and stop and these blocks with each adaptive solver, and expects what x is in
/// the end.
inline void expect_last(const std::string& x, double expected, double error, int steps,
                        const std::string& timing, const std::string& blocks) {
    for (const std::string solver : adaptive_solvers) {
        Session run("model: m\n" + timing + "solver: " + solver + "\nblocks:\n" + blocks);
        Log log(run, x);
        run.trace(x, steps);
        EXPECT_NEAR(log.values.back(), expected, error) << solver;
    }
}

} // namespace bf::test
