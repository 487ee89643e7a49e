// Places of quantities and statements of a step.
#include "generator.hpp"

#include "bf/codegen/differentiable.hpp"
#include "texts.hpp"

#include <algorithm>
#include <cmath>

namespace bf::codegen {

namespace {

/// The slot of a node that an operand refers to.
const Slot& slot_of(const Block& block, int slot) {
    return block.resolution().slots[static_cast<std::size_t>(slot)];
}

bool has_state(const Slot& slot) { return slot.size.count() > 0 && is_state(slot.role); }

std::string extents(const Size& size) { return number(size.rows) + ", " + number(size.cols); }

/// Does the block change its states when one of its zero-crossing functions changes its sign?
bool answers_crossings(const program::Program& program, int node) {
    return std::any_of(program.watched.begin(), program.watched.end(),
                       [&](const program::Watched& w) { return w.is_answered && w.end.node == node; });
}

bool has_marks(const program::Program& program, int node) {
    return std::any_of(program.marked.begin(), program.marked.end(),
                       [&](const program::Watched& w) { return !w.is_control && w.end.node == node; });
}

bool have_derivatives(const std::set<std::string>& functions) {
#define BF_NAME(name) #name,
    static const std::set<std::string> known{BF_DIFFERENTIABLE_FUNCTIONS(BF_NAME)};
#undef BF_NAME
    return std::includes(known.begin(), known.end(), functions.begin(), functions.end());
}

/// Can every activity of the block be printed as a call of a kernel?
bool is_printable(const program::Program& program, int number) {
    const auto& node = program.diagram->nodes[static_cast<std::size_t>(number)];
    const auto& d = node.block->declaration();
    const auto& m = node.methods;
    if (m.output || m.update || m.derivative || m.reset || m.event || !d.objects.empty()) return false;
    const bool answers = answers_crossings(program, number), crosses = answers || has_marks(program, number);
    if (m.guards && crosses) return false;
    for (const Phase phase : phases)
        for (const Call& call : d.rules(phase))
            if ((phase < Phase::guards || (phase == Phase::guards ? crosses : answers)) &&
                !header_of_kernel(call.kernel))
                return false;
    return true;
}

} // namespace

std::vector<std::string> hosted_blocks(const Diagram& diagram) {
    const auto program = program::lower(diagram);
    std::vector<std::string> blocks;
    for (std::size_t n = 0; n < diagram.nodes.size(); ++n)
        if (!is_printable(program, static_cast<int>(n)))
            blocks.push_back(diagram.nodes[n].path + " (" + diagram.nodes[n].type + ")");
    return blocks;
}

bool has_hosted_blocks(const Diagram& diagram) { return !hosted_blocks(diagram).empty(); }

Generator::Generator(const Diagram& diagram, const Options& options, program::Integrator integrator)
    : diagram_(diagram), options_(options), is_fmu_(integrator == program::Integrator::caller), program_([&] {
          auto program = program::lower(diagram, integrator);
          if (options.has_function_per_rate) split_problems_ = program::split(program);
          return program;
      }()),
      formulas_(options.has_runtime_sizes ? Formulas() : formulas_of(diagram)),
      class_(class_name(diagram) + options.suffix), file_(file_name(diagram) + options.suffix) {
    for (const auto& formula : formulas_.formulas)
        formula_numbers_.emplace(definition(formula.definition).path,
                                 static_cast<int>(formula_numbers_.size()));
    for (std::size_t n = 0; n < diagram.nodes.size(); ++n)
        hosted_.push_back(is_printable(program_, static_cast<int>(n)) ? -1 : hosted_count_++);
}

void Generator::check() const {
    std::string problems;
    bool is_of_blocks = false;
    const auto add = [&](const DiagramNode& n, const std::string& why) {
        is_of_blocks = true;
        problems += "\n  " + n.path + " (" + n.type + "): " + why;
    };
    if (is_adaptive(diagram_.solver.method) && !diagram_.plan.derivatives.empty())
        problems += "\n  the solver '" + solver_name() +
                    "' chooses its own steps; give the model one with fixed steps, e.g. solver: rk4";
    for (const auto& loop : diagram_.plan.loops)
        if (loop.kind == Loop::Kind::algebraic)
            is_of_blocks = true,
            problems +=
                "\n  " + loop.path +
                ": it stands in an algebraic loop, whose solution takes a number of iterations that has no "
                "bound; break the loop with a UnitDelay";
    if (is_dynamic())
        for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
            if (answers_crossings(program_, static_cast<int>(n)))
                add(diagram_.nodes[n],
                    "it answers zero crossings, for which sizes must be known before the program starts");
    if (options_.embedded)
        for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
            if (is_hosted(static_cast<int>(n)))
                add(diagram_.nodes[n],
                    "its class makes it at the start of the program, which needs a heap and exceptions");
    if (is_dynamic() && options_.embedded)
        problems +=
            "\n  sizes at run time need a heap, which embedded code does without; leave one of both out";
    if (options_.single && !options_.embedded && options_.language == Language::cpp)
        problems +=
            "\n  single precision is for embedded code: it does not equal the simulation; add --embedded";
    for (const auto& problem : split_problems_) problems += "\n  " + problem;
    is_of_blocks = is_of_blocks || !split_problems_.empty();
    if (options_.has_function_per_rate && has_hosted())
        problems += "\n  a function per rate needs blocks that are rules alone: what a class shares between "
                    "rates is not known; leave --functions-per-rate out, or these blocks:";
    for (std::size_t n = 0; n < diagram_.nodes.size() && options_.has_function_per_rate; ++n)
        if (is_hosted(static_cast<int>(n)))
            problems += " " + diagram_.nodes[n].path + " (" + diagram_.nodes[n].type + ")";
    if (problems.empty()) return;
    throw GenerationError(
        "no code can be generated for '" + diagram_.name + "':" + problems +
        (is_of_blocks ? "\nreplace these blocks, or generate the part of the model without them" : ""));
}

void Generator::place(const Node::End& end, const char* structure, std::vector<Field>& fields,
                      const std::string& path) {
    const Slot& slot = diagram_.slot(end);
    if (slot.size.count() == 0 && !is_dynamic()) return;
    const std::string member = unique_identifier(path, taken_[structure]);
    places_[static_cast<std::size_t>(end.node)][static_cast<std::size_t>(end.slot)] = {
        in_structure(structure), member};
    if (is_state(slot.role))
        next_[static_cast<std::size_t>(end.node)][static_cast<std::size_t>(end.slot)] = {
            in_structure(slot.role == Role::discrete_state ? "next_" : "after_"), member};
    fields.push_back({end, member, path, &slot});
}

void Generator::place_all() {
    places_.resize(diagram_.nodes.size());
    next_.resize(diagram_.nodes.size());
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->resolution().slots;
        places_[n].resize(slots.size());
        next_[n].resize(slots.size());
    }
    for (const auto& input : diagram_.inputs) {
        place(input.end, "inputs", inputs_, input.path);
        if (!place_of(input.end).member.empty()) inputs_.back().declare(input);
    }
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->resolution().slots;
        for (std::size_t s = 0; s < slots.size(); ++s) {
            const Node::End end{static_cast<int>(n), static_cast<int>(s)};
            const std::string path = diagram_.end_path(end);
            if (!places_[n][s].member.empty()) continue;
            switch (slots[s].role) {
            case Role::input:
                if (diagram_.nodes[n].sources[s].node < 0) place(end, "signals", signals_, path);
                break;
            case Role::output: place(end, "signals", signals_, path); break;
            case Role::parameter: place(end, "parameters", parameters_, path); break;
            case Role::discrete_state: place(end, "states", states_, path); break;
            case Role::continuous_state: place(end, "continuous", continuous_, path); break;
            case Role::workspace:
                if (!is_hosted(end.node)) place(end, "workspace_", workspace_, path);
                break;
            case Role::guard: break;
            }
        }
    }
    for (const auto& watched : program_.watched)
        place(watched.end, "guards_", guards_, diagram_.end_path(watched.end));
    for (const auto& marked : program_.marked)
        if (!marked.is_control) place(marked.end, "marks_", marks_, diagram_.end_path(marked.end));
    std::set<std::string> taken;
    for (const auto& output : diagram_.outputs) {
        if (place_of(output.end).member.empty()) continue;
        outputs_.push_back(
            {output.end, unique_identifier(output.path, taken), output.path, &diagram_.slot(output.end)});
        outputs_.back().declare(output);
    }
}

