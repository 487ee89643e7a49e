#include "formula.hpp"

#include "bf/base/numbers.hpp"
#include "bf/core/registry.hpp"
#include "bf/kernels/expression.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>
#include <stdexcept>

namespace bf::blocks {

namespace {

using kernels::Operation;

struct Named {
    const char* name;
    Operation operation;
    bool has_two; ///< arguments
};
constexpr std::array functions{
    Named{"abs", Operation::abs, false},    Named{"sign", Operation::sign, false},
    Named{"sqrt", Operation::sqrt, false},  Named{"exp", Operation::exp, false},
    Named{"log", Operation::log, false},    Named{"log10", Operation::log10, false},
    Named{"sin", Operation::sin, false},    Named{"cos", Operation::cos, false},
    Named{"tan", Operation::tan, false},    Named{"asin", Operation::asin, false},
    Named{"acos", Operation::acos, false},  Named{"atan", Operation::atan, false},
    Named{"sinh", Operation::sinh, false},  Named{"cosh", Operation::cosh, false},
    Named{"tanh", Operation::tanh, false},  Named{"floor", Operation::floor, false},
    Named{"ceil", Operation::ceil, false},  Named{"round", Operation::round, false},
    Named{"fix", Operation::fix, false},    Named{"min", Operation::minimum, true},
    Named{"max", Operation::maximum, true}, Named{"atan2", Operation::atan2, true},
    Named{"hypot", Operation::hypot, true}, Named{"mod", Operation::mod, true},
    Named{"rem", Operation::rem, true},     Named{"power", Operation::power, true}};

/// Binary operators from the weakest level to the strongest; longer ones first within a level.
struct Operator {
    const char* text;
    Operation operation;
};
const std::array<std::vector<Operator>, 5> levels{
    {{{"||", Operation::logical_or}, {"|", Operation::logical_or}},
     {{"&&", Operation::logical_and}, {"&", Operation::logical_and}},
     {{"<=", Operation::less_equal},
      {">=", Operation::greater_equal},
      {"==", Operation::equal},
      {"~=", Operation::not_equal},
      {"!=", Operation::not_equal},
      {"<", Operation::less},
      {">", Operation::greater}},
     {{"+", Operation::plus}, {"-", Operation::minus}},
     {{".*", Operation::times}, {"./", Operation::over}, {"*", Operation::times}, {"/", Operation::over}}}};

class Compiler {
  public:
    explicit Compiler(const std::string& text) : text_(text) {}

    Formula compile() {
        binary(0);
        if (!rest().empty()) misplaced();
        return std::move(formula_);
    }

  private:
    [[noreturn]] void refuse(const std::string& what) {
        rest();
        throw std::invalid_argument("'" + text_ + "', character " + std::to_string(at_ + 1) + ": " + what);
    }

    [[noreturn]] void misplaced() {
        std::string mark = "' '";
        mark[1] = rest().front();
        refuse(mark + " does not belong there");
    }

    /// What is left, from its first mark on.
    std::string_view rest() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) ++at_;
        return std::string_view(text_).substr(at_);
    }
    bool take(std::string_view mark) {
        if (!rest().starts_with(mark)) return false;
        at_ += mark.size();
        return true;
    }
    void need(std::string_view mark) {
        if (!take(mark)) refuse("'" + std::string(mark) + "' is missing");
    }

    void push(Operation operation, double operand = 0, int index = 0) {
        if (operation < Operation::negative && ++height_ > kernels::Expression::depth)
            refuse("it nests too deeply; split it into two blocks");
        if (operation >= Operation::plus) --height_;
        formula_.edges += kernels::detail::has_edges(operation);
        formula_.code.insert(formula_.code.end(), {static_cast<double>(operation), operand, double(index)});
    }

    void binary(std::size_t level) {
        if (level == levels.size()) return unary();
        binary(level + 1);
        while (const Operator* found = operator_of(level)) {
            binary(level + 1);
            push(found->operation);
        }
    }
    const Operator* operator_of(std::size_t level) {
        for (const auto& candidate : levels[level])
            if (take(candidate.text)) return &candidate;
        return nullptr;
    }

    void unary() {
        if (++nesting_ > 200) refuse("it nests too deeply; split it into two blocks");
        if (take("-")) {
            unary();
            push(Operation::negative);
        } else if (take("+")) {
            unary();
        } else if (take("~") || take("!")) {
            unary();
            push(Operation::logical_not);
        } else {
            power();
        }
        --nesting_;
    }

