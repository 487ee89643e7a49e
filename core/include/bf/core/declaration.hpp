// What a block declares: the one contract that engines, exporters, editors and checks are derived from.
#pragma once

#include "bf/core/types.hpp"
#include "bf/core/units.hpp"
#include "bf/core/value.hpp"
#include "bf/kernels/limits.hpp"

#include <array>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace bf {

class Block;
struct Call;

/// What a block does at which time. A block made of rules has one activity per rule, any other block one per
/// method. An event is the answer to crossings of zero.
enum class Phase : std::uint8_t { output, update, derivative, guards, event };
inline constexpr std::array phases{Phase::output, Phase::update, Phase::derivative, Phase::guards,
                                   Phase::event};

/// A length known only once the diagram is wired, e.g. the number of joints. With a rule it is computed as
/// soon as the block's arguments and resources are known, otherwise the wiring decides.
class Dim {
  public:
    /// What each element is called, e.g. the joints; nothing while that is not known.
    using Names = std::optional<std::vector<std::string>>;
    Dim(Block* owner, const char* name, std::function<int()> rule = {});
    /// A length whose elements have names: there are as many. Vectors of this length are recorded, drawn and
    /// chosen by them, and so is what other blocks compute from these vectors element by element.
    Dim(Block* owner, const char* name, std::function<Names()> names);
    int id() const { return id_; }

  private:
    int id_;
};

/// A whole size decided by wiring; keys that name the same AnyShape have the same size.
class AnyShape {
  public:
    explicit AnyShape(Block* owner);
    int id() const { return id_; }

  private:
    int id_;
};

/// A fixed length, or a Dim plus a constant.
struct Extent {
    int dim = -1;
    int plus = 1;
    constexpr Extent() = default;
    constexpr Extent(int fixed) : plus(fixed) {}
    Extent(const Dim& d) : dim(d.id()), plus(0) {}
};
inline Extent operator+(const Dim& d, int k) {
    Extent extent(d);
    extent.plus = k;
    return extent;
}

/// {} scalar, {n} 1-D signal, {n, m} matrix, or an AnyShape.
struct Shape {
    Extent rows, cols;
    bool is_matrix = false;
    bool is_given = false;
    int symbol = -1;

    constexpr Shape() = default;
    constexpr Shape(Extent n) : rows(n), is_given(true) {}
    constexpr Shape(Extent n, Extent m) : rows(n), cols(m), is_matrix(true), is_given(true) {}
    Shape(const AnyShape& any) : is_given(true), symbol(any.id()) {}
};

/// What a quantity is to its block. `workspace` is memory for a rule whose content means nothing between two
/// calls; `guard` is a zero-crossing function, written by `guards` or a GuardRule.
enum class Role : std::uint8_t {
    input,
    output,
    parameter,
    discrete_state,
    continuous_state,
    workspace,
    guard
};
const char* name(Role role);
constexpr bool is_state(Role role) { return role == Role::discrete_state || role == Role::continuous_state; }

/// What the values of a parameter or argument may be.
using kernels::Limits;
/// "greater than 0", "from 0 to 1"; empty where everything is allowed.
std::string text_of(const Limits& limits);
/// What is wrong with the first value that is not allowed: "must be greater than 0, but is -1". Empty:
/// nothing is.
std::string outside(const Limits& limits, const std::vector<double>& values);
/// The same of the first value that the type does not hold: "must be a whole number from 0 to 255, but is
/// 0.5".
std::string outside(Type type, const std::vector<double>& values);

/// What a block author says about one quantity. Every member is optional and named at the call.
struct About {
    Shape shape = {}; ///< needed only when the type does not fix it
    std::initializer_list<double> initial =
        {}; ///< parameters, states, unconnected inputs; one element expands; zeros if omitted
    double minimum = -Limits::infinity; ///< parameters: of every element, inclusive
    double above = -Limits::infinity;   ///< parameters: every element is greater than this
    double maximum = Limits::infinity;  ///< parameters: of every element, inclusive
    int at_least = -1;                  ///< parameters: index() of the one that no element is below
    Unit unit = {};
    const char* doc = "";
    bool present = true;     ///< false: an optional port that the arguments switch off
    bool feedthrough = true; ///< inputs: `output` reads it
    bool optional = false;   ///< inputs: may stay unconnected and then reads `initial`
    bool reported = false;   ///< states: the final value is one of the model's checks in the run's summary
    int initial_from = -1;   ///< states: index() of the parameter that holds the initial value
    bool as_written = false; ///< parameters of any shape: keep a row a 1 x n matrix instead of making it 1-D
    bool from_path = false;  ///< parameters: the default is a whole number that the block's path decides
    /// Discrete states, outputs, parameters: number k stands for the k-th of these, from 1. A run that goes
    /// on with an edited model takes over what the number stands for.
    std::span<const std::string> value_names = {};
};