const Place& Generator::place_of(const Node::End& end) const {
    return places_[static_cast<std::size_t>(end.node)][static_cast<std::size_t>(end.slot)];
}

Node::End Generator::stored_in(int n, int s) const {
    const auto& source = node(n).sources[static_cast<std::size_t>(s)];
    return slot_of(block(n), s).role == Role::input && source.node >= 0 ? source : Node::End{n, s};
}

Place Generator::place_of(int n, const Call::Reference& from) const {
    if (from.source == Call::Source::next)
        return next_[static_cast<std::size_t>(n)][static_cast<std::size_t>(from.slot)];
    Place place = place_of(stored_in(n, from.slot));
    if (from.source == Call::Source::rate) place.structure = in_structure("rates_");
    return place;
}

Argument Generator::argument(int n, const Call::Reference& from) {
    Argument result{.type = real(), .is_written = from.is_written};
    const auto& rate = diagram_.rates[static_cast<std::size_t>(node(n).rate)];
    switch (from.source) {
    case Call::Source::time: result.text = time_; return result;
    case Call::Source::period:
        if (rate.trigger > 0) {
            timed_rates_.insert(node(n).rate);
            result.text = control_ + "clock_" + number(node(n).rate) + ".period";
        } else {
            const double period = rate.is_continuous ? 0 : diagram_.period(node(n).rate);
            result.values = {period};
            if (period == diagram_.step && real() == Type::float64) result.text = "period";
        }
        return result;
    case Call::Source::trigger: result.values = {rate.trigger > 0 ? 1.0 : 0.0}; return result;
    case Call::Source::constants:
        result.values = *from.constants;
        result.size = {static_cast<int>(from.constants->size()), 1, false};
        return result;
    case Call::Source::rate:
    case Call::Source::slot:
    case Call::Source::next: break;
    }
    const Slot& slot = slot_of(block(n), from.slot);
    const Size& stored = diagram_.slot(stored_in(n, from.slot)).size;
    result.type = type_of(slot);
    result.size = slot.size;
    result.text = place_of(n, from).text() + (stored.cols != 1 ? ".data" : "");
    result.is_array = stored.rows != 1 || stored.cols != 1;
    return result;
}

