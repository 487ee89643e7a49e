// One generation: gives every quantity its place in a structure, then prints.
#pragma once

#include "bf/codegen/fmu.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/program/program.hpp"

#include "arithmetic.hpp"
#include "formulas.hpp"
#include "names.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace bf::codegen {

/// Where a quantity lies in the generated class: empty member for one without elements.
struct Place {
    std::string structure; ///< "signals", "parameters", ...
    std::string member;
    std::string text() const { return member.empty() ? member : structure + "." + member; }
};

/// Empty where a quantity has none.
std::string unit_text(const Slot& slot);

/// Is the quantity an ordinary variable in generated code?
inline bool is_one_number(const Slot& slot) { return slot.size.count() == 1 && slot.size.cols == 1; }

/// A member of a structure.
struct Field {
    Node::End end;
    std::string member, path;
    const Slot* slot;
    std::string unit = unit_text(*slot), doc = slot->doc;
    /// What the model says of a port of the root counts more than what the block says that drives it.
    void declare(const SignalName& port) {
        if (!port.unit.empty()) unit = port.unit;
        if (!port.doc.empty()) doc = port.doc;
    }
};

/// A statement of the program.
struct Printed {
    std::string text;
    bool is_differentiable = false; ///< equations alone, that on_numbers.hpp has all functions of
};

/// Statements that run under one condition; empty: always.
struct Guarded {
    std::string condition;
    std::vector<Printed> statements = {};
};

/// A function of bounded length that some statements became.
struct Piece {
    std::string name, body;
    int statements = 0;
    bool is_differentiable = true;
};
/// Numbers of pieces, which are called one after the other until one fails.
using PieceNumbers = std::vector<int>;

/// "double y[3]": a quantity as a member.
std::string declared(const Slot& slot, const std::string& type, const std::string& member);

/// A message as literals of one line each.
std::string message(std::string text);

/// An equation in lines of at most 110 columns.
std::string equation(const std::string& line);

/// "path [unit]: doc", for a comment.
std::string about(const std::string& what, const std::string& unit, const std::string& doc);

/// One model of an FMU.
struct FmuPart {
    FmuCode code;                                ///< all but the file of tables, headers and the token
    std::vector<std::string> rows;               ///< of the tables, by variables
    std::string clocks;                          ///< rows of their table
    std::string declarations;                    ///< of what the next are defined by
    std::string library, functions, derivatives; ///< of FmuTables
    bool is_repeatable;                          ///< its signals
};

/// In C++. What another language writes differently is virtual.
class Generator {
  public:
    /// Of an FMU, which may leave the integration to its caller, with functions for that.
    Generator(const Diagram& diagram, const Options& options,
              program::Integrator integrator = program::Integrator::own);
    virtual ~Generator() = default;
    virtual Files run();
    FmuPart fmu(const FmuChoice& choice, const std::map<std::string, std::string>& folders);
    MemoryReport memory() const; ///< after run()
    std::vector<BlockPlace> places_in(const Files& files) const;

  protected:
    const Block& block(int node) const { return *diagram_.nodes[static_cast<std::size_t>(node)].block; }
    const DiagramNode& node(int n) const { return diagram_.nodes[static_cast<std::size_t>(n)]; }

    virtual void check() const;
    /// Has each rate functions of its own?
    bool is_split() const { return !program_.tasks.empty(); }
    bool has_continuous_states() const { return !continuous_.empty(); }
    /// Made by the factory from its plugin at the start of the program, because it is more than rules that
    /// can be printed.
    bool is_hosted(int n) const { return hosted_[static_cast<std::size_t>(n)] >= 0; }
    Type real() const { return options_.single ? Type::float32 : Type::float64; }
    Type type_of(const Slot& slot) const { return slot.type == Type::float64 ? real() : slot.type; }
    /// Does the program make blocks, or elaborate the model?
    bool has_hosted() const { return hosted_count_ > 0 || is_dynamic(); }
    bool are_signals_repeatable() const;
    // Rates as clocks of an FMU, by their numbers.
    std::vector<int> clocked_rates() const;
    std::vector<int> rates_of(const Node::End& end) const;
    bool has_unclocked_steps() const;
    FmuClock clock_of(const SampleRate& rate) const;
    bool is_dynamic() const { return options_.has_runtime_sizes; }
    int hosted_number(int n) const { return is_dynamic() ? n : hosted_[static_cast<std::size_t>(n)]; }
    void place_all();
    void place(const Node::End& end, const char* structure, std::vector<Field>& fields,
               const std::string& path);
    const Place& place_of(const Node::End& end) const;
    /// The structure of that name, before a member of it.
    virtual std::string in_structure(const std::string& name) const { return name; }

