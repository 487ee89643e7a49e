// How small changes go through the blocks of a diagram, at the values that its context holds.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"
#include "dual_kernels.hpp"

#include <functional>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace bf::analysis {

/// Each element of each signal and state has a row: its derivatives by the seeds. A pass goes through the
/// blocks in their order, as a step does; rows of what does not run in it stay as they are.
class Differential {
  public:
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

    Differential(Simulation& run, int seeds, bool by_differences);

    /// The rows of a signal or state; of an input those of what it reads.
    Eigen::Block<Rows> rows(const Node::End& end);
    Eigen::Block<Rows> computed(const Node::End& signal); ///< before what `at` does to it
    Eigen::Block<Rows> next(const Node::End& state);      ///< of a discrete state, after `update`
    Eigen::Block<Rows> rate(const Node::End& state);      ///< of a continuous state, after `derivatives`

    /// What is done to a signal as soon as it is computed, for those who read it over a wire: adding an
    /// input, cutting. The rows have columns of the unknowns of algebraic loops behind the seeds. A block
    /// that goes on from its own output goes on from what it computed.
    void at(const Node::End& signal, std::function<void(Eigen::Block<Rows>)> change);

    int seeds() const { return seeds_; }

    using Runs = std::function<bool(int node)>; ///< does it run in this pass?
    void outputs(const Runs& runs);
    void updates(const Runs& runs);
    void derivatives(const Runs& runs);

    /// Node and slot of signals whose rows are not zero, and the nodes that read them, in the passes so far.
    const std::set<std::tuple<int, int, int>>& flows() const { return flows_; }
    const std::set<int>& differenced() const { return differenced_; }
    /// Nodes that were found at a jump or corner.
    const std::set<int>& kinks() const { return kinks_; }
    bool is_active(int condition) const;

  private:
    struct Place {
        int first = -1, next = -1, rate = -1, count = 0;
        int own = -1;         ///< as the block computed it: `first`, unless something is done to the signal
        bool is_real = false; ///< numbers that change by little
    };
    /// Something that an activity reads or writes: its rows and its memory.
    struct Part {
        int row;
        void* data;
        Type type;
        int count;
    };
    const Place& place(const Node::End& end) const;
    Node::End origin(const Node::End& end) const;
    int row_read(int node, int slot) const; ///< by the block itself
    bool is_zero(int row, int count) const;
    void run(const Segment& segment, Phase phase, const Runs& runs);
    void run(const Activity& activity, Phase phase, const Runs& runs);
    void change(int node, int slot);
    void solve(const Loop& loop, const Runs& runs);
    void iterate(const Loop& loop);
    bool is_written(int node, Phase phase, const Call::Reference& operand) const;
    void activity(int node, Phase phase, int index);
    void rule(int node, Phase phase, const Call& call, const NamedKernel<Dual>& kernel);
    void by_differences(int node, Phase phase, int index);
    template <class Evaluate>
    void bend(int node, const Vector& direction, double step, double precision, const Vector& here,
              const Vector& above, const Vector& below, Evaluate&& evaluate, Vector& slopes);
    void write(int node, const std::vector<Part>& from, const std::vector<Part>& to,
               const std::function<void(const Vector& direction, Vector& slopes)>& differentiate);
    std::vector<Part> reads(int node, Phase phase, int index) const;
    std::vector<Part> writes(int node, Phase phase, int index) const;
    const Task& task(int node, Phase phase, int index);
    const Call* call(int node, Phase phase, int index) const;
    [[noreturn]] void fail(int node, const std::string& why) const;

    const Diagram& d_;
    Context& context_;
    bool by_differences_;
    int seeds_;
    Rows rows_; ///< columns: seeds, then unknowns of algebraic loops
    std::vector<std::vector<Place>> places_;
    std::vector<int> first_unknown_; ///< column, by loop
    std::map<std::pair<int, int>, std::function<void(Eigen::Block<Rows>)>> changes_;
    std::set<std::tuple<int, int, int>> flows_;
    std::set<int> differenced_, kinks_;
    std::set<int> devices_;
    std::map<std::tuple<int, Phase, int>, Task> tasks_;
};

} // namespace bf::analysis
