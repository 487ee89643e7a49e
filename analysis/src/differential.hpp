// How small changes go through the blocks of a diagram, at the values that its context holds.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"
#include "dual_kernels.hpp"
#include "formulas.hpp"

#include <functional>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace bf::analysis {

/// Does it change by little?
inline bool is_real(Type type) { return type == Type::float64 || type == Type::float32; }
inline void write_real(void* data, Type type, int i, double value) {
    if (type == Type::float64)
        static_cast<double*>(data)[i] = value;
    else
        static_cast<float*>(data)[i] = static_cast<float>(value);
}

/// Each signal and state has its slopes. A pass goes through the blocks in their order, as a step does;
/// slopes of what does not run in it stay as they are.
class Differential {
  public:
    Differential(Simulation& run, int seeds, bool by_differences);
    /// Nothing moves yet, at another point: as it was made, with what was said by `at` and `follow`.
    void begin();

    /// The derivatives of a signal or state by all seeds; of an input those of what it reads.
    Matrix rows(const Node::End& end) const;
    Matrix computed(const Node::End& signal) const; ///< before what `at` does to it
    Matrix next(const Node::End& state) const;      ///< of a discrete state, after `update`
    Matrix rate(const Node::End& state) const;      ///< of a continuous state, after `derivatives`
    void set(const Node::End& end, const Matrix& rows);
    /// A parameter moves, by what is `set`.
    void follow(const Node::End& parameter);
    /// States outside of the diagram move where the block that owns them is Differenced.
    void follow_outside();
    const Slopes& own(const Node::End& signal) const { return slopes(place(signal).own); } ///< `computed`

    /// What is done to a signal as soon as it is computed, for those who read it over a wire: adding an
    /// input, cutting. The rows have columns of the unknowns of algebraic loops behind the seeds. A block
    /// that goes on from its own output goes on from what it computed.
    void at(const Node::End& signal, std::function<void(Matrix&)> change);

    int seeds() const { return seeds_; }

    using Runs = std::function<bool(int node)>; ///< does it run in this pass?
    void constants();                           ///< what is computed once, from parameters
    void outputs(const Runs& runs);
    void updates(const Runs& runs);
    void derivatives(const Runs& runs);
    void commit(); ///< discrete states are the next ones

    /// Node and slot of signals whose slopes are not zero, and the nodes that read them, in the passes so
    /// far.
    const std::vector<std::tuple<int, int, int>>& flows() const { return flows_; }
    const std::set<int>& differenced() const { return differenced_; }
    /// Nodes that were found at a jump or corner.
    const std::set<int>& kinks() const { return kinks_; }
    bool is_active(int condition) const;

  private:
    struct Place {
        int first = -1, next = -1, rate = -1; ///< among all slopes
        int own = -1;         ///< as the block computed it: `first`, unless something is done to the signal
        int count = 0;        ///< of elements
        bool is_real = false; ///< numbers that change by little
    };
    /// Something that an activity reads or writes: its slopes and its memory.
    struct Part {
        int slopes;
        void* data;
        Type type;
        int count;
    };
    const Place& place(const Node::End& end) const;
    int read_by(int node, int slot) const; ///< the slopes that the block itself reads
    Slopes& slopes(int i) { return slopes_[static_cast<std::size_t>(i)]; }
    const Slopes& slopes(int i) const { return slopes_[static_cast<std::size_t>(i)]; }
    Matrix seeded(int i, int elements) const { return slopes(i).spread(elements, seeds_); }
    int columns() const { return seeds_ + unknowns_; }
    void run(const Segment& segment, Phase phase, const Runs& runs);
    void run(const Activity& activity, Phase phase, const Runs& runs);
    void change(int node, int slot);
    void solve(const Loop& loop, const Runs& runs);
    void iterate(const Loop& loop, const Runs& runs);
    void activity(int node, Phase phase, int index);
    void rule(int node, Phase phase, const Call& call, const DualKernel& kernel);
    bool declared(int node, Phase phase, int index, const std::vector<Part>& from);
    void by_differences(int node, Phase phase, int index, const std::vector<Part>& from);
    void with_outside(int node, Phase phase, int index);
    template <class Evaluate>
    void bend(int node, const Vector& direction, double step, double precision, const Vector& here,
              const Vector& above, const Vector& below, Evaluate&& evaluate, Vector& slopes);
    void rows(const std::vector<Part>& from, std::vector<SlopeRow>& all) const;
    using Differentiate = std::function<bool(const Matrix& directions, Matrix& slopes)>;
    using Structured =
        std::function<bool(const std::vector<SlopeRow>& elements, std::vector<Slopes>& results)>;
    bool write(int node, const std::vector<Part>& from, const std::vector<Part>& to,
               const Differentiate& differentiate, const Structured& structured = {});
    std::vector<Part> reads(int node, Phase phase, int index) const;
    std::vector<Part> writes(int node, Phase phase, int index) const;
    const Task& task(int node, Phase phase, int index);
    const Call* call(int node, Phase phase, int index) const;
    [[noreturn]] void fail(int node, const std::string& why) const;

    const Diagram& d_;
    Context& context_;
    bool by_differences_;
    int seeds_, unknowns_ = 0;
    std::vector<Slopes> slopes_; ///< columns: seeds, then unknowns of algebraic loops
    std::vector<std::vector<Place>> places_;
    std::vector<std::vector<Node::End>> origins_; ///< of each slot, see `origin`
    std::vector<int> first_unknown_;              ///< column, by loop
    std::map<std::pair<int, int>, std::function<void(Matrix&)>> changes_;
    std::vector<std::tuple<int, int, int>> flows_; ///< some of them more than once
    std::set<int> differenced_, kinks_;
    std::set<int> devices_;
    std::set<int> followed_;      ///< nodes of parameters that move
    std::set<int> owners_;        ///< nodes that are Differenced
    std::set<int> moves_outside_; ///< these, and nodes that use what they provide
    Slopes outside_;              ///< of all numbers of states outside
    std::map<std::tuple<int, Phase, int>, Task> tasks_;
    std::map<std::string_view, DualKernel> kernels_;
    std::vector<Dual> numbers_; ///< of the operands of a rule, as the next ones
    std::vector<kernels::View<Dual>> views_, list_;
    std::vector<SlopeRow> elements_; ///< that an activity reads, as the next ones
    std::vector<Slopes> made_;       ///< by it
    LocalJacobian local_;            ///< of a rule, as the next one
};

} // namespace bf::analysis
