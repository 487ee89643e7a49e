// How small changes go through the blocks of a diagram, at the values that its context holds.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/core/changes.hpp"
#include "bf/engine/simulation.hpp"
#include "dual_kernels.hpp"
#include "formulas.hpp"

#include <array>
#include <functional>
#include <map>
#include <memory>
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
        int slopes, slot;
        void* data;
        Type type;
        int count;
    };
    /// A signal that a node reads over a wire, and its slopes.
    struct Wire {
        Node::End source;
        int slopes;
    };
    /// What a rule works on.
    struct Operand {
        Size size;
        Type type = Type::float64;
        const void* data = nullptr;
        std::size_t same = 0;                    ///< as which it is one memory
        std::size_t first = 0;                   ///< of its numbers among those of all operands
        int slopes = -1;                         ///< that it reads, if they move
        bool is_read = false, is_result = false; ///< its values; of which slopes are wanted
        bool decides = false;                    ///< which elements are moved where
        int from = -1; ///< first of its elements among all that move; -1: it does not
        std::size_t count() const { return static_cast<std::size_t>(size.count()); }
    };
    /// Which elements the results of a rule that moves them are, and what that depends on.
    struct Moved {
        std::vector<int> from;           ///< of the operands
        std::vector<std::byte> deciding; ///< values of operands of which no result is an element
        std::vector<int> elements;       ///< by result; -1: it is constant
        bool is_at_corner = false;
    };
    /// An activity, and what is the same at all points.
    struct Plan {
        int node = -1, index = 0;
        Phase phase = Phase::output;
        const Call* rule = nullptr;
        DualKernel kernel;
        const Differentiable* declares = nullptr;
        bool has_more = false; ///< rules beside it
        std::vector<Part> reads, writes;
        std::vector<Wire> wires;
        std::vector<Operand> operands;
        std::size_t numbers = 0; ///< of all operands
        Moved moved;
    };
    const Place& place(const Node::End& end) const;
    int read_by(int node, int slot) const; ///< the slopes that the block itself reads
    Slopes& slopes(int i) { return slopes_[static_cast<std::size_t>(i)]; }
    const Slopes& slopes(int i) const { return slopes_[static_cast<std::size_t>(i)]; }
    Matrix seeded(int i, int elements) const { return slopes(i).spread(elements, seeds_); }
    int columns() const { return seeds_ + unknowns_; }
    void tidy();
    void run(const Segment& segment, Phase phase, const Runs& runs);
    void run(const Activity& activity, Phase phase, const Runs& runs);
    void change(int node, int slot);
    void solve(const Loop& loop, const Runs& runs);
    void iterate(const Loop& loop, const Runs& runs);
    Plan& plan(int node, Phase phase, int index);
    std::vector<Part> reads(const Plan& plan) const;
    std::vector<Part> writes(const Plan& plan) const;
    void plan_rule(Plan& plan) const;
    void activity(Plan& plan);
    void rule(Plan& plan);
    void move(Plan& plan);
    bool is_moved_as_before(const Plan& plan) const;
    bool elementwise(const Plan& plan);
    bool formula(const Plan& plan);
    Dual* numbers(const Plan& plan, const Operand& operand) {
        return numbers_.data() + plan.operands[operand.same].first;
    }
    void set_numbers(const Plan& plan);
    void run_kernel(const Plan& plan);
    bool declared(const Plan& plan);
    void by_differences(const Plan& plan);
    void with_outside(const Plan& plan);
    template <class Evaluate>
    void bend(int node, const Vector& direction, double step, double precision, const Vector& here,
              const Vector& above, const Vector& below, Evaluate&& evaluate, Vector& slopes);
    void rows(const std::vector<Part>& from, std::vector<SlopeRow>& all) const;
    /// Along which derivatives are asked for: each element that is read, which gives the local Jacobian, or
    /// each seed, whichever are less.
    struct Directions {
        std::vector<int> seeds;
        bool are_elements = false;
        Eigen::Index count = 0;
    };
    Directions directions(); ///< of what is read, and its rows
    /// Changes of some of the elements that are read.
    Matrix changes_of(std::size_t first, std::size_t count, const Directions& along) const;
    /// The slopes of what is written, from its changes.
    void put(const Plan& plan, const Part& part, const Eigen::Ref<const Matrix>& changes,
             const Directions& along);
    /// Gives the changes of all that is written from those of all that is read.
    using Differentiate = std::function<void(const Matrix& read, Matrix& written)>;
    void write(const Plan& plan, const Differentiate& differentiate);
    void check_finite(const Plan& plan, bool is_finite) const;
    const Task& task(const Plan& plan);
    [[noreturn]] void fail(int node, const std::string& why) const;

    const Diagram& d_;
    Context& context_;
    bool by_differences_;
    int seeds_, unknowns_ = 0;
    std::vector<Slopes> slopes_; ///< columns: seeds, then unknowns of algebraic loops
    SlopeMemory memory_, spare_; ///< in which they are
    std::size_t tidied_ = 0;     ///< size of the memory when that was done
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
    std::array<std::vector<std::vector<std::unique_ptr<Plan>>>, 3> plans_; ///< by phase, node and index
    std::vector<Part> read_;    ///< by an activity, as far as it moves, as the next ones
    std::vector<Dual> numbers_; ///< of the operands of a rule
    std::vector<kernels::View<Dual>> views_, list_;
    std::vector<SlopeRow> elements_; ///< of all that is read
    LocalJacobian local_;
    std::vector<double> own_; ///< of each result of an elementwise rule by each operand that moves
};

} // namespace bf::analysis