    /// One statement per activity of a node, with its constants before it.
    std::string statement(int n, Phase phase, int index);
    virtual std::string rule(int n, Phase phase, int index);
    std::string operand(int n, const Call::Reference& from, std::string& constants);
    /// The rule as arithmetic, or nothing where only a kernel says it.
    std::optional<Equations> equations(int n, const Call& call);
    virtual Argument argument(int n, const Call::Reference& from);
    /// Where an operand that has a place lies.
    Place place_of(int n, const Call::Reference& from) const;
    /// An input is stored where its source is.
    Node::End stored_in(int n, int slot) const;
    /// Statements that write literal numbers, or the values of another quantity.
    virtual std::string write_values(const std::string& target, const Slot& slot,
                                     const std::vector<double>& values) const;
    /// to = from.
    virtual std::string assignment(const std::string& to, const Slot& to_slot, const std::string& from,
                                   const Slot& from_slot) const;
    std::string set(int number) const; ///< of the program's sets
    /// The block changes its states where its guards crossed.
    std::string event(int n);
    /// Does a printed event change continuous states?
    bool has_continuous_events() const;

    /// The functions that make up each part of the program.
    struct Calls {
        PieceNumbers constants, follow, derivatives, guards, marks;
        PieceNumbers outputs, again, inside, between; ///< by pass
        int inner_statements = 0;                     ///< that the solver evaluates inside a step
        std::string update;                           ///< statements
        std::string commit;                           ///< the same without the integration
        std::string event;                            ///< statements where the caller's solver stopped
        struct Task {
            std::string name;
            PieceNumbers outputs;
            std::string update;
        };
        std::vector<Task> tasks; ///< of the program's, where it is split
    };

    /// The model on numbers with derivatives, of which `places` are those of the variables of the FMU.
    std::string derivatives_source(const std::vector<std::string>& places) const;

    /// Gives quantities their places and prints the functions that both languages have.
    Calls print_functions();

