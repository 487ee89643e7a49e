#include "arithmetic.hpp"

#include "bf/kernels/expression.hpp"
#include "equation.hpp"
#include "names.hpp"
#include "trace.hpp"

#include <algorithm>

namespace bf::codegen {

namespace {

/// What a person still reads as one equation; a formula is as long as its author made it.
constexpr std::size_t longest_text = 400, most_terms = 400;
constexpr int most_lines = 8;

bool depends_on(const TermPtr& x, int argument) {
    return x->argument == argument ||
           std::any_of(x->of.begin(), x->of.end(), [&](const auto& y) { return depends_on(y, argument); });
}

/// As the printer calls them.
void add_functions(const TermPtr& x, std::set<std::string>& functions) {
    if (x->kind == TermKind::call) functions.insert(x->op);
    if (x->kind == TermKind::conversion) functions.insert("as");
    for (const auto& one : x->of) add_functions(one, functions);
}

} // namespace

std::optional<Equations> arithmetic(std::string_view name, const std::vector<Argument>& arguments,
                                    int list_from, int list_size) {
    const auto traced = trace(name, arguments, list_from, list_size, most_terms);
    if (!traced || !is_number(traced->fails, 0)) return {};
    const auto& terms = traced->terms;
    Equations equations;
    auto& lines = equations.lines;
    for (int a = 0; a < static_cast<int>(arguments.size()); ++a) {
        const auto& target = arguments[static_cast<std::size_t>(a)];
        const auto& its = terms[static_cast<std::size_t>(a)];
        const int count = target.size.count();
        const auto is_kept = [&](int e) { return is_itself(its[static_cast<std::size_t>(e)], a, e); };
        const auto line = [&](int e, int loop) {
            const EquationPrinter print(arguments, loop);
            return print.element(a, e) + " = " + print(its[static_cast<std::size_t>(e)], target.type).text +
                   ";";
        };
        if (!target.is_written || count == 0 || is_kept(0)) continue; // a rule may read its own outputs
        bool is_uniform = count > 1;
        for (int e = 0; e < count; ++e) {
            if (is_kept(e) || !fits(its[static_cast<std::size_t>(e)], target.type)) return {};
            add_functions(its[static_cast<std::size_t>(e)], equations.functions);
            is_uniform = is_uniform && line(e, e) == line(0, 0);
        }
        // Its old value would have to outlive the line.
        for (const auto& others : terms)
            for (const auto& one : others)
                if (depends_on(one, a)) return {};
        if (is_uniform)
            lines.push_back("for (int i = 0; i < " + number(count) + "; ++i) " + line(0, 0));
        else
            for (int e = 0; e < count; ++e) lines.push_back(line(e, -1));
    }
    if (lines.empty() || static_cast<int>(lines.size()) > most_lines) return {};
    for (const auto& line : lines)
        if (line.size() > longest_text && name != kernels::Expression::name) return {};
    return equations;
}

} // namespace bf::codegen
