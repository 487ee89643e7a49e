// A number that nobody knows yet: kernels compute with it as with any other, and what they computed is a
// term.
#pragma once

#include "bf/core/declaration.hpp"
#include "bf/kernels/functions.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bf::codegen {

struct Trace;

/// One operation of an equation.
struct Term {
    enum class Kind {
        number,     ///< a constant, by its text if it has one
        element,    ///< of an operand
        negative,   ///< -x
        arithmetic, ///< x op y
        call,       ///< op(x, ...), whole numbers included
        conversion, ///< x in the type of the term
        comparison, ///< x op y
        negation,
        conjunction,
        disjunction,
        difference, ///< of two truth values
        choice      ///< x ? y : z
    };
    Kind kind = Kind::number;
    std::string op = {};
    std::vector<std::shared_ptr<const Term>> of = {};
    std::optional<Type> type = {}; ///< a number in a kernel takes that of what it meets
    double value = 0;
    int argument = -1, index = -1; ///< of an element
    Trace* trace = nullptr;        ///< null for numbers
    // What follows from the others.
    std::string key = {};    ///< the same for the same term, while kernels of one rule run
    std::size_t size = 1;    ///< terms in its text
    int first = no_argument; ///< operand of the kernel that it is of, of several the first
    static constexpr int no_argument = 1 << 30;
};
using TermPtr = std::shared_ptr<const Term>;
using TermKind = Term::Kind;

/// Completes a term.
TermPtr term(Term t);
TermPtr number_term(double value);
/// x in that type; itself where it has this type, or none of its own.
TermPtr converted(const TermPtr& x, Type type);
/// Forgets all keys. Real numbers are of this type.
void begin_terms(Type real);
Type real_type();

inline bool is_whole(Type type) { return type != Type::float64 && type != Type::float32; }
inline bool is_number(const TermPtr& t, double value) {
    return t->kind == TermKind::number && t->value == value;
}

/// One run of a kernel: how its conditions turn out.
struct Trace {
    std::size_t most_terms = 0;               ///< in one text
    std::vector<bool> path;                   ///< of the first conditions; later ones are true
    std::vector<TermPtr> conditions = {};     ///< in the order in which they were asked
    std::map<std::string, bool> answers = {}; ///< by key
    bool has_failed = false;                  ///< the kernel is more than arithmetic on these operands

    bool decide(const TermPtr& condition);
};

class Symbol {
  public:
    // Not inline: a hundred kernels copy symbols, and compilers would spend a minute on counting references.
    Symbol(double number = 0);
    explicit Symbol(TermPtr t);
    Symbol(const Symbol& x);
    Symbol(Symbol&& x) noexcept;
    Symbol& operator=(const Symbol& x);
    Symbol& operator=(Symbol&& x) noexcept;
    ~Symbol();
    const TermPtr& term() const { return term_; }

    explicit operator bool() const { return *this != Symbol(0); }
    /// Of a number, or of one of the first few whole numbers.
    explicit operator int() const;

    friend Symbol operator-(const Symbol& x);
    friend Symbol operator+(const Symbol& x, const Symbol& y) { return binary("+", x, y); }
    friend Symbol operator-(const Symbol& x, const Symbol& y) { return binary("-", x, y); }
    friend Symbol operator*(const Symbol& x, const Symbol& y) { return binary("*", x, y); }
    friend Symbol operator/(const Symbol& x, const Symbol& y) { return binary("/", x, y); }
    friend Symbol& operator+=(Symbol& x, const Symbol& y) { return x = x + y; }
    friend Symbol& operator-=(Symbol& x, const Symbol& y) { return x = x - y; }
    friend bool operator<(const Symbol& x, const Symbol& y) { return compared("<", x, y); }
    friend bool operator>(const Symbol& x, const Symbol& y) { return compared(">", x, y); }
    friend bool operator<=(const Symbol& x, const Symbol& y) { return compared("<=", x, y); }
    friend bool operator>=(const Symbol& x, const Symbol& y) { return compared(">=", x, y); }
    friend bool operator!=(const Symbol& x, const Symbol& y) { return compared("!=", x, y); }
    friend bool operator==(const Symbol& x, const Symbol& y) { return !compared("!=", x, y); }

    friend Symbol& operator*=(Symbol& x, const Symbol& y) { return x = x * y; }
    friend Symbol& operator/=(Symbol& x, const Symbol& y) { return x = x / y; }

    // What kernels call of <cmath>. Of a number it is a number where the result is exact.
    friend Symbol floor(const Symbol& x) { return x.counts() ? x : exact("floor", std::floor, x); }
    friend Symbol ceil(const Symbol& x) { return x.counts() ? x : exact("ceil", std::ceil, x); }
    friend Symbol round(const Symbol& x) { return x.counts() ? x : exact("round", std::round, x); }
    friend Symbol trunc(const Symbol& x) { return x.counts() ? x : exact("fix", std::trunc, x); }
    friend Symbol fabs(const Symbol& x) { return exact("absolute", std::fabs, x); }
    friend Symbol sqrt(const Symbol& x) { return call("sqrt", {x}); }
    friend Symbol sin(const Symbol& x) { return call("sin", {x}); }
    friend Symbol cos(const Symbol& x) { return call("cos", {x}); }
    friend Symbol fmod(const Symbol& x, const Symbol& y) { return call("fmod", {x, y}); }

