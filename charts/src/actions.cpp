#include "actions.hpp"

#include <cctype>
#include <stdexcept>

namespace bf::charts {

namespace {

/// Parted by `;`, `,` and lines that stand in no brackets; comments begin with `%`.
std::vector<std::string> parts_of(const std::string& action) {
    std::vector<std::string> parts(1);
    int depth = 0;
    bool is_comment = false;
    for (const char c : action) {
        is_comment = (is_comment || c == '%') && c != '\n';
        if (is_comment) continue;
        depth += (c == '(' || c == '[') - (c == ')' || c == ']');
        if (depth <= 0 && (c == ';' || c == ',' || c == '\n'))
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

/// `word rest`: what stands behind the word, if it is the first one.
bool begins_with(const std::string& text, const std::string& word, std::string& rest) {
    if (!text.starts_with(word)) return false;
    if (text.size() > word.size() && (std::isalnum(static_cast<unsigned char>(text[word.size()])) != 0 ||
                                      text[word.size()] == '_' || text[word.size()] == '.'))
        return false;
    std::string found = trimmed(text.substr(word.size()));
    if (found.starts_with('=') && !found.starts_with("==")) return false; // a variable of that name
    rest = std::move(found);
    return true;
}

[[noreturn]] void refuse(const std::string& part, const std::string& why) {
    throw std::invalid_argument("'" + part + "' " + why);
}

Statement statement_of(const std::string& part) {
    using Kind = Statement::Kind;
    std::string rest;
    const auto require = [&](bool holds, const std::string& form) {
        if (!holds) refuse(part, "is no statement; write `" + form + "`");
    };
    if (begins_with(part, "raise", rest)) {
        require(is_identifier(rest, true), "raise EVENT");
        return {Kind::raise, rest, ""};
    }
    if (begins_with(part, "cancel", rest)) {
        require(is_identifier(rest, true), "cancel EVENT");
        return {Kind::cancel, rest, ""};
    }
    if (begins_with(part, "send", rest)) {
        const auto blank = rest.find(' ');
        const std::string event = rest.substr(0, blank);
        std::string delay;
        require(blank != rest.npos && is_identifier(event, true) &&
                    begins_with(trimmed(rest.substr(blank)), "after", delay) && !delay.empty(),
                "send EVENT after SECONDS");
        return {Kind::send, event, delay};
    }
    if (begins_with(part, "if", rest) || begins_with(part, "elseif", rest)) {
        require(!rest.empty(), "if FORMULA");
        return {part.starts_with("if") ? Kind::if_ : Kind::elseif, "", rest};
    }
    if (begins_with(part, "else", rest) && rest.empty()) return {Kind::else_, "", ""};
    if (begins_with(part, "end", rest) && rest.empty()) return {Kind::end, "", ""};
    const auto equals = part.find('=');
    if (equals == part.npos || equals + 1 == part.size() || part[equals + 1] == '=')
        refuse(part,
               "is no statement; write `variable = formula`, `raise event`, `send event after formula`, "
               "`cancel event` or `if formula`");
    Statement made{Kind::assign, trimmed(part.substr(0, equals)), trimmed(part.substr(equals + 1))};
    if (!is_identifier(made.name))
        refuse(part, "assigns to '" + made.name + "', which is no name of a variable");
    if (made.formula.empty()) refuse(part, "has no formula behind '='");
    return made;
}

} // namespace

std::string trimmed(const std::string& text) {
    const auto begin = text.find_first_not_of(" \t\r\n");
    return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
}

bool is_identifier(const std::string& text, bool may_have_dots) {
    if (text.empty() || (std::isalpha(static_cast<unsigned char>(text[0])) == 0 && text[0] != '_'))
        return false;
    for (const char c : text)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_' && !(may_have_dots && c == '.'))
            return false;
    return text.back() != '.';
}

std::string bare_event(std::string wanted) {
    if (wanted.ends_with(".*")) wanted.resize(wanted.size() - 2);
    if (wanted.ends_with('.')) wanted.pop_back();
    return wanted;
}

bool matches(const std::string& wanted, const std::string& event) {
    const std::string bare = bare_event(wanted);
    return wanted == "*" || event == bare || event.starts_with(bare + ".");
}

std::vector<Statement> statements_of(const std::string& action) {
    std::vector<Statement> statements;
    std::vector<bool> had_else; // of the open ifs
    for (const std::string& part : parts_of(action)) {
        const std::string text = trimmed(part);
        if (text.empty()) continue;
        Statement made = statement_of(text);
        using Kind = Statement::Kind;
        if (made.kind == Kind::if_) had_else.push_back(false);
        const bool continues = made.kind == Kind::elseif || made.kind == Kind::else_;
        if ((continues || made.kind == Kind::end) && had_else.empty()) refuse(text, "has no `if` before it");
        if (continues && had_else.back()) refuse(text, "stands behind the `else`");
        if (made.kind == Kind::else_) had_else.back() = true;
        if (made.kind == Kind::end) had_else.pop_back();
        statements.push_back(std::move(made));
    }
    if (!had_else.empty()) throw std::invalid_argument("an `if` has no `end`");
    return statements;
}

} // namespace bf::charts
