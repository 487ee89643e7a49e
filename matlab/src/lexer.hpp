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
    Command, ///< a line in command syntax, `text` is all of it
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
/// transposes. `is_script` admits command syntax (`clear a b`) at the start of a statement.
std::vector<Token> lex(const std::shared_ptr<const Source>& source, bool is_script);

} // namespace bf::matlab
