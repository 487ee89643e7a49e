#include "bf/matlab/syntax.hpp"

#include "bf/base/value_text.hpp"
#include "lexer.hpp"

#include <algorithm>
#include <sstream>

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
    Parser(std::string_view text, const Location& start, bool is_script)
        : source_(std::make_shared<const Source>(Source{std::string(text), start})),
          tokens_(lex(source_, is_script)) {}

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

    std::shared_ptr<const Program> program() {
        auto result = std::make_shared<Program>();
        for (;;) {
            Block more = block();
            std::ranges::move(more, std::back_inserter(result->statements));
            if (peek().kind == TokenKind::Finish) return result;
            if (!is_keyword("function")) fail("this " + found() + " belongs to no open block");
            result->functions.push_back(function());
        }
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
    bool is_keyword(std::string_view word) const {
        return peek().kind == TokenKind::Keyword && peek().text == word;
    }
    bool accept(std::string_view symbol) { return is(symbol) && ++at_; }
    bool accept_keyword(std::string_view word) { return is_keyword(word) && ++at_; }

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
    bool is_separator() const { return is(";") || is(",") || peek().kind == TokenKind::Newline; }

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

    // Expressions

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

    // Statements

    Block block() {
        Block statements;
        for (;;) {
            while (is_separator()) ++at_;
            static constexpr std::string_view closers[] = {"end",  "else",      "elseif",
                                                           "case", "otherwise", "function"};
            if (peek().kind == TokenKind::Finish) return statements;
            if (peek().kind == TokenKind::Keyword &&
                std::ranges::find(closers, peek().text) != std::end(closers))
                return statements;
            statements.push_back(statement());
        }
    }

    Statement statement() {
        const Level level(*this);
        const std::size_t first = at_;
        Statement result;
        if (peek().kind == TokenKind::Command) {
            result.kind = StatementKind::Command;
            std::istringstream words(tokens_[at_++].text);
            for (std::string word; words >> word;) result.words.push_back(word);
        } else if (peek().kind == TokenKind::Keyword) {
            keyword_statement(result);
        } else {
            assignment_or_expression(result);
        }
        result.span = span_from(first);
        if (!is_separator() && peek().kind != TokenKind::Finish && !is_keyword("end"))
            fail("expected the end of the statement, found " + found());
        return result;
    }

    void keyword_statement(Statement& result) {
        const std::size_t first = at_;
        const std::string word = tokens_[at_++].text;
        if (word == "if") {
            result.kind = StatementKind::If;
            do result.branches.push_back(branch());
            while (accept_keyword("elseif"));
            if (accept_keyword("else")) result.branches.push_back({nullptr, block()});
            close(first);
        } else if (word == "while") {
            result.kind = StatementKind::While;
            result.branches.push_back(branch());
            close(first);
        } else if (word == "for") {
            result.kind = StatementKind::For;
            const bool parenthesis = is("(") && peek(1).kind == TokenKind::Name && is("=", 2) && accept("(");
            result.targets.push_back(target());
            expect("=", "after the loop variable");
            ExpressionPtr values = expression();
            if (parenthesis) expect(")", "after the loop's values");
            result.branches.push_back({std::move(values), block()});
            close(first);
        } else if (word == "switch") {
            result.kind = StatementKind::Switch;
            result.value = expression();
            while (is_separator()) ++at_;
            while (accept_keyword("case")) result.branches.push_back(branch());
            if (accept_keyword("otherwise")) result.branches.push_back({nullptr, block()});
            close(first);
        } else if (word == "break" || word == "continue" || word == "return") {
            result.kind = word == "break"      ? StatementKind::Break
                          : word == "continue" ? StatementKind::Continue
                                               : StatementKind::Return;
        } else if (word == "persistent") {
            result.kind = StatementKind::Persistent;
            do result.words.push_back(name("a variable name after 'persistent'"));
            while (peek().kind == TokenKind::Name);
        } else {
            --at_;
            fail("'" + word + "' is not supported");
        }
    }

    Branch branch() {
        ExpressionPtr condition = expression();
        if (is("=")) fail("'=' assigns; compare with '=='");
        return {std::move(condition), block()};
    }

    void close(std::size_t opener) {
        if (accept_keyword("end")) return;
        const Span span{source_, tokens_[opener].begin, tokens_[opener].end};
        throw Error("this '" + tokens_[opener].text + "' has no 'end'; found " + found(), span);
    }

    /// Whether `[...]` at the current token is followed by `=`.
    bool starts_multiple_assignment() const {
        if (!is("[")) return false;
        int depth = 0;
        for (std::size_t i = at_; i < tokens_.size(); ++i) {
            if (tokens_[i].kind != TokenKind::Symbol) continue;
            const std::string& text = tokens_[i].text;
            if (text == "[" || text == "(" || text == "{") ++depth;
            if (text == "]" || text == ")" || text == "}") --depth;
            if (depth == 0) return tokens_[i + 1].kind == TokenKind::Symbol && tokens_[i + 1].text == "=";
        }
        return false;
    }

    void assignment_or_expression(Statement& result) {
        if (starts_multiple_assignment()) {
            ++at_;
            const Scoped inside(in_matrix_, true);
            while (!accept("]")) {
                if (!result.targets.empty()) accept(",");
                if (is("~") && (is(",", 1) || is("]", 1))) {
                    ++at_;
                    result.targets.push_back(make(Kind::Ignored, at_ - 1, {}));
                } else {
                    result.targets.push_back(target());
                }
            }
            if (result.targets.empty()) fail("an assignment needs at least one variable on its left");
        } else {
            const std::size_t first = at_;
            ExpressionPtr left = expression();
            if (!is("=")) {
                result.value = std::move(left);
                return;
            }
            at_ = first;
            result.targets.push_back(target());
        }
        expect("=", "after the variables");
        result.kind = StatementKind::Assign;
        result.value = expression();
    }

    /// A variable, or an element or field of one.
    ExpressionPtr target() {
        const std::size_t first = at_;
        ExpressionPtr result = postfix();
        const Expression* root = result.get();
        while (root->kind == Kind::Index || root->kind == Kind::CellIndex || root->kind == Kind::Field ||
               root->kind == Kind::DynamicField)
            root = root->parts[0].get();
        if (root->kind != Kind::Name)
            throw Error("only a variable, its elements and its fields can be assigned", span_from(first));
        return result;
    }

    Function function() {
        const std::size_t first = at_++;
        Function result;
        if (accept("[")) {
            while (!accept("]")) {
                if (!result.outputs.empty()) accept(",");
                result.outputs.push_back(name("an output name"));
            }
            expect("=", "after the outputs");
        } else if (peek().kind == TokenKind::Name && is("=", 1)) {
            result.outputs.push_back(name("an output name"));
            ++at_;
        }
        result.name = name("a function name");
        if (accept("(")) result.inputs = parameter_list();
        result.span = span_from(first);
        result.body = block();
        if (!accept_keyword("end") && !is_keyword("function") && peek().kind != TokenKind::Finish)
            fail("this " + found() + " belongs to no open block");
        return result;
    }

    std::shared_ptr<const Source> source_;
    std::vector<Token> tokens_;
    std::size_t at_ = 0;
    int recursion_ = 0;
    bool in_matrix_ = false; // directly inside [] or {}, where blanks separate
    bool in_index_ = false;  // where `end` is an index
};

} // namespace

const Function* Program::find(std::string_view wanted) const {
    const auto found = std::ranges::find(functions, wanted, &Function::name);
    return found == functions.end() ? nullptr : &*found;
}

ExpressionPtr parse_expression(std::string_view text, const Location& start) {
    return Parser(text, start, false).whole_expression();
}

std::shared_ptr<const Program> parse_program(std::string_view text, const Location& start) {
    return Parser(text, start, true).program();
}

} // namespace bf::matlab