    // The statements of the program.
    void find_flags_in_use();
    std::string flag(int flag) const;
    std::string memory(int memory) const;
    std::string condition(const std::vector<program::Literal>& when) const;
    virtual std::string failing(int node, const std::string& why) const;
    /// A statement that runs where something did not go well.
    virtual std::string unless(const std::string& good, const std::string& otherwise) const;
    /// Did some element of a guard cross 0?
    virtual std::string has_crossed(const Field& guard) const;
    /// Some element of a signal that is no number on its own is above 0.
    virtual std::string is_positive(const Node::End& end) const;
    virtual std::string text_of(const program::Statement& statement, program::Pass pass = program::first);
    Printed printed(const program::Statement& statement, program::Pass pass);
    bool is_differentiable(const program::Statement& statement) const; ///< once it is printed
    std::string text_of(const program::Statements& statements, program::Pass pass, int indent);
    virtual std::string commits(const program::Statement& statement) const;
    std::string repetition(const program::Statement& statement, program::Pass pass);
    /// What the control of a step remembers.
    struct ControlQuantity {
        std::string type, name, doc;
        std::string value = {}; ///< at the start; empty: 0
    };
    std::vector<ControlQuantity> control_quantities() const;
    std::string control_declarations() const;
    std::string control_resets() const; ///< in initialize()
    std::string has_fired() const;
    std::vector<SignalName> recorded_rows() const;
    std::string run_library(const Files& files) const;
    std::string procedure_functions();
    /// Of a function of the model without arguments that may fail: a call, a declaration, the head of the
    /// definition.
    virtual std::string call_of(const std::string& function) const { return function + "()"; }
    virtual std::string declaration_of(const std::string& function) const {
        return "bool " + function + "() noexcept;";
    }
    virtual std::string head_of(const std::string& function) const {
        return "bool " + class_ + "::" + function + "() noexcept";
    }
    std::string crossings_functions(const Calls& calls) const;
    int guard_count() const; ///< elements
    int crossed_flag() const;
    std::vector<Guarded> guarded(const program::Statements& statements, program::Pass pass = program::first);
    /// Adds to what is called there.
    void print_outputs(const program::Statements& outputs, Calls& calls);
    std::string update_body(const program::Statements& update);
    // Of a model whose solver is the caller's.
    bool is_sampled(const Calls& calls) const;
    int mark_count() const; ///< elements, those of controls included
    /// Do continuous signals follow from what a step commits?
    bool keeps_signals(const Calls& calls) const;
    std::string event_statements(const Calls& calls);
    std::string exchange_declarations(const Calls& calls) const;
    std::string exchange_members(const Calls& calls) const;
    std::string exchange_functions(const Calls& calls) const;
    /// `at`: statements that go to the time of that name.
    std::string crossings_of_caller(const Calls& calls, const std::string& at) const;
    /// Outputs and updates, of all or of each task.
    void print_step(Calls& calls);
    /// The functions that one task consists of, behind each other.
    std::string task_functions(const Calls& calls);
    /// Statements of output() and update() where tasks do it.
    std::string task_calls(const Calls& calls, const std::string& half);
    /// "10ms": of the functions at a rate.
    std::string rate_name(int rate) const;
    static std::string rate_rules(const std::string& slashes); ///< of calling them, as comments
    virtual std::string rate_functions() const;                ///< declarations
    /// "Every 0.01 s, ...": of the function of a task.
    std::string rate_doc(const program::Task& task) const;
    std::string of_task(const std::string& quantity, int rate) const {
        return control_ + quantity + "_" + number(rate);
    }
    /// The time of a statement of that task, of the whole step for -1.
    std::string time_of(int task) const { return task < 0 ? step_time_ : of_task("time", task); }
    std::string time_inside() const; ///< a step, where a solver evaluates
    std::string go_to() const;       ///< made blocks know the time `at`, too
    /// Statement by which a function does nothing after a failure; the product of steps and period.
    virtual std::string unless_failed() const { return "    if (failure_) return false;\n"; }
    virtual std::string time_at(const std::string& steps) const {
        return "Real(" + steps + ") * Real(period)";
    }
    /// A copy to a port of the root.
    std::string copy_of(const Field& output) const {
        return assignment(in_structure("outputs") + "." + output.member, *output.slot,
                          place_of(output.end).text(), *output.slot);
    }
    /// How often a task asks for a hit until the next one, and before the first.
    std::int64_t calls_between(const program::Flag& hit) const;
    std::int64_t calls_before(const program::Flag& hit) const;
    /// "2", or "2_in_1" in the calls of a task.
    static std::string hit_name(const program::Flag& hit);

    /// Spreads guarded statements over functions `family_1`, ...
    PieceNumbers functions(const std::string& family, const std::vector<Guarded>& all);
    /// "outputs_1() && outputs_2()"; "true" for none.
    std::string called(const PieceNumbers& pieces) const;
    std::string definition_of(const Piece& piece) const {
        return flatten_ + head_of(piece.name) + " {\n" + piece.body + "    return true;\n}\n";
    }