std::optional<Equations> Generator::equations(int n, const Call& call) {
    if (is_dynamic()) return {};
    std::vector<Argument> arguments;
    for (const auto& from : call.operands) arguments.push_back(argument(n, from));
    auto equations = arithmetic(call.kernel, arguments, call.list_from, call.list_size);
    if (equations && !equations->functions.empty()) headers_.insert("bf/codegen/math.hpp");
    return equations;
}

std::string Generator::operand(int n, const Call::Reference& from, std::string& constants) {
    const char* direction = from.is_written ? "out" : "in";
    switch (from.source) {
    case Call::Source::time: return "in(" + time_ + ")";
    case Call::Source::period: {
        const int rate = node(n).rate;
        if (diagram_.rates[static_cast<std::size_t>(rate)].trigger > 0) {
            timed_rates_.insert(rate);
            return "in(control_.clock_" + number(rate) + ".period)";
        }
        const bool is_continuous = diagram_.rates[static_cast<std::size_t>(rate)].is_continuous;
        constants += std::string("static constexpr ") + cpp_name(real()) +
                     " period = " + literal(is_continuous ? 0 : diagram_.period(rate), real()) + ";\n";
        return "in(period)";
    }
    case Call::Source::trigger:
        return "numbers<Real, " +
               number(diagram_.rates[static_cast<std::size_t>(node(n).rate)].trigger > 0 ? 1 : 0) + ">()";
    case Call::Source::constants: {
        const auto& values = *from.constants;
        if (values.empty()) return "empty<const double, 0, 1>()";
        const auto is_whole = [](double x) {
            return x == std::trunc(x) && std::abs(x) < 1e9 && !(x == 0 && std::signbit(x));
        };
        if (values.size() <= 8 && std::all_of(values.begin(), values.end(), is_whole)) {
            std::string text = "numbers<Real";
            for (const double value : values) text += ", " + number(static_cast<int>(value));
            return text + ">()";
        }
        std::string list, name = "constants";
        for (const double value : values) list += (list.empty() ? "" : ", ") + literal(value, real());
        for (int i = 2; constants.find(" " + name + "[]") != std::string::npos; ++i)
            name = "constants_" + number(i);
        constants +=
            "static constexpr " + std::string(cpp_name(real())) + " " + name + "[] = {" + list + "};\n";
        return "in(" + name + ")";
    }
    case Call::Source::rate:
    case Call::Source::slot:
    case Call::Source::next: break;
    }
    const Slot& slot = slot_of(block(n), from.slot);
    if (slot.size.count() == 0 && !is_dynamic())
        return "empty<" + std::string(from.is_written ? "" : "const ") + cpp_name(type_of(slot)) + ", " +
               extents(slot.size) + ">()";
    const Place place = place_of(n, from);
    const std::string text = direction + ("(" + place.text()) + ")";
    const Size& stored = diagram_.slot(stored_in(n, from.slot)).size;
    if (stored.rows == slot.size.rows && stored.cols == slot.size.cols) return text;
    return "reshaped<" + extents(slot.size) + ">(" + text + ")";
}