    /// Binds more tightly than a sign before it, less than one behind it: -2^-1 is -(2^(-1)).
    void power() {
        primary();
        while (take(".^") || take("^")) {
            const bool is_negative = take("-");
            if (!is_negative) take("+");
            primary();
            if (is_negative) push(Operation::negative);
            push(Operation::power);
        }
    }

    void primary() {
        if (take("(")) {
            binary(0);
            return need(")");
        }
        const auto text = rest();
        if (text.empty()) refuse("an operand is missing");
        if ((text.front() >= '0' && text.front() <= '9') || text.front() == '.') return number();
        const auto is_letter = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
        };
        std::size_t length = 0;
        while (length < text.size() &&
               (is_letter(text[length]) || (length > 0 && text[length] >= '0' && text[length] <= '9')))
            ++length;
        if (length == 0) misplaced();
        const std::string name(text.substr(0, length));
        const std::size_t begin = at_;
        at_ += length;
        if (!constant(name) && !input(name) && !function(name)) {
            at_ = begin;
            unknown(name);
        }
    }

    void number() {
        double value = 0;
        const char* begin = text_.data() + at_;
        const auto result = read_number(begin, text_.data() + text_.size(), value);
        if (result.ec != std::errc()) refuse("this is no number");
        at_ += static_cast<std::size_t>(result.ptr - begin);
        push(Operation::number, value);
    }

    bool constant(const std::string& name) {
        if (name != "pi" && name != "true" && name != "false") return false;
        push(Operation::number, name == "pi" ? std::numbers::pi : name == "true");
        return true;
    }

    /// u, u2, u(3), u2(3), and p(1).
    bool input(const std::string& name) {
        if (name == "p") {
            const int index = rest().starts_with('(') ? subscript() : 1;
            formula_.parameters = std::max(formula_.parameters, index);
            push(Operation::parameter, index - 1);
            return true;
        }
        if (name.front() != 'u') return false;
        int number = 1;
        if (name.size() > 1) {
            const auto result = std::from_chars(name.data() + 1, name.data() + name.size(), number);
            if (result.ptr != name.data() + name.size()) return false;
            if (number < 1 || number > 1000) refuse("inputs are u1 to u1000");
            formula_.is_single = false;
        } else {
            has_u_ = true;
        }
        formula_.inputs = std::max(formula_.inputs, number);
        if (has_u_ && (formula_.inputs > 1 || !formula_.is_single))
            refuse("there is one input u, or u1, u2, ...; not both");
        formula_.whole.resize(static_cast<std::size_t>(formula_.inputs));
        formula_.elements.resize(formula_.whole.size());
        const auto position = static_cast<std::size_t>(number) - 1;
        if (!rest().starts_with('(')) {
            formula_.whole[position] = true;
            push(Operation::element, number - 1);
        } else {
            const int index = subscript();
            formula_.elements[position] = std::max(formula_.elements[position], index);
            push(Operation::fixed, number - 1, index - 1);
        }
        return true;
    }

    int subscript() {
        need("(");
        int index = 0;
        rest();
        const char* begin = text_.data() + at_;
        const auto result = std::from_chars(begin, text_.data() + text_.size(), index);
        if (result.ec != std::errc() || index < 1) refuse("elements are counted by whole numbers from 1");
        at_ += static_cast<std::size_t>(result.ptr - begin);
        need(")");
        return index;
    }

    bool function(const std::string& name) {
        const auto* found =
            std::find_if(functions.begin(), functions.end(), [&](const Named& f) { return f.name == name; });
        if (found == functions.end()) return false;
        need("(");
        binary(0);
        if (found->has_two) {
            need(",");
            binary(0);
        }
        need(")");
        push(found->operation);
        return true;
    }

    [[noreturn]] void unknown(const std::string& name) {
        std::vector<std::string> known{"u", "p", "pi", "true", "false"};
        for (const auto& f : functions) known.emplace_back(f.name);
        refuse("there is no '" + name + "'" + did_you_mean(name, known) +
               "; inputs are u or u1, u2, ..., parameters p(1), p(2), ...");
    }

    const std::string& text_;
    std::size_t at_ = 0;
    int height_ = 0, nesting_ = 0;
    bool has_u_ = false;
    Formula formula_;
};

} // namespace

Formula formula(const std::string& text) { return Compiler(text).compile(); }

} // namespace bf::blocks
