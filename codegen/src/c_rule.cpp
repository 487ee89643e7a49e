#include "c_rule.hpp"

#include "c_library.hpp"
#include "equation.hpp"
#include "names.hpp"
#include "trace.hpp"

#include "bf/kernels/chart.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace bf::codegen {

namespace {

/// Larger rules take a compiler, and a reader, too long.
constexpr int most_elements = 400;
constexpr std::size_t most_terms_unrolled = 200000, most_lines_unrolled = 600, smallest_shared = 3;

/// The statements of one run over all targets of a kernel.
class RuleStatements {
  public:
    /// With `loop` ≥ 0 elements of that index are written as [i].
    RuleStatements(const std::vector<Argument>& arguments, const Traced& traced, int loop,
                   const std::string& prefix)
        : arguments_(arguments), traced_(traced), print_(arguments, loop, prefix, names_, functions) {}

    /// False where an assignment would convert.
    bool make() {
        std::vector<std::pair<TermPtr, std::string>> targets;
        std::vector<Type> types;
        for (int a = 0; a < static_cast<int>(arguments_.size()); ++a) {
            const auto& target = arguments_[static_cast<std::size_t>(a)];
            const auto& terms = traced_.terms[static_cast<std::size_t>(a)];
            for (int e = 0; e < static_cast<int>(terms.size()) && target.is_written; ++e) {
                TermPtr term = terms[static_cast<std::size_t>(e)];
                if (is_itself(term, a, e)) continue;
                if (term->kind == TermKind::number && std::nearbyint(term->value) == term->value)
                    term = number_term(term->value); // has its value in every type
                if (!fits(term, target.type)) return false;
                targets.emplace_back(term, print_.element(a, e));
                types.push_back(target.type);
            }
        }
        count(traced_.fails);
        for (const auto& [term, name] : targets) count(term);
        share(traced_.fails, Type::boolean);
        for (std::size_t i = 0; i < targets.size(); ++i) share(targets[i].first, types[i]);
        if (!is_number(traced_.fails, 0)) {
            lines.push_back("if (" + print_(traced_.fails, Type::boolean).text + ") {");
            lines.push_back("    " + std::string(c_fail));
            lines.push_back("}");
        }
        // What is overwritten may still be read for another target.
        for (std::size_t i = 0; i < targets.size() && reads_written_ && targets.size() > 1; ++i)
            keep(targets[i].first, types[i]);
        for (std::size_t i = 0; i < targets.size(); ++i)
            lines.push_back(targets[i].second + " = " + print_(targets[i].first, types[i]).text + ";");
        return true;
    }

    std::vector<std::string> lines;
    std::set<CFunction> functions;
    bool has_names() const { return !names_.empty(); }

  private:
    void count(const TermPtr& x) {
        if (x->kind == TermKind::element) reads_written_ = reads_written_ || is_written(x->argument);
        if (++uses_[x->key] > 1) return;
        for (const auto& y : x->of) count(y);
    }
    bool is_written(int argument) const {
        const std::string& text = arguments_[static_cast<std::size_t>(argument)].text;
        return std::any_of(arguments_.begin(), arguments_.end(),
                           [&](const Argument& a) { return a.is_written && a.text == text; });
    }
    /// Names, below a term first, what stands in it more than once.
    void share(const TermPtr& x, Type type) {
        if (!seen_.insert(x->key).second) return;
        if (x->type) type = *x->type;
        for (const auto& y : x->of) share(y, y->type.value_or(type));
        if (uses_.at(x->key) > 1 && x->size >= smallest_shared) keep(x, type);
    }
    void keep(const TermPtr& x, Type type) {
        if (x->kind == TermKind::number || names_.contains(x->key)) return;
        if (x->type) type = *x->type;
        const std::string name = "t" + number(static_cast<int>(names_.size()) + 1);
        lines.push_back("const " + c_name(type) + " " + name + " = " + print_(x, type).text + ";");
        names_.emplace(x->key, name);
    }

