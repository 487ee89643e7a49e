#pragma once

#include "builtins.hpp"

namespace bf::matlab {

/// The interpreter itself: the stack of calls and everything kept between them.
class Interpreter::State final : public Context {
  public:
    State(Host& h, const Limits& limits)
        : Context(h, budget_), limits_(limits), budget_(limits.elements, limits.work) {}

    Value evaluate_top(const Expression& expression, const Workspace& variables);
    void run_top(const std::shared_ptr<const Program>& program, Workspace& variables);
    std::vector<Value> call_top(const std::shared_ptr<const Program>& program, std::vector<Value> arguments,
                                int outputs);

    std::vector<Value> apply(const Value& function, std::vector<Value> arguments, int outputs) override;
    Workspace& variables() override { return *frame_->variables; }
    int argument_count() const override { return frame_->argument_count; }
    bool is_function(const std::string& name) override;
    void run_script(const std::string& path) override;

  private:
    /// One running script or function.
    struct Frame {
        Workspace* variables;
        std::shared_ptr<const Program> program; // its local functions; null for an expression
        const Function* function = nullptr;
        int argument_count = 0;
        std::vector<std::string> imports;
        std::vector<std::string> persistent;
    };
    /// What `end` means in the index being evaluated.
    struct IndexContext {
        const Value& base;
        std::size_t position;
        std::size_t count;
    };
    /// One step of a left-hand side: a field, or positions.
    struct Access {
        Kind kind;
        std::string field;
        std::vector<Selection> at;
    };
    enum class Flow { Next, Break, Continue, Return };

    /// Counts the depth of evaluation while it lives.
    struct Level {
        explicit Level(State& s) : state(s) {
            if (++state.depth_ > state.limits_.depth) {
                --state.depth_;
                throw Error("calls and expressions nest deeper than " + std::to_string(state.limits_.depth) +
                            " levels; is there an endless recursion?");
            }
        }
        ~Level() { --state.depth_; }
        State& state;
    };
    /// Makes a frame current while it lives.
    struct Entered {
        Entered(State& s, Frame& frame) : state(s), before(std::exchange(s.frame_, &frame)) {}
        ~Entered() { state.frame_ = before; }
        State& state;
        Frame* before;
    };

    void reset();

    // evaluate.cpp
    Value evaluate(const Expression& e);
    Value evaluate_kind(const Expression& e);
    std::vector<Value> evaluate_many(const Expression& e, int outputs);
    Value evaluate_range(const Expression& e);
    Value evaluate_short_circuit(const Expression& e);
    Value evaluate_end(const Expression& e) const;
    Value evaluate_matrix(const Expression& e);
    Value evaluate_cell(const Expression& e);
    Value evaluate_lambda(const Expression& e);
    std::vector<Value> evaluate_chain(const Expression& e, int outputs);
    std::vector<Value> evaluate_list(const Expression& e, std::size_t first);
    std::vector<Selection> evaluate_selections(const Expression& e, const Value& base);
    bool is_variable(const Expression& root) const;
    std::string field_name(const Expression& e);

    // interpreter.cpp
    std::vector<Value> call_named(const std::string& name, std::vector<Value> arguments, int outputs);
    std::vector<Value> call_function(const std::shared_ptr<const Program>& program, const Function& function,
                                     std::vector<Value> arguments, int outputs);
    std::vector<Value> call_builtin(std::string_view name, const Builtin& builtin,
                                    std::vector<Value>& arguments, int outputs);
    std::shared_ptr<const Program> find_file(const std::string& name);
    [[noreturn]] void unknown(const std::string& name);

    // execute.cpp
    Flow execute(const Block& block);
    Flow execute(const Statement& statement);
    Flow execute_statement(const Statement& s);
    Flow execute_for(const Statement& s);
    Flow execute_switch(const Statement& s);
    void execute_assign(const Statement& s);
    void execute_persistent(const Statement& s);
    void execute_command(const Statement& s);
    void assign(const Expression& target, Value value, bool deletes);
    Access access(const Expression& e, const Value& base, bool last);
    void store(Value& base, const std::vector<Access>& path, std::size_t i, Value& value, bool deletes);

    Limits limits_;
    Budget budget_;
    int depth_ = 0;
    Frame* frame_ = nullptr;
    const IndexContext* index_ = nullptr;
    std::map<std::string, std::shared_ptr<const Program>> files_; // null: no such function
    std::map<const Function*, std::map<std::string, Value>> persistent_;
    std::vector<std::shared_ptr<const Program>> kept_; // programs whose functions have persistent variables
};

} // namespace bf::matlab
