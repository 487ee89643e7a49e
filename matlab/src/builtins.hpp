#pragma once

#include "bf/base/names.hpp"
#include "operators.hpp"

#include <string_view>
#include <unordered_map>
#include <vector>

namespace bf::matlab {

/// What built-in functions need from whoever calls them.
struct Context {
    Budget& budget;
    Suggestions& suggestions;
    virtual Value apply(const Value& function, std::vector<Value> arguments) = 0;

  protected:
    Context(Budget& b, Suggestions& s) : budget(b), suggestions(s) {}
    ~Context() = default;
};

/// One call of a built-in.
struct Call {
    std::string_view name;
    std::vector<Value>& arguments;
    Context& context;

    std::size_t size() const { return arguments.size(); }
    const Value& operator[](std::size_t i) const { return arguments[i]; }
    Budget& budget() const { return context.budget; }
    double scalar(std::size_t i) const { return arguments[i].scalar(); }
    std::string text(std::size_t i) const { return arguments[i].text(); }
    /// An array with a size that the caller fills or checks; counts against the budget.
    Index length(std::size_t i) const; ///< a size: negative becomes 0, fractions throw
};

/// A built-in, and how many arguments it takes.
struct Builtin {
    int least;
    int most;                              ///< -1: any number
    Value (*value)(const Call&) = nullptr; ///< null: by the rules of operators alone
};
using Builtins = std::unordered_map<std::string_view, Builtin>;

const Builtins& builtins();

// Each fills in its group.
void add_elementwise(Builtins& table);
void add_arrays(Builtins& table);
void add_reductions(Builtins& table);
void add_linear_algebra(Builtins& table);
void add_text(Builtins& table);
void add_data(Builtins& table);

/// MATLAB's sprintf, cycling through the elements of the arguments.
std::string formatted(const std::string& format, const std::vector<Value>& arguments, std::size_t first);

} // namespace bf::matlab