    /// f(x, ...) by its name.
    static Symbol call(const char* function, std::initializer_list<Symbol> x);

  private:
    static Symbol binary(const char* op, const Symbol& x, const Symbol& y);
    static bool compared(const char* op, const Symbol& x, const Symbol& y);
    bool counts() const { return term_->type && is_whole(*term_->type); }
    static Symbol exact(const char* function, double (*f)(double), const Symbol& x);

    TermPtr term_;
};

} // namespace bf::codegen

template <> struct std::numeric_limits<bf::codegen::Symbol> {
    static constexpr bool is_specialized = true;
    template <class F> static bf::codegen::Symbol of_real(F limit) {
        return bf::codegen::real_type() == bf::Type::float32 ? static_cast<double>(limit(float()))
                                                             : limit(double());
    }
    static bf::codegen::Symbol epsilon() {
        return of_real([]<class T>(T) { return std::numeric_limits<T>::epsilon(); });
    }
    static bf::codegen::Symbol min() {
        return of_real([]<class T>(T) { return std::numeric_limits<T>::min(); });
    }
    static bf::codegen::Symbol max() {
        return of_real([]<class T>(T) { return std::numeric_limits<T>::max(); });
    }
};

namespace bf::kernels {

// Of whole numbers these wrap around, and are calls; of real ones they are operators.
template <> inline constexpr bool is_real<codegen::Symbol> = true;
#define BF_CALL(function)                                                                                    \
    template <>                                                                                              \
    inline codegen::Symbol function<codegen::Symbol>(codegen::Symbol x, codegen::Symbol y) noexcept {        \
        return codegen::Symbol::call(#function, {x, y});                                                     \
    }
BF_CALL(add)
BF_CALL(subtract)
BF_CALL(multiply)
BF_CALL(divide)
BF_CALL(maximum)
BF_CALL(minimum)
BF_CALL(modulo)
BF_CALL(remainder)
BF_CALL(power)
#undef BF_CALL
#define BF_CALL(function)                                                                                    \
    template <> inline codegen::Symbol function<codegen::Symbol>(codegen::Symbol x) noexcept {               \
        return codegen::Symbol::call(#function, {x});                                                        \
    }
BF_CALL(negate)
BF_CALL(absolute)
#undef BF_CALL
template <> inline codegen::Symbol opaque<codegen::Symbol>(codegen::Symbol x) noexcept { return x; }
template <> inline const codegen::Symbol pi<codegen::Symbol>{pi<double>};
template <>
inline codegen::Symbol clamp<codegen::Symbol>(codegen::Symbol x, codegen::Symbol lower,
                                              codegen::Symbol upper) noexcept {
    return codegen::Symbol::call("clamp", {x, lower, upper});
}

// The functions of <cmath> keep what hides them from compilers.
#define BF_CALL(kernel, function)                                                                            \
    template <> inline codegen::Symbol kernel::apply<codegen::Symbol>(codegen::Symbol x) noexcept {          \
        return codegen::Symbol::call(#function, {x});                                                        \
    }
BF_CALL(Sqrt, sqrt)
BF_CALL(SignedSqrt, signed_sqrt)
BF_CALL(ReciprocalSqrt, reciprocal_sqrt)
BF_CALL(Exp, exp)
BF_CALL(Log, log)
BF_CALL(Log10, log10)
BF_CALL(Pow10, pow10)
BF_CALL(Sin, sin)
BF_CALL(Cos, cos)
BF_CALL(Tan, tan)
BF_CALL(Asin, asin)
BF_CALL(Acos, acos)
BF_CALL(Atan, atan)
BF_CALL(Sinh, sinh)
BF_CALL(Cosh, cosh)
BF_CALL(Tanh, tanh)
BF_CALL(Asinh, asinh)
BF_CALL(Acosh, acosh)
BF_CALL(Atanh, atanh)
BF_CALL(Floor, floor)
BF_CALL(Ceil, ceil)
BF_CALL(Round, round)
BF_CALL(Fix, fix)
#undef BF_CALL
template <>
inline codegen::Symbol Atan2::apply<codegen::Symbol>(codegen::Symbol y, codegen::Symbol x) noexcept {
    return codegen::Symbol::call("atan2", {y, x});
}
template <>
inline codegen::Symbol Hypot::apply<codegen::Symbol>(codegen::Symbol a, codegen::Symbol b) noexcept {
    return codegen::Symbol::call("hypot", {a, b});
}

} // namespace bf::kernels
