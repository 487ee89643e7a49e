// One block of ours behind an S-function: sized while a model is compiled, then run.
#pragma once

#include "bf/boundary/positional.hpp"
#include "bf/core/instance.hpp"
#include "scope.hpp"

#include <simstruc.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace bf::simulink {

/// Pointers that Simulink keeps for a block: the running block; generated code has one more.
constexpr int pointers_work = 2;

/// The block as the parameters make it, told what the model says of its ports so far. Simulink keeps no
/// object between the callbacks of a compilation, so each of them makes one anew.
class Prototype {
  public:
    /// Throws std::runtime_error: unknown class, wrong number or kind of parameters, refused arguments.
    explicit Prototype(SimStruct* S);

    /// Takes over the sizes and types that the ports have in the model and infers what follows. Nothing is
    /// inferred while a provider is missing: it may be a block that Simulink has not come to yet.
    void learn(SimStruct* S);
    /// Gives the ports of the model what is known of them.
    void tell(SimStruct* S) const;
    void require_providers() const;

    const BlockClass& type() const { return *type_; }
    const Declaration& declaration() const { return instance_->declaration(); }
    const Slot& slot(int i) const { return instance_->slot(i); }
    int parameter_count() const { return parameter_count_; }
    bool is_tunable(int parameter) const;
    bool feeds_through(int input) const; ///< the slot of an input
    bool has_state() const;              ///< beside continuous ones
    bool has(Role role) const;
    /// s; 0 when steps are as long as the solver likes.
    double period_of_steps(SimStruct* S) const;

    Instance& instance() { return *instance_; }
    const Instance& instance() const { return *instance_; }
    std::vector<int> inputs, outputs;              ///< slots of the ports
    Arguments arguments;                           ///< as given
    std::vector<std::pair<int, Value>> parameters; ///< slots and values as given
    std::vector<Scope::Binding> bindings;
    double period = INHERITED_SAMPLE_TIME, offset = 0;

  private:
    void set_port(SimStruct* S, bool is_input, int port, int slot) const;

    const BlockClass* type_;
    const std::vector<boundary::PositionalValue>* values_;
    int parameter_count_ = 0;
    std::unique_ptr<Instance> instance_;
};

/// A block in a run. Simulink owns states and signals: each call takes them over and gives them back.
class Running {
  public:
    /// Allocates everything. Throws what opening a resource throws.
    explicit Running(SimStruct* S);

    /// How many work vectors hold discrete states and the count of steps, and what they are.
    static void declare_work(SimStruct* S, const Prototype& prototype);

    /// All throw std::runtime_error with the block's reason.
    void reset(SimStruct* S); ///< the first time it starts the block, too
    void output(SimStruct* S);
    void update(SimStruct* S);
    void derivative(SimStruct* S);
    void zero_crossings(SimStruct* S);
    void check_parameters(const Prototype& changed) const;
    void take_parameters(const Prototype& changed);
    mxArray* save(SimStruct* S);
    void restore(SimStruct* S, const mxArray* state);

  private:
    struct Port {
        void* memory;
        std::size_t bytes;
        bool feeds_through;
    };
    void take_inputs(SimStruct* S, bool only_feedthrough);
    void take_states(SimStruct* S);
    void give_states(SimStruct* S);
    void take_clock(SimStruct* S);
    bool cross(SimStruct* S);
    void run(Phase phase);
    Instance& instance() { return prototype_.instance(); }

    Prototype prototype_;
    std::vector<Port> input_ports_, output_ports_;
    std::vector<Port> discrete_;                          ///< in the order of the work vectors
    std::vector<std::pair<double*, double*>> continuous_; ///< state and rate, element by element
    /// An element of a guard. One that counts, of whole numbers, shows Simulink a sign that changes with it.
    struct Crossing {
        void* data;
        Type type;
        double sign() const {
            if (type == Type::float64) return *static_cast<double*>(data);
            return std::fmod(read_value(data, type, 0), 2) != 0 ? 1 : -1;
        }
    };
    std::vector<Crossing> crossings_;
    bool has_started_ = false;
};

/// Writes what BlockFactory.tlc reads: a record of the block, then one per parameter. Texts are written as
/// character codes, so that any of them survives two languages. Throws for blocks that generated code cannot
/// run.
void write_record(SimStruct* S, const Prototype& prototype, double period);

} // namespace bf::simulink