/// A statement in lines of at most 110 columns, broken behind one of these separators.
static std::string wrapped(const std::string& text, std::size_t indent, const std::string& separator) {
    std::string result;
    std::size_t line = indent;
    for (std::size_t at = 0; at < text.size();) {
        const auto found = text.find(separator, at);
        const auto end = found == std::string::npos ? text.size() : found + separator.size();
        if (line + end - at > 108 && line > indent) {
            result.back() = '\n';
            result += "    ";
            line = indent + 4;
        }
        result += text.substr(at, end - at);
        line += end - at;
        at = end;
    }
    return result;
}

/// Its right side stands below where both do not fit, and is broken at commas before it is broken elsewhere.
std::string equation(const std::string& line) {
    constexpr std::size_t most = 104;
    if (line.size() <= most) return line + "\n";
    const auto body = line.starts_with("for (") ? line.find(") ") + 2 : 0;
    if (line.starts_with("if (")) return wrapped(line, 8, " ") + "\n";
    if (body > 0) return line.substr(0, body - 1) + "\n" + indented(equation(line.substr(body)), 4);
    if (line.find(" = ") == line.npos) return wrapped(line, 8, ", ") + "\n";
    const auto right = line.find(" = ") + 3;
    std::string text = line.substr(0, right - 1) + "\n";
    const std::string by_commas = wrapped(line.substr(right), 8, ", ") + "\n";
    for (std::size_t at = 0; at < by_commas.size();) {
        const auto end = by_commas.find('\n', at);
        text += indented(wrapped(by_commas.substr(at, end - at), 8, " ") + "\n", 4);
        at = end + 1;
    }
    return text;
}

std::string Generator::statement(int n, Phase phase, int index) {
    auto& text = statements_[{n, phase, index}];
    if (!text.empty()) return text;
    if (!is_hosted(n)) return text = rule(n, phase, index);
    tasks_.push_back({n, phase, index});
    return text = "// " + comment(node(n).path) + "\nif (!hosted_->run(" +
                  number(static_cast<int>(tasks_.size()) - 1) + ")) " + failing(n, "hosted_->failure()");
}

std::string Generator::rule(int n, Phase phase, int index) {
    const Call& call = block(n).declaration().rules(phase)[static_cast<std::size_t>(index)];
    // Longer ones run out of line: each kernel is compiled once for all that have the same extents.
    bool is_short = call.operands.size() <= 16, is_small = true;
    for (const auto& from : call.operands) {
        if (from.slot >= 0) {
            const Size& size = slot_of(block(n), from.slot).size;
            is_short = is_short && size.rows <= 4 && size.cols == 1;
            is_small = is_small && size.count() <= (from.is_written ? 4 : 16);
            has_matrices_ = has_matrices_ || (size.rows > 1 && size.cols > 1);
        }
        if (from.constants) is_short = is_short && from.constants->size() <= 8;
    }
    const std::string title = "// " + comment(node(n).path) + " (" + comment(node(n).type) + ")\n";
    if (is_small)
        if (const auto its = equations(n, call)) {
            if (have_derivatives(its->functions)) differentiable_.insert({n, phase, index});
            std::string text = title;
            for (const auto& line : its->lines) text += equation(line);
            return text;
        }
    headers_.insert(*header_of_kernel(call.kernel));
    std::string constants, operands;
    for (std::size_t i = 0; i < call.operands.size(); ++i) {
        const auto& from = call.operands[i];
        const int k = static_cast<int>(i) - call.list_from;
        if (call.list_from >= 0 && k == 0 && call.list_size > 0)
            operands += (i ? ", " : "") + std::string("list(");
        else if (i)
            operands += ", ";
        if (is_dynamic() && from.source == Call::Source::constants) {
            operands += "constants_[" + number(static_cast<int>(constants_.size())) + "]";
            constants_.push_back({n, phase, index, static_cast<int>(i)});
        } else {
            operands += operand(n, from, constants);
        }
        if (call.list_from >= 0 && k == call.list_size - 1) operands += ")";
    }
    std::string printed(call.kernel);
    for (auto at = printed.find("bf::kernels::"); at != std::string::npos; at = printed.find("bf::kernels::"))
        printed.erase(at, 4);
    std::string text = is_short ? printed + "(" + operands + ")" : "call(" + printed + ", " + operands + ")";
    text = wrapped(text, constants.empty() ? 4 : 8, ", ");
    if (call.can_fail)
        text = "if (!" + text + ") return fail(" + literal(node(n).path) + ", failure_of(" + printed + "));";
    else
        text += ";";
    if (constants.empty()) return title + text + "\n";
    std::string lines = constants + text + "\n", block_text = title + "{\n";
    for (std::size_t at = 0; at < lines.size();) {
        const auto end = lines.find('\n', at);
        block_text += "    " + lines.substr(at, end - at + 1);
        at = end + 1;
    }
    return block_text + "}\n";
}

