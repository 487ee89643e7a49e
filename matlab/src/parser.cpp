#include "bf/matlab/syntax.hpp"

#include "bf/base/value_text.hpp"
#include "lexer.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

constexpr int deepest_recursion = 120; // of the parser
constexpr int deepest_tree = 500;      // of an expression; a chain of operators is as deep as it is long

struct Infix {
    std::string_view text;
    int precedence; // higher binds tighter; all are left associative
    Operator op;
};
constexpr int range_precedence = 6;
constexpr Infix infixes[] = {
    {"||", 1, Operator::OrElse},
    {"&&", 2, Operator::AndAlso},
    {"|", 3, Operator::Or},
    {"&", 4, Operator::And},
    {"==", 5, Operator::Equal},
    {"~=", 5, Operator::NotEqual},
    {"<", 5, Operator::Less},
    {"<=", 5, Operator::LessEqual},
    {">", 5, Operator::Greater},
    {">=", 5, Operator::GreaterEqual},
    {":", range_precedence, Operator::None},
    {"+", 7, Operator::Plus},
    {"-", 7, Operator::Minus},
    {"*", 8, Operator::Mtimes},
    {".*", 8, Operator::Times},
    {"/", 8, Operator::Mrdivide},
    {"./", 8, Operator::Rdivide},
    {"\\", 8, Operator::Mldivide},
    {".\\", 8, Operator::Ldivide},
};

class Parser {
  public:
    Parser(std::string_view text, const Location& start)
        : source_(std::make_shared<const Source>(Source{std::string(text), start})), tokens_(lex(source_)) {}

    ExpressionPtr whole_expression() {
        skip_newlines();
        if (peek().kind == TokenKind::Finish) fail("expected an expression, found nothing");
        ExpressionPtr result = expression();
        skip_newlines();
        if (is("=")) fail("'=' assigns; compare with '=='");
        if (at_ > 0 && tokens_[at_ - 1].kind == TokenKind::Number && peek().kind == TokenKind::Name)
            fail("expected the end of the expression, found " + found() + "; write units in a comment");
        if (peek().kind != TokenKind::Finish) fail("expected the end of the expression, found " + found());
        return result;
    }

  private:
    /// Counts recursion while it lives.
    struct Level {
        explicit Level(Parser& p) : parser(p) {
            if (++parser.recursion_ > deepest_recursion)
                parser.fail("the text nests deeper than " + std::to_string(deepest_recursion) + " levels");
        }
        ~Level() { --parser.recursion_; }
        Parser& parser;
    };

    /// Sets a variable while it lives.
    template <typename T> struct Scoped {
        Scoped(T& v, T value) : variable(v), before(std::exchange(v, value)) {}
        ~Scoped() { variable = before; }
        T& variable;
        T before;
    };

    const Token& peek(std::size_t ahead = 0) const {
        return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
    }
    bool is(std::string_view symbol, std::size_t ahead = 0) const {
        return peek(ahead).kind == TokenKind::Symbol && peek(ahead).text == symbol;
    }
    bool accept(std::string_view symbol) { return is(symbol) && ++at_; }

    std::string found() const {
        switch (peek().kind) {
        case TokenKind::Finish: return "the end of the text";
        case TokenKind::Newline: return "the end of the line";
        default:
            return "'" + std::string(source_->text.substr(peek().begin, peek().end - peek().begin)) + "'";
        }
    }
    [[noreturn]] void fail(const std::string& message) const {
        throw Error(message, Span{source_, peek().begin, peek().end});
    }
    void expect(std::string_view symbol, std::string_view where) {
        if (!accept(symbol))
            fail("expected '" + std::string(symbol) + "' " + std::string(where) + ", found " + found());
    }
    std::string name(std::string_view what) {
        if (peek().kind != TokenKind::Name) fail("expected " + std::string(what) + ", found " + found());
        return tokens_[at_++].text;
    }

    void skip_newlines() {
        while (peek().kind == TokenKind::Newline) ++at_;
    }

    Span span_from(std::size_t first) const {
        return {source_, tokens_[first].begin,
                std::max(tokens_[first].begin, tokens_[at_ > first ? at_ - 1 : first].end)};
    }

    ExpressionPtr make(Kind kind, std::size_t first, std::vector<ExpressionPtr> parts,
                       Operator op = Operator::None, std::string text = {}) {
        auto node = std::make_shared<Expression>();
        node->kind = kind;
        node->op = op;
        node->span = span_from(first);
        node->name = std::move(text);
        for (const ExpressionPtr& part : parts) node->depth = std::max(node->depth, part->depth + 1);
        if (node->depth > deepest_tree)
            throw Error("the expression has more than " + std::to_string(deepest_tree) +
                            " levels; split it over several variables",
                        node->span);
        node->parts = std::move(parts);
        return node;
    }

