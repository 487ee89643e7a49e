#include "lexer.hpp"

#include "bf/base/value_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace bf::matlab {
namespace {

constexpr std::array<std::string_view, 25> keywords{
    "break",      "case",   "catch",    "classdef",      "continue", "else",      "elseif",
    "end",        "for",    "function", "global",        "if",       "otherwise", "parfor",
    "persistent", "return", "spmd",     "switch",        "try",      "while",     "endfunction",
    "endif",      "endfor", "endwhile", "unwind_protect"};

constexpr std::array<std::string_view, 35> symbols{
    // longer ones first
    "==", "~=", "!=", "!", "<=", ">=", "&&", "||", ".*", "./", ".\\", ".^", ".'", "+", "-", "*", "/", "\\",
    "^",  "<",  ">",  "&", "|",  "~",  "=",  "(",  ")",  "[",  "]",   "{",  "}",  ",", ";", ":", "@"};

constexpr std::size_t deepest_brackets = 100;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool is_word(char c) { return is_letter(c) || is_digit(c); }

class Lexer {
  public:
    explicit Lexer(const std::shared_ptr<const Source>& source) : source_(source), text_(source->text) {}

    std::vector<Token> run() {
        for (;;) {
            blank_ = skip_blanks();
            if (at_ == text_.size()) break;
            lex_token();
        }
        if (!open_.empty())
            fail("this '" + std::string(1, text_[open_.back()]) + "' is never closed", open_.back(),
                 open_.back() + 1);
        push(TokenKind::Finish, "", at_);
        return std::move(tokens_);
    }

  private:
    [[noreturn]] void fail(const std::string& message, std::size_t begin, std::size_t end) const {
        throw Error(message, Span{source_, begin, std::min(end, text_.size())});
    }

