// Runs S-functions as Simulink documents it: a flat model of one S-function's blocks.
#pragma once

#include "simstruct/methods.h"

#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace simstruct {

/// What Simulink would show: the error status of a block, an algebraic loop, sizes that do not fit, or a call
/// that its documentation forbids.
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Values for parameters; whoever calls owns the arrays.
mxArray* number(double x);
mxArray* matrix(int rows, int cols, const std::vector<double>& columns, mxClassID type = mxDOUBLE_CLASS);
mxArray* logical(bool x);
mxArray* text(const std::string& x);
mxArray* texts(const std::vector<std::string>& x);

/// One setting of a block's record for generated code.
struct Setting {
    std::string name;
    std::variant<std::string, double, std::vector<double>> value;
};

enum class Solver { euler, runge_kutta_4 };

/// A fixed-step model. `compile` sizes it, `start` begins a run, `step` makes one, the destructor terminates.
class Model {
  public:
    Model(const SimStructMethods& methods, double step, Solver solver = Solver::euler);
    ~Model();
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;

    /// A block; takes the arrays.
    int add(const std::string& path, std::vector<mxArray*> parameters);
    /// A signal from outside: 1-D of `rows` elements when cols is 0.
    int add_input(int rows, int cols, DTypeId type);
    void connect(int from, int from_port, int to, int to_port);

    /// All callbacks up to mdlSetWorkWidths, in the documented order.
    void compile();
    /// mdlStart and mdlInitializeConditions of all blocks in their order.
    void start();
    /// One major step and, for continuous states, the minor steps of the solver.
    void step();
    /// What an enabled subsystem that resets its states does to a block.
    void reset(int block);
    /// A parameter changed while running; takes the array.
    void change(int block, int parameter, mxArray* value);
    mxArray* save(int block);
    void restore(int block, const mxArray* state);
    std::vector<std::vector<Setting>> rtw(int block);
    /// What the record calls the pointers of a block, and how many each name has.
    const std::vector<std::pair<std::string, int>>& pointer_names(int block) const;
    void terminate();

    double time() const;
    double step_size() const { return step_size_; }
    void* input(int source); ///< memory of a signal from outside
    const void* output(int block, int port) const;
    int inputs(int block) const;
    int outputs(int block) const;
    std::vector<int> output_dimensions(int block, int port) const;
    DTypeId output_type(int block, int port) const;
    bool feeds_through(int block, int port) const;
    bool is_tunable(int block, int parameter) const;
    /// Discrete states as Simulink shows them: name and memory.
    std::vector<std::string> state_names(int block) const;
    const void* state(int block, const std::string& name) const;
    std::vector<double>& continuous_states(int block);
    const std::vector<std::string>& warnings(int block) const;
    /// Names of the callbacks of a block in the order in which they were made.
    const std::vector<std::string>& calls(int block) const;

  private:
    struct Wire {
        int from, from_port, to, to_port;
    };
    void call(SimStruct& block, const char* name, auto&& f);
    void spread();
    void sort();
    void outputs_of(SimStruct& block);
    void integrate();
    void derive(std::vector<std::vector<double>>& rates);

    SimStructMethods methods_;
    double step_size_;
    Solver solver_;
    long steps_ = 0;
    std::vector<std::unique_ptr<SimStruct>> blocks_;
    std::vector<Wire> wires_;
    std::vector<int> order_;
};

} // namespace simstruct