    ExpressionPtr expression(int precedence = 1) {
        const Level level(*this);
        const std::size_t first = at_;
        ExpressionPtr left = unary();
        while (const Infix* infix = next_infix(precedence)) {
            ++at_;
            skip_line_in_parentheses();
            ExpressionPtr right = expression(infix->precedence + 1);
            if (infix->precedence == range_precedence) {
                std::vector<ExpressionPtr> parts{left, right};
                if (is(":") && next_infix(range_precedence)) {
                    ++at_;
                    parts.push_back(expression(range_precedence + 1));
                }
                left = make(Kind::Range, first, std::move(parts));
            } else {
                left = make(Kind::Binary, first, {left, right}, infix->op);
            }
        }
        return left;
    }

    void skip_line_in_parentheses() {
        if (peek().kind == TokenKind::Newline && !in_matrix_)
            fail("the expression ends after an operator; continue a line with '...'");
    }

    const Infix* next_infix(int precedence) const {
        const Token& token = peek();
        if (token.kind != TokenKind::Symbol) return nullptr;
        // [a -b] has two elements, [a - b] and [a-b] have one
        if (in_matrix_ && token.blank_before && (token.text == "+" || token.text == "-") &&
            !peek(1).blank_before && peek(1).kind != TokenKind::Newline)
            return nullptr;
        for (const Infix& infix : infixes)
            if (infix.text == token.text) return infix.precedence >= precedence ? &infix : nullptr;
        return nullptr;
    }

    static Operator prefix_operator(const Token& token) {
        if (token.kind != TokenKind::Symbol) return Operator::None;
        if (token.text == "-") return Operator::UnaryMinus;
        if (token.text == "+") return Operator::UnaryPlus;
        return token.text == "~" ? Operator::Not : Operator::None;
    }

    /// Prefix operators before what `operand` parses.
    ExpressionPtr prefixed(ExpressionPtr (Parser::*operand)()) {
        const std::size_t first = at_;
        const Operator op = prefix_operator(peek());
        if (op == Operator::None) return (this->*operand)();
        const Level level(*this);
        ++at_;
        ExpressionPtr inner = prefixed(operand);
        return make(Kind::Unary, first, {std::move(inner)}, op);
    }

    ExpressionPtr unary() { return prefixed(&Parser::power); }

    /// Transpose and power share one precedence: 2^x' is (2^x)', 2^3^2 is (2^3)^2, 2^-1 is allowed.
    ExpressionPtr power() {
        const std::size_t first = at_;
        ExpressionPtr left = postfix();
        for (;;) {
            if (accept("'") || accept(".'")) {
                left = make(Kind::Unary, first, {left}, Operator::Transpose);
            } else if (is("^") || is(".^")) {
                const Operator op = is("^") ? Operator::Mpower : Operator::Power;
                ++at_;
                ExpressionPtr exponent = prefixed(&Parser::postfix);
                left = make(Kind::Binary, first, {left, exponent}, op);
            } else {
                return left;
            }
        }
    }

    ExpressionPtr postfix() {
        const std::size_t first = at_;
        ExpressionPtr base = primary();
        for (;;) {
            const bool separate = in_matrix_ && peek().blank_before;
            if (is("(") && !separate) {
                base = make_index(Kind::Index, first, base, ")");
            } else if (is("{") && !separate) {
                base = make_index(Kind::CellIndex, first, base, "}");
            } else if (is(".") && is("(", 1)) {
                at_ += 2;
                const Scoped matrix(in_matrix_, false);
                ExpressionPtr field = expression();
                expect(")", "after the field name");
                base = make(Kind::DynamicField, first, {base, field});
            } else if (accept(".")) {
                std::string field = name("a field name");
                base = make(Kind::Field, first, {base}, Operator::None, std::move(field));
            } else {
                return base;
            }
        }
    }