    std::string structure(const char* name, const char* doc, const std::vector<Field>& fields,
                          bool has_values) const;
    std::string header(const Calls& calls) const;
    std::string main_source(const Calls& calls);
    std::string integration(const Calls& calls) const;
    /// Of a small continuous system the functions of a step are joined, with a copy of it for each stage of
    /// the solver: signals, states and what the solver works with then stay in registers.
    bool is_joined(const Calls& calls) const;
    const char* flattened(const Calls& calls) const;
    /// Declarators of what the solver works with.
    std::string solver_memory(const std::string& start, const std::string& slopes) const;
    int continuous_size() const; ///< elements
    int stages_of_solver() const;
    std::string solver_name() const;
    bool uses_standard_library() const; ///< are some hosted blocks standard ones?
    std::vector<std::string> plugins() const;
    std::string library_declarations() const;
    /// Statements that tell the registry what is linked, and where plugins are.
    std::string add_libraries(const std::string& registry) const;
    std::string cmake_lists(const std::vector<std::string>& sources) const;
    std::string hosted_source() const;
    std::string elaborated_source() const;
    std::string hosted_slot(int n, int s) const;
    std::string tables() const;
    std::string table_row(const std::string& name, const Node::End& end) const;
    std::string table_row(const std::string& name, const Node::End& end, const Place& place,
                          const std::string& unit, const std::string& doc) const;
    std::string variables_structure() const;
    std::vector<Guarded> follow() const; ///< what formulas give, in their order
    std::string fixed_rows() const;
    int formula_of(const std::string& name) const; ///< -1: none
    bool has_variables() const { return !formulas_.variables.empty(); }
    const Definition& definition(int number) const {
        return diagram_.definitions[static_cast<std::size_t>(number)];
    }
    std::string readme() const;
    /// Which lines each block became.
    std::string blocks_page(const Files& files) const;
    void add_interfaces(Files& files) const; ///< for C and Python
    std::string c_structure(const char* name, const char* doc, const std::vector<Field>& fields) const;
    std::string python_structure(const char* name, const char* doc, const std::vector<Field>& fields) const;

    const Diagram& diagram_;
    Options options_;
    const bool is_fmu_; ///< with functions by which a solver of the caller integrates the model
    std::map<std::string, std::string> folders_; ///< of blocks of an FMU, in its resources
    std::string flatten_ = "[[gnu::flatten]] ";  ///< before a function that kernels are joined into
    std::string control_ = "control_.", step_time_ = "time_"; ///< before what controls a step; of this step
    std::string time_ = step_time_;                           ///< of what is printed
    std::vector<std::string> split_problems_;                 ///< what stands against a function per rate
    const program::Program program_;
    int loop_depth_ = 0;                                            ///< of what is printed
    std::set<int> used_flags_;                                      ///< of the program: what asks for others?
    std::vector<std::string> procedures_;                           ///< names of their functions
    std::map<std::tuple<int, Phase, int>, std::string> statements_; ///< by activity
    const Formulas formulas_;
    std::map<std::string, int> formula_numbers_; ///< by the name of what they give
    std::string class_, file_;
    std::vector<std::vector<Place>> places_; ///< by node and slot
    std::vector<std::vector<Place>> next_;   ///< of discrete states
    std::vector<Field> inputs_, parameters_, signals_, states_, continuous_, workspace_, guards_, marks_;
    std::vector<Field> outputs_;                         ///< copies; end = what is copied
    std::map<std::string, std::set<std::string>> taken_; ///< names of members by structure
    std::set<int> timed_rates_;                          ///< triggered ones whose period is asked for
    bool has_matrices_ = false;                          ///< do printed rules work on some?
    std::set<std::string> headers_;
    std::vector<std::string> declarations_; ///< of the functions that pieces became
    std::vector<Piece> pieces_;
    Calls calls_;                                          ///< of run()
    std::set<std::tuple<int, Phase, int>> differentiable_; ///< activities
    std::map<std::string, int> piece_numbers_;             ///< by family
    std::vector<int> hosted_;                              ///< by node: number among the hosted blocks, or -1
    int hosted_count_ = 0;
    /// What the program asks hosted blocks to do, in the order of `HostedBlocks::run`.
    struct HostedTask {
        int node;
        Phase phase;
        int index;
    };
    std::vector<HostedTask> tasks_;
    /// Operands that are constants, where sizes are known at the start.
    struct ConstantOperand {
        int node;
        Phase phase;
        int rule, operand;
    };
    std::vector<ConstantOperand> constants_;
};

} // namespace bf::codegen
