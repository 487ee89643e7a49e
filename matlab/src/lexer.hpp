#pragma once

#include "bf/matlab/error.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace bf::matlab {

enum class TokenKind : std::uint8_t {
    Number,
    Text, ///< a literal in quotes; `text` is without them
    Name,
    Keyword,
    Symbol,  ///< operators, brackets, `,`, `;`, and transposes
    Newline, ///< outside parentheses; a row separator inside `[]` and `{}`
    Finish,
};

struct Token {
    TokenKind kind;
    std::string text;
    std::size_t begin;
    std::size_t end;
    bool blank_before; ///< blanks, comments or a continuation precede it
};

/// All tokens of a source. Comments are gone, `...` continuations joined, quotes told apart from
/// transposes.
std::vector<Token> lex(const std::shared_ptr<const Source>& source);

} // namespace bf::matlab