std::string Generator::write_values(const std::string& target, const Slot& slot,
                                    const std::vector<double>& values) const {
    const auto differ = [](double a, double b) { return a != b || std::signbit(a) != std::signbit(b); };
    const bool is_uniform = std::adjacent_find(values.begin(), values.end(), differ) == values.end();
    const auto text = [&](double value) { return literal(value, type_of(slot)); };
    if (is_uniform) {
        const std::string value = text(values.empty() ? 0.0 : values.front());
        if (slot.size.count() == 1 && slot.size.cols == 1) return target + " = " + value + ";\n";
        return "assign(" + target + ", " + cpp_name(type_of(slot)) + "(" + value + "));\n";
    }
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + text(value);
    return "{\n    static constexpr " + std::string(cpp_name(type_of(slot))) + " values[] = {" + list +
           "};\n    assign(" + target + ", values);\n}\n";
}

std::string Generator::assignment(const std::string& to, const Slot& to_slot, const std::string& from,
                                  const Slot& from_slot) const {
    if (!is_dynamic() && is_one_number(to_slot) && is_one_number(from_slot) && to_slot.type == from_slot.type)
        return to + " = " + from + ";\n";
    return "assign(" + to + ", " + from + ");\n";
}

std::string Generator::event(int n) {
    if (is_hosted(n))
        return "if (!hosted_->event(" + number(hosted_number(n)) + "))\n    " +
               failing(n, "hosted_->failure()");
    const auto& rules = block(n).declaration().event_rules;
    std::string text, begin, end;
    const auto& slots = block(n).resolution().slots;
    for (std::size_t s = 0; s < slots.size(); ++s) {
        if (!has_state(slots[s]) || std::none_of(rules.begin(), rules.end(), [&](const Call& call) {
                return call.writes(static_cast<int>(s));
            }))
            continue;
        const std::string now = place_of({n, static_cast<int>(s)}).text(),
                          next = next_[static_cast<std::size_t>(n)][s].text();
        begin += assignment(next, slots[s], now, slots[s]);
        end += assignment(now, slots[s], next, slots[s]);
    }
    for (int i = 0; i < static_cast<int>(rules.size()); ++i) text += statement(n, Phase::event, i);
    return begin + text + end;
}

bool Generator::has_continuous_events() const {
    return std::any_of(continuous_.begin(), continuous_.end(), [&](const Field& field) {
        const auto& rules = block(field.end.node).declaration().event_rules;
        return !is_hosted(field.end.node) && answers_crossings(program_, field.end.node) &&
               std::any_of(rules.begin(), rules.end(),
                           [&](const Call& call) { return call.writes(field.end.slot); });
    });
}

std::string Generator::set(int number) const {
    const auto& [quantity, source, values] = program_.sets[static_cast<std::size_t>(number)];
    const auto& [node, s] = quantity;
    const Slot& slot = diagram_.slot(quantity);
    if (place_of(quantity).member.empty()) return {};
    if (is_dynamic()) return "hosted_->set(" + codegen::number(number) + ");\n";
    if (is_hosted(node)) { // its arguments, which may change at the start, may decide about its states
        const auto& slots = block(node).resolution().slots;
        const bool is_first = std::none_of(slots.begin(), slots.begin() + s, has_state);
        return is_first ? "hosted_->set_states(" + codegen::number(hosted_number(node)) + ");\n" : "";
    }
    const std::string target = place_of(quantity).text();
    const std::string text = source.node >= 0
                                 ? assignment(target, slot, place_of(source).text(), diagram_.slot(source))
                                 : write_values(target, slot, values);
    if (slot.role != Role::discrete_state) return text;
    const Place& next = next_[static_cast<std::size_t>(node)][static_cast<std::size_t>(s)];
    return text + assignment(next.text(), slot, target, slot);
}

} // namespace bf::codegen