/// Everything an engine, exporter or editor may ask about one declared quantity.
struct SlotDeclaration {
    Role role = Role::input;
    std::string name, doc;
    Unit unit;
    Shape shape;          ///< as declared
    int type_symbol = -1; ///< -1: `type` is fixed; keys of one symbol have the same type
    Type type = Type::float64;
    bool feedthrough = true, optional = false, reported = false, as_written = false, from_path = false;
    int initial_from = -1;
    std::vector<double> initial;          ///< empty: zeros; one element: expands
    Limits limits;                        ///< of a parameter
    std::vector<std::string> value_names; ///< what numbers stand for, from 1; empty: for themselves
    int at_least = -1;                    ///< the parameter that no element of this one is below
};

/// One structural value: fixed when the block is made, may decide which ports exist.
struct ArgumentDeclaration {
    std::string name, doc;
    Value initial;                         ///< the default
    std::vector<std::string> choices = {}; ///< texts allowed; empty: any
    Limits limits = {};                    ///< of numbers
    bool from_path = false; ///< the default is a whole number that the block's path in the model decides
    bool is_secret = false; ///< it names the file of a secret, which no package holds
};

/// An object that belongs to one running diagram: workspace, outside state or an opened resource.
struct Object {
    std::shared_ptr<void> pointer;
    std::function<std::size_t()> state_size; ///< doubles; empty: workspace, nothing to save
    std::function<void(double*)> save;
    std::function<void(const double*)> restore;
    bool is_outside = false; ///< holds state that matters; without `save` it refuses snapshots
};

struct ObjectDeclaration {
    std::function<Object()> make;
    int requirement =
        -1;             ///< >= 0: the object opened from that resource, shared by all its users in a context
    int provision = -1; ///< >= 0: the object opened from the resource this block provides
};

/// A named resource this block offers to the blocks of its subsystem and below.
struct ProvisionDeclaration {
    std::string type;
    std::function<std::shared_ptr<const void>()> make; ///< may throw: wrong file, unknown name
    std::function<Object(const void*)> open;
};

/// A resource this block needs, found in the nearest enclosing subsystem that offers one.
struct RequirementDeclaration {
    std::string type, doc;
    std::function<void(std::shared_ptr<const void>)> bind;
};

/// What an engine does for a block besides calling its rules and methods. Members of type int are indices of
/// slots, -1: none.
struct Traits {
    bool is_root_input = false; ///< whoever runs the diagram writes the output
    bool merges = false;        ///< an input is taken over when the subsystem runs that computes it
    bool changes_rate = false;  ///< the input may come at another period than the block's
    bool goes_on = false;       ///< outputs change inside a step, though states do not; crossings are events
    bool is_displayed = false;  ///< a run shows the inputs
    bool counts = false;        ///< states begin anew in each step of the loop around
    int first_value = -1;       ///< parameter: the output while it has not run yet
    int again = -1;             ///< input: above 0, the while subsystem around runs again;
    int begin = -1;             ///< input: above 0, it runs at all;
    int most = -1;              ///< parameter: how often at most
};

/// A Dim: its name in messages, and how its value or the names of its elements are found, if not by wiring.
struct DimDeclaration {
    std::string name;
    std::function<int()> rule;
    std::function<Dim::Names()> names;
};

/// Complete when the block is made, and the same from then on.
struct Declaration {
    std::vector<ArgumentDeclaration> arguments;
    std::vector<SlotDeclaration> slots;
    std::vector<DimDeclaration> dims;
    int shapes = 0, types = 0; ///< how many symbols of shapes and types there are
    std::vector<ObjectDeclaration> objects;
    std::vector<ProvisionDeclaration> provisions;
    std::vector<RequirementDeclaration> requirements;
    std::vector<Call> output_rules, update_rules, derivative_rules, guard_rules, event_rules;
    Traits traits;
    std::vector<std::string> problems; ///< arguments that were refused; empty in a usable block

    const std::vector<Call>& rules(Phase phase) const;
    /// Index of the slot of that name (and role), or -1.
    int find(std::string_view slot_name) const;
    int find(std::string_view slot_name, Role role) const;
    /// The names that the block itself gives to the elements of a vector, those of its Dim; empty: none.
    std::vector<std::string> element_names(int slot) const;
};

} // namespace bf