    ExpressionPtr make_index(Kind kind, std::size_t first, const ExpressionPtr& base,
                             std::string_view closer) {
        ++at_;
        const Scoped matrix(in_matrix_, false);
        const Scoped index(in_index_, true);
        std::vector<ExpressionPtr> parts{base};
        if (closer == "}") skip_newlines();
        while (!is(closer)) {
            if (is(":") && (is(",", 1) || is(closer, 1))) {
                ++at_;
                parts.push_back(make(Kind::Colon, at_ - 1, {}));
            } else {
                parts.push_back(expression());
            }
            if (closer == "}") skip_newlines();
            if (is("=")) fail("'=' assigns; compare with '=='");
            if (!is(closer)) {
                expect(",", "between arguments");
                if (is(closer)) fail("expected an argument after ','");
            }
        }
        ++at_;
        return make(kind, first, std::move(parts));
    }

    ExpressionPtr primary() {
        const std::size_t first = at_;
        const Token& token = peek();
        switch (token.kind) {
        case TokenKind::Number:
        case TokenKind::Text: {
            ++at_;
            auto node = std::make_shared<Expression>();
            node->span = span_from(first);
            node->value =
                token.kind == TokenKind::Number ? number(token) : Value(std::string_view(token.text));
            return node;
        }
        case TokenKind::Name: ++at_; return make(Kind::Name, first, {}, Operator::None, token.text);
        case TokenKind::Keyword:
            if (token.text != "end") break;
            if (!in_index_) fail("'end' stands for the last index only inside an index");
            ++at_;
            return make(Kind::End, first, {});
        case TokenKind::Symbol:
            if (token.text == "(") return parentheses();
            if (token.text == "[") return matrix(Kind::Matrix, "]");
            if (token.text == "{") return matrix(Kind::Cell, "}");
            if (token.text == "@") return handle();
            break;
        default: break;
        }
        const bool is_power = is("*") && at_ > 0 && tokens_[at_ - 1].text == "*";
        fail("expected a value, found " + found() + (is_power ? "; a power is written with '^'" : ""));
    }

    static Value number(const Token& token) {
        double x = 0;
        static_cast<void>(read_value(token.text, x)); // the lexer saw that it is one
        return x;
    }

    ExpressionPtr parentheses() {
        ++at_;
        const Scoped matrix(in_matrix_, false);
        ExpressionPtr inner = expression();
        if (is("=")) fail("'=' assigns; compare with '=='");
        expect(")", "to close the parenthesis");
        return inner;
    }

    ExpressionPtr matrix(Kind kind, std::string_view closer) {
        const std::size_t first = at_++;
        const Scoped inside(in_matrix_, true);
        std::vector<ExpressionPtr> rows;
        while (!is(closer)) {
            if (accept(";") || peek().kind == TokenKind::Newline) {
                skip_newlines();
                continue;
            }
            const std::size_t row_first = at_;
            std::vector<ExpressionPtr> elements;
            while (!is(closer) && !is(";") && peek().kind != TokenKind::Newline) {
                if (!elements.empty() && !accept(",") && !peek().blank_before)
                    fail("expected ',', ';' or '" + std::string(closer) + "' after an element, found " +
                         found());
                if (is(closer) || is(";") || peek().kind == TokenKind::Newline) break; // a trailing comma
                elements.push_back(expression());
                if (is("=")) fail("'=' assigns; compare with '=='");
            }
            rows.push_back(make(Kind::Row, row_first, std::move(elements)));
        }
        ++at_;
        return make(kind, first, std::move(rows));
    }

    ExpressionPtr handle() {
        const std::size_t first = at_++;
        if (!accept("(")) {
            std::string target = name("a function name or '(' after '@'");
            while (accept(".")) target += "." + name("a function name after '.'");
            return make(Kind::Handle, first, {}, Operator::None, std::move(target));
        }
        std::vector<std::string> parameters = parameter_list();
        const Scoped index(in_index_, false);
        auto node = std::make_shared<Expression>(*make(Kind::Lambda, first, {expression()}));
        node->parameters = std::move(parameters);
        return node;
    }

    /// The names up to `)`, whose `(` is behind us.
    std::vector<std::string> parameter_list() {
        std::vector<std::string> names;
        while (!accept(")")) {
            if (!names.empty()) expect(",", "between parameters");
            names.push_back(accept("~") ? "~" : name("a parameter name"));
        }
        return names;
    }

    std::shared_ptr<const Source> source_;
    std::vector<Token> tokens_;
    std::size_t at_ = 0;
    int recursion_ = 0;
    bool in_matrix_ = false; // directly inside [] or {}, where blanks separate
    bool in_index_ = false;  // where `end` is an index
};

} // namespace

ExpressionPtr parse_expression(std::string_view text, const Location& start) {
    return Parser(text, start).whole_expression();
}

} // namespace bf::matlab
