// Actions as lists of statements.
#pragma once

#include <string>
#include <vector>

namespace bf::charts {

struct Statement {
    enum class Kind { assign, raise, send, cancel, if_, elseif, else_, end };
    Kind kind = Kind::assign;
    std::string name = {};    ///< of the variable or event
    std::string formula = {}; ///< value, delay or condition
};

/// Throws std::invalid_argument with what is wrong.
std::vector<Statement> statements_of(const std::string& action);

/// Where an assignment's or event's name stands alone: letters, digits and `_`, for events `.`, too.
bool is_identifier(const std::string& text, bool may_have_dots = false);

/// `a` is meant by a, a. and a.*
std::string bare_event(std::string wanted);

/// `a.b` happens also where `a` is awaited, and each event where `*` is.
bool matches(const std::string& wanted, const std::string& event);

std::string trimmed(const std::string& text);

} // namespace bf::charts
