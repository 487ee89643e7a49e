// Terms as text.
#pragma once

#include "arithmetic.hpp"
#include "c_language.hpp"
#include "symbol.hpp"

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bf::codegen {

/// How tightly a text holds together, as C and C++ read it.
enum Level { chosen = 1, either, both, equality, order, sum, product, sign, whole };

struct Text {
    std::string text;
    Level level = whole;
    std::string at(Level least) const { return level >= least ? text : "(" + text + ")"; }
};

/// In C++.
class EquationPrinter {
  public:
    /// With `loop` ≥ 0 an element of that index is written as [i].
    EquationPrinter(const std::vector<Argument>& arguments, int loop) : arguments_(arguments), loop_(loop) {}
    virtual ~EquationPrinter() = default;

    std::string element(int argument, int index) const;
    /// A number without a type of its own has this one.
    Text operator()(const TermPtr& x, Type type) const;

  protected:
    virtual Text number_text(double value, Type type) const;
    virtual Text call_text(const Term& call, Type type) const;
    virtual Text conversion_text(const TermPtr& x, Type type) const;
    /// Stands for a term instead of its text; empty: nothing does.
    virtual std::string name_of(const TermPtr&) const { return {}; }

  private:
    Text compared(const TermPtr& x, const std::string& op) const;
    Text differing(const TermPtr& x, const char* op) const;
    std::string joined(const TermPtr& x, const char* op) const;

    const std::vector<Argument>& arguments_;
    int loop_;
};

/// In C: functions are those of <math.h>, and those that `c_function` defines.
class CEquationPrinter final : public EquationPrinter {
  public:
    using Names = std::map<std::string, std::string>; ///< by the key of what they stand for
    CEquationPrinter(const std::vector<Argument>& arguments, int loop, const std::string& prefix,
                     const Names& names, std::set<CFunction>& functions)
        : EquationPrinter(arguments, loop), prefix_(prefix), names_(names), functions_(functions) {}

  private:
    Text number_text(double value, Type type) const override;
    Text call_text(const Term& call, Type type) const override;
    Text conversion_text(const TermPtr& x, Type type) const override;
    std::string name_of(const TermPtr& x) const override;

    const std::string& prefix_; ///< of functions of ours
    const Names& names_;
    std::set<CFunction>& functions_;
};

/// Is it the element of that index of the operand?
bool is_itself(const TermPtr& x, int argument, int index);
/// Can the term be assigned to an element of that type, without a conversion that is not written?
bool fits(const TermPtr& x, Type type);

} // namespace bf::codegen
