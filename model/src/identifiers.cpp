#include "identifiers.hpp"

#include <algorithm>

namespace bf::model {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(char c) { return is_letter(c) || (c >= '0' && c <= '9'); }

/// Whether the quote at `at` transposes what stands before it.
bool is_transpose(std::string_view text, std::size_t at) {
    if (at == 0) return false;
    const char before = text[at - 1];
    return is_word(before) || before == ')' || before == ']' || before == '}' || before == '.' ||
           before == '\'';
}

/// Where the text in quotes ends that begins at `begin`.
std::size_t text_end(std::string_view text, std::size_t begin) {
    std::size_t at = begin + 1;
    for (; at < text.size(); ++at) {
        if (text[at] != text[begin]) continue;
        if (at + 1 >= text.size() || text[at + 1] != text[begin]) return at + 1;
        ++at;
    }
    return text.size();
}

void visit_all(const std::function<void(Expression&)>& visit,
               std::initializer_list<std::optional<Expression>*> expressions) {
    for (std::optional<Expression>* each : expressions)
        if (*each) visit(**each);
}

} // namespace

bool is_identifier(std::string_view name) {
    return !name.empty() && is_letter(name[0]) && name[0] != '_' && std::ranges::all_of(name, is_word);
}

std::string replace_names(std::string_view text, const std::function<std::string(std::string_view)>& visit,
                          bool with_fields) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = at + 1;
        const char c = text[at];
        if (c == '"' || (c == '\'' && !is_transpose(text, at))) {
            end = text_end(text, at);
        } else if (c == '%') {
            end = std::min(text.find('\n', at), text.size());
        } else if (is_word(c)) {
            const auto goes_on = [&] {
                return is_word(text[end]) || (with_fields && is_letter(c) && text[end] == '.' &&
                                              end + 1 < text.size() && is_letter(text[end + 1]));
            };
            while (end < text.size() && goes_on()) ++end;
            const std::string_view word = text.substr(at, end - at);
            const bool is_field = at > 0 && text[at - 1] == '.' && (at < 2 || text[at - 2] != '.');
            if (is_letter(c) && !is_field) {
                result += visit(word);
                at = end;
                continue;
            }
        }
        result += text.substr(at, end - at);
        at = end;
    }
    return result;
}

void for_each_expression(Variable& variable, const std::function<void(Expression&)>& visit) {
    visit(variable.value);
    visit_all(visit, {&variable.minimum, &variable.above, &variable.maximum});
    for (Variable& field : variable.fields) for_each_expression(field, visit);
}

void for_each_expression_of_block(Block& block, const std::function<void(Expression&)>& visit) {
    visit_all(visit, {&block.when, &block.period, &block.offset});
    for (Setting& setting : block.settings) visit(setting.value);
    if (block.reference)
        for (Variable& variable : block.reference->with) for_each_expression(variable, visit);
}

void for_each_expression(System& system, const std::function<void(Expression&)>& visit) {
    visit_all(visit, {&system.iterations});
    for (auto* ports : {&system.inputs, &system.outputs})
        for (Port& port : *ports) visit_all(visit, {&port.shape, &port.initial});
    for (auto* variables : {&system.enumerations, &system.variables})
        for (Variable& variable : *variables) for_each_expression(variable, visit);
    for (Block& block : system.blocks) for_each_expression_of_block(block, visit);
}

std::set<std::string> used_names(const Expression& expression) {
    std::set<std::string> names;
    if (expression.quotes == Quotes::single || expression.quotes == Quotes::literal) return names;
    replace_names(expression.text, [&](std::string_view name) {
        names.emplace(name);
        return std::string(name);
    });
    return names;
}

bool declares(const System& system, std::string_view name) {
    const auto is_it = [&](const Variable& variable) { return variable.name == name; };
    return std::ranges::any_of(system.variables, is_it) || std::ranges::any_of(system.enumerations, is_it);
}

} // namespace bf::model