    const std::vector<Argument>& arguments_;
    const Traced& traced_;
    CEquationPrinter::Names names_;
    CEquationPrinter print_;
    std::unordered_map<std::string, int> uses_;
    std::set<std::string> seen_;
    bool reads_written_ = false;
};

std::optional<CRule> all_at_once(std::string_view kernel, const std::vector<Argument>& arguments,
                                 int list_from, int list_size, const std::string& prefix) {
    int elements = 0;
    const bool has_table = kernel == kernels::StateMachine::name || kernel == kernels::ChartUpdate::name;
    for (const auto& a : arguments) // a table says which equations there are, and stands in none
        if (!has_table || a.values.empty()) elements += a.size.count();
    if (elements > most_elements) return {};
    const auto traced = trace(kernel, arguments, list_from, list_size, most_terms_unrolled);
    if (!traced) return {};
    RuleStatements all(arguments, *traced, -1, prefix);
    if (!all.make() || all.lines.size() > most_lines_unrolled) return {};
    CRule rule{std::move(all.lines), std::move(all.functions), failure_of(kernel)};
    if (all.has_names()) {
        for (auto& line : rule.lines) line.insert(0, "    ");
        rule.lines.insert(rule.lines.begin(), "{");
        rule.lines.push_back("}");
    }
    return rule;
}

/// Operands with one element stand for as many as the others have. What stands beside a list has a value for
/// each of its operands, not for each element.
std::optional<CRule> each_element(std::string_view kernel, const std::vector<Argument>& arguments,
                                  int list_from, int list_size, int count, Elements elements,
                                  const std::string& prefix) {
    CRule loop, unrolled{.lines = {}, .functions = {}, .failure = failure_of(kernel)};
    bool is_uniform = true;
    for (int e = 0; e < count; ++e) {
        std::vector<Argument> one = arguments;
        for (int at = 0; at < static_cast<int>(one.size()); ++at) {
            Argument& a = one[static_cast<std::size_t>(at)];
            const bool is_beside_list =
                list_from >= 0 && !a.is_written && (at < list_from || at >= list_from + list_size);
            const bool is_for_all = !a.values.empty() && elements == Elements::of_all_but_constants;
            if (is_beside_list || is_for_all || (a.size.count() == 1 && !a.is_array)) continue;
            const int index = a.size.count() == 1 ? 0 : e;
            if (!a.values.empty()) a.values = {a.values[static_cast<std::size_t>(index)]};
            if (a.is_array && a.size.count() == 1) { // of a signal with one element in an array
                a.text += "[0]";
                a.is_array = false;
            }
            a.size = {};
        }
        // A vector keeps its [ ]; its element 0 here is its element e there.
        const auto traced = trace(kernel, one, list_from, list_size, most_terms_unrolled);
        if (!traced) return {};
        RuleStatements in_loop(one, *traced, 0, prefix);
        if (!in_loop.make()) return {};
        is_uniform = is_uniform && (e == 0 || in_loop.lines == loop.lines);
        if (e == 0) loop = {in_loop.lines, in_loop.functions, failure_of(kernel)};
        for (auto& a : one)
            if (a.is_array) {
                a.text += "[" + number(e) + "]";
                a.is_array = false;
            }
        RuleStatements plain(one, *traced, -1, prefix);
        plain.make();
        if (plain.has_names()) unrolled.lines.push_back("{");
        for (const auto& line : plain.lines)
            unrolled.lines.push_back((plain.has_names() ? "    " : "") + line);
        if (plain.has_names()) unrolled.lines.push_back("}");
        unrolled.functions.merge(plain.functions);
        if (!is_uniform && unrolled.lines.size() > most_lines_unrolled) return {};
    }
    if (!is_uniform) return unrolled;
    for (auto& line : loop.lines) line.insert(0, "    ");
    loop.lines.insert(loop.lines.begin(), "for (int i = 0; i < " + number(count) + "; ++i) {");
    loop.lines.push_back("}");
    return loop;
}

} // namespace

std::optional<CRule> c_rule(std::string_view kernel, const std::vector<Argument>& arguments, int list_from,
                            int list_size, const std::string& prefix) {
    if (auto rule = library_rule(kernel, arguments, list_size, prefix)) return rule;
    int count = 1;
    for (const auto& a : arguments)
        if (a.is_written) count = std::max(count, a.size.count());
    const Elements elements = elements_of(kernel);
    const bool fits_loop = std::all_of(arguments.begin(), arguments.end(), [&](const Argument& a) {
        return a.size.count() == count || a.size.count() == 1 || list_from >= 0 ||
               (!a.values.empty() && elements == Elements::of_all_but_constants);
    });
    if (count > 1 && fits_loop && elements != Elements::differ)
        return each_element(kernel, arguments, list_from, list_size, count, elements, prefix);
    return all_at_once(kernel, arguments, list_from, list_size, prefix);
}

} // namespace bf::codegen