    char peek(std::size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
    char opened() const { return open_.empty() ? '\0' : text_[open_.back()]; }
    bool in_matrix() const { return opened() == '[' || opened() == '{'; }

    void push(TokenKind kind, std::string text, std::size_t begin) {
        tokens_.push_back({kind, std::move(text), begin, at_, blank_});
    }

    std::size_t line_end(std::size_t from) const { return std::min(text_.find('\n', from), text_.size()); }

    /// Whether only `marker` (`%{` or `%}`) stands on the line that holds position `from`.
    bool alone_on_line(std::size_t from, std::string_view marker) const {
        std::size_t begin = from == 0 ? 0 : text_.rfind('\n', from - 1);
        begin = begin == std::string_view::npos ? 0 : begin;
        std::string_view line = text_.substr(begin, line_end(from) - begin);
        const auto strip = [](char c) { return is_blank(c) || c == '\n'; };
        while (!line.empty() && strip(line.front())) line.remove_prefix(1);
        while (!line.empty() && strip(line.back())) line.remove_suffix(1);
        return line == marker;
    }

    void skip_block_comment() {
        const std::size_t begin = at_;
        int depth = 0;
        do {
            if (at_ >= text_.size()) fail("this '%{' is never closed by '%}'", begin, begin + 2);
            const std::size_t end = line_end(at_);
            const std::size_t mark = text_.substr(0, end).find('%', at_);
            if (mark != std::string_view::npos) {
                if (alone_on_line(mark, "%{")) ++depth;
                if (alone_on_line(mark, "%}")) --depth;
            }
            at_ = std::min(end + 1, text_.size());
        } while (depth > 0);
    }

    /// Skips blanks, comments and continuations; returns whether there were any.
    bool skip_blanks() {
        const std::size_t begin = at_;
        for (;;) {
            if (is_blank(peek())) {
                ++at_;
            } else if (peek() == '%') {
                if (peek(1) == '{' && alone_on_line(at_, "%{"))
                    skip_block_comment();
                else
                    at_ = line_end(at_);
            } else if (text_.substr(at_).starts_with("...")) {
                at_ = std::min(line_end(at_) + 1, text_.size());
            } else if (peek() == '\n' && opened() == '(' && in_outer_matrix()) {
                ++at_;
            } else {
                return at_ > begin;
            }
        }
    }

    /// Inside parentheses that stand in a matrix, a new line is only a blank.
    bool in_outer_matrix() const {
        return std::ranges::any_of(open_, [this](std::size_t p) { return text_[p] != '('; });
    }

    bool after_value() const {
        if (tokens_.empty()) return false;
        const Token& last = tokens_.back();
        if (last.kind == TokenKind::Symbol)
            return last.text == ")" || last.text == "]" || last.text == "}" || last.text == "'" ||
                   last.text == ".'";
        return last.kind == TokenKind::Number || last.kind == TokenKind::Name ||
               last.kind == TokenKind::Text ||
               (last.kind == TokenKind::Keyword && last.text == "end" && !open_.empty());
    }

    void lex_token() {
        const std::size_t begin = at_;
        const char c = peek();
        if (c == '\n') {
            if (opened() == '(')
                fail("this '(' is not closed on its line; continue a line with '...'", open_.back(), at_);
            ++at_;
            push(TokenKind::Newline, "\n", begin);
        } else if (is_letter(c)) {
            lex_word();
        } else if (is_digit(c) || (c == '.' && is_digit(peek(1)))) {
            lex_number();
        } else if (c == '"') {
            lex_text('"');
        } else if (c == '\'') {
            if (after_value() && !(blank_ && in_matrix())) {
                ++at_;
                push(TokenKind::Symbol, "'", begin);
            } else {
                lex_text('\'');
            }
        } else if (c == '.' && (is_letter(peek(1)) || peek(1) == '(')) {
            ++at_;
            push(TokenKind::Symbol, ".", begin);
        } else {
            lex_symbol();
        }
    }

    void lex_word() {
        const std::size_t begin = at_;
        while (is_word(peek())) ++at_;
        const std::string word(text_.substr(begin, at_ - begin));
        const bool is_field =
            !tokens_.empty() && tokens_.back().kind == TokenKind::Symbol && tokens_.back().text == ".";
        const bool is_keyword = !is_field && std::ranges::find(keywords, word) != keywords.end();
        push(is_keyword ? TokenKind::Keyword : TokenKind::Name, word, begin);
    }

    void lex_number() {
        const std::size_t begin = at_;
        while (is_digit(peek())) ++at_;
        // in `1./x`, `1.*x`, `1.^x` and `1.'` the point belongs to the operator
        if (peek() == '.' && std::string_view("*/\\^'").find(peek(1)) == std::string_view::npos &&
            !(peek(1) == '.' && peek(2) == '.')) {
            ++at_;
            while (is_digit(peek())) ++at_;
        }
        std::string digits(text_.substr(begin, at_ - begin));
        const bool exponent =
            std::string_view("eEdD").find(peek()) != std::string_view::npos && peek() != '\0';
        const std::size_t sign = peek(1) == '+' || peek(1) == '-' ? 1 : 0;
        if (exponent && is_digit(peek(1 + sign))) {
            const std::size_t from = at_ + 1;
            at_ += 1 + sign;
            while (is_digit(peek())) ++at_;
            digits += "e" + std::string(text_.substr(from, at_ - from));
        }
        if (is_word(peek())) {
            const std::string_view unit = text_.substr(at_, 1);
            while (is_word(peek())) ++at_;
            if (at_ - begin == digits.size() + 1 && (unit == "i" || unit == "j"))
                fail("complex numbers are not supported; compute with real and imaginary parts of their own",
                     begin, at_);
            fail(
                "a number ends before a letter; write '*' to multiply; hexadecimal numbers are not supported",
                begin, at_);
        }
        double value = 0;
        if (const std::string wrong = read_value(digits, value); !wrong.empty()) fail(wrong, begin, at_);
        push(TokenKind::Number, digits, begin);
    }

    void lex_text(char quote) {
        const std::size_t begin = at_++;
        std::string content;
        for (;; ++at_) {
            if (at_ == text_.size() || peek() == '\n')
                fail(std::string("this text has no closing ") + quote, begin, at_);
            if (peek() == quote) {
                if (peek(1) != quote) break;
                ++at_;
            }
            content += peek();
        }
        ++at_;
        push(TokenKind::Text, content, begin);
    }

    void lex_symbol() {
        const std::size_t begin = at_;
        const auto symbol = std::ranges::find_if(
            symbols, [&](std::string_view s) { return text_.substr(at_).starts_with(s); });
        if (symbol == symbols.end()) {
            const auto code = static_cast<unsigned char>(peek());
            fail(code > ' ' && code < 127 ? "unexpected character"
                                          : "unexpected character with code " + std::to_string(code),
                 begin, begin + 1);
        }
        at_ += symbol->size();
        if (*symbol == "(" || *symbol == "[" || *symbol == "{") open_.push_back(begin);
        if (open_.size() > deepest_brackets)
            fail("brackets nest deeper than " + std::to_string(deepest_brackets) + " levels", begin, at_);
        if (*symbol == ")" || *symbol == "]" || *symbol == "}") {
            const char opener = *symbol == ")" ? '(' : *symbol == "]" ? '[' : '{';
            if (opened() != opener)
                fail("this '" + std::string(*symbol) + "' closes nothing; expected a '" + opener +
                         "' before it",
                     begin, at_);
            open_.pop_back();
        }
        const bool is_negation = symbol->front() == '!'; // as Octave writes '~'
        push(TokenKind::Symbol, is_negation ? "~" + std::string(symbol->substr(1)) : std::string(*symbol),
             begin);
    }

    std::shared_ptr<const Source> source_;
    std::string_view text_;
    std::size_t at_ = 0;
    bool blank_ = false;
    std::vector<std::size_t> open_; // positions of the open brackets
    std::vector<Token> tokens_;
};

} // namespace

std::vector<Token> lex(const std::shared_ptr<const Source>& source) { return Lexer(source).run(); }

} // namespace bf::matlab
