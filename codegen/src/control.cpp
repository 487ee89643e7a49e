// The statements of the step program as C++.
#include "generator.hpp"

#include "texts.hpp"

#include <algorithm>
#include <utility>

namespace bf::codegen {

namespace {

using program::Literal;
using program::Statement;
using program::Statements;
using Kind = Statement::Kind;

const char* enumerator(model::Edge edge) {
    switch (edge) {
    case model::Edge::rising: return "rising";
    case model::Edge::falling: return "falling";
    case model::Edge::either: return "either";
    case model::Edge::level: break;
    }
    return "level";
}

/// Those that stand in functions of their own, which kernels are joined into.
bool is_computation(const Statement& s) {
    switch (s.kind) {
    case Kind::run:
    case Kind::commit:
    case Kind::finite:
    case Kind::repeat: return true;
    case Kind::when: return std::any_of(s.body.begin(), s.body.end(), is_computation);
    default: return false;
    }
}

int size_of(const Statements& statements) {
    int size = 0;
    for (const auto& s : statements) size += 1 + size_of(s.body) + size_of(s.otherwise);
    return size;
}

} // namespace

std::string message(std::string text) {
    std::string lines;
    for (std::size_t most = 80; text.size() > most;) {
        const auto space = text.rfind(' ', most);
        const auto end = space == text.npos || space == 0 ? most : space + 1;
        lines += literal(text.substr(0, end)) + "\n    ";
        text.erase(0, end);
    }
    return lines + literal(text);
}

/// What is never asked for is not kept.
void Generator::find_flags_in_use() {
    const auto find = [&](const auto& self, const Statements& statements) -> void {
        for (const auto& s : statements) {
            for (const auto& l : s.when)
                if (l.kind == Literal::Kind::flag) used_flags_.insert(l.number);
            self(self, s.body);
            self(self, s.otherwise);
        }
    };
    if (is_split()) {
        for (const auto& task : program_.tasks) {
            for (const auto* part : {&task.outputs, &task.update}) find(find, *part);
            const auto& rate = diagram_.rates[static_cast<std::size_t>(task.rate)];
            if (rate.ticks > 1) used_flags_.insert(program_.hit[static_cast<std::size_t>(task.rate)]);
        }
    } else {
        for (const auto* part : {&program_.step, &program_.outputs, &program_.update, &program_.event})
            find(find, *part);
    }
    for (const auto* part : {&program_.derivatives, &program_.guards, &program_.marks}) find(find, *part);
    for (const auto& marked : program_.marked)
        if (const int active = program_.active[static_cast<std::size_t>(marked.condition)];
            marked.is_control && active >= 0)
            used_flags_.insert(active);
    if (!options_.embedded) // recorders ask for them
        for (std::size_t r = 0; r < diagram_.rates.size(); ++r)
            if (diagram_.rates[r].trigger > 0) used_flags_.insert(program_.hit[r]);
    for (const auto& procedure : program_.procedures) {
        procedures_.push_back(unique_identifier(procedure.name, taken_["functions"]));
        find(find, procedure.body);
    }
}

std::string Generator::flag(int f) const {
    const auto& flag = program_.flags[static_cast<std::size_t>(f)];
    const std::string n = number(flag.number);
    switch (flag.kind) {
    case program::Flag::Kind::hit:
        return control_ + ((diagram_.rates[static_cast<std::size_t>(flag.number)].trigger > 0 ? "has_fired_"
                                                                                              : "is_hit_") +
                           hit_name(flag));
    case program::Flag::Kind::enabled: return control_ + "is_enabled_" + n;
    case program::Flag::Kind::triggered: return control_ + "is_triggered_" + n;
    case program::Flag::Kind::ran: return control_ + "has_run_" + number(f);
    case program::Flag::Kind::local: return flag.name;
    case program::Flag::Kind::crossed: return control_ + "has_crossings";
    case program::Flag::Kind::answered: return control_ + "has_answers";
    case program::Flag::Kind::inside: break;
    }
    return control_ + "is_inside";
}

std::string Generator::memory(int m) const {
    const auto& memory = program_.memories[static_cast<std::size_t>(m)];
    return (memory.is_reset ? control_ + "reset_" : control_ + "trigger_") + number(memory.condition);
}

std::string Generator::condition(const std::vector<Literal>& when) const {
    std::string text;
    for (const auto& l : when) {
        std::string one;
        if (l.kind == Literal::Kind::flag) {
            one = flag(l.number);
        } else if (l.kind == Literal::Kind::signal) {
            const Slot& slot = diagram_.slot(l.signal);
            one = place_of(l.signal).text();
            if (is_dynamic() || !is_one_number(slot))
                one = is_positive(l.signal);
            else if (slot.type != Type::boolean)
                one = l.is_negated ? "(" + one + " > 0)" : one + " > 0";
        } else if (l.kind == Literal::Kind::crossing) {
            for (const auto& field : guards_)
                if (field.end.node == l.number) one += (one.empty() ? "" : " || ") + has_crossed(field);
            if (l.is_negated || when.size() > 1) one = "(" + one + ")";
        }
        text += (text.empty() ? "" : " && ") + ((l.is_negated ? "!" : "") + one);
    }
    return text.empty() ? "true" : text;
}

std::string Generator::failing(int n, const std::string& why) const {
    return "return fail(" + literal(node(n).path) + ", " + why + ");\n";
}

std::string Generator::unless(const std::string& good, const std::string& otherwise) const {
    const bool is_one_call = good.find(' ') == good.npos;
    return "if (!" + (is_one_call ? good : "(" + good + ")") + ") " + otherwise;
}

std::string Generator::has_crossed(const Field& guard) const {
    return "has_crossed(guards_." + guard.member + ")";
}

std::string Generator::is_positive(const Node::End& end) const {
    return "is_positive(" + place_of(end).text() + ")";
}

std::string Generator::text_of(const Statements& statements, program::Pass pass, int indent) {
    std::string text;
    for (auto first = statements.begin(); first != statements.end();) {
        // A large model has many initial values.
        const auto last =
            std::find_if(first, statements.end(), [](const Statement& s) { return s.kind != Kind::set; });
        if (last - first > options_.statements_per_function) {
            text += indented(
                unless(called(functions("initial", guarded({first, last}, pass))), "return false;\n"),
                indent);
            first = last;
        } else {
            if (first->passes & pass) text += indented(text_of(*first, pass), indent);
            ++first;
        }
    }
    return text;
}

Printed Generator::printed(const Statement& s, program::Pass pass) {
    std::string text = text_of(s, pass);
    return {std::move(text), is_differentiable(s)};
}

/// What control decides jumps; only equations change with what they are of.
bool Generator::is_differentiable(const Statement& s) const {
    switch (s.kind) {
    case Kind::run: return differentiable_.contains({s.node, s.phase, s.index});
    case Kind::rest: return true;
    case Kind::repeat:
        return s.signal.node < 0 && s.when.empty() &&
               std::all_of(s.body.begin(), s.body.end(),
                           [&](const Statement& one) { return is_differentiable(one); });
    default: return false;
    }
}

std::string Generator::text_of(const Statement& s, program::Pass pass) {
    const auto is_used = [&](int f) {
        return program_.flags[static_cast<std::size_t>(f)].kind == program::Flag::Kind::local ||
               used_flags_.contains(f);
    };
    switch (s.kind) {
    case Kind::run: return statement(s.node, s.phase, s.index);
    case Kind::commit: return commits(s);
    case Kind::reset:
        return "if (!hosted_->reset(" + number(hosted_number(s.node)) + ")) " +
               failing(s.node, "hosted_->failure()");
    case Kind::rest: {
        std::string text;
        const auto& slots = block(s.node).resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::continuous_state && slots[i].size.count() > 0)
                text += write_values(in_structure("rates_") + "." +
                                         place_of({s.node, static_cast<int>(i)}).member,
                                     slots[i], {});
        return text;
    }
    case Kind::set: return set(s.number);
    case Kind::start:
        return has_hosted()
                   ? "if (!hosted_->start()) return fail(hosted_->failed_block(), hosted_->failure());\n"
                   : "";
    case Kind::constants:
        return unless(call_of("compute_constants"),
                      has_hosted() ? "return terminate(), false;\n" : "return false;\n");
    case Kind::finite:
        return unless("is_finite(" + place_of(s.signal).text() + ")",
                      failing(s.node, message(s.failure.text(&block(s.node).resolution()))));
    case Kind::assign: return is_used(s.flag) ? flag(s.flag) + " = " + condition(s.when) + ";\n" : "";
    case Kind::clear: return is_used(s.flag) ? flag(s.flag) + " = false;\n" : "";
    case Kind::edge: {
        const auto& memory = program_.memories[static_cast<std::size_t>(s.number)];
        return flag(s.flag) + " = has_edge<bf::program::Edge::" + enumerator(memory.edge) + ">(" +
               place_of(memory.signal).text() + ", " + this->memory(s.number) +
               (is_dynamic() ? ".data()" : "") + ");\n";
    }
    case Kind::hit: {
        const std::string hosted =
            has_hosted() ? "hosted_->hit(" + number(s.number) + ", time_);\n" : std::string();
        if (!used_flags_.contains(s.flag)) return hosted;
        const auto& hit = program_.flags[static_cast<std::size_t>(s.flag)];
        const std::string until = control_ + "until_hit_" + hit_name(hit);
        return flag(s.flag) + " = " + until + "-- == 0;\nif (" + flag(s.flag) + ") " +
               (hosted.empty() ? "" : "{\n    ") + until + " = " + std::to_string(calls_between(hit) - 1) +
               ";\n" + (hosted.empty() ? "" : "    " + hosted + "}\n");
    }
    case Kind::fire:
        return (timed_rates_.contains(s.number)
                    ? "bf::program::fire(control_.clock_" + number(s.number) + ", " + time_ + ");\n"
                    : "") +
               (has_hosted() ? "hosted_->fire(" + number(s.number) + ", time_);\n" : std::string());
    case Kind::when: {
        const std::string body = text_of(s.body, pass, 4);
        return body.empty() ? "" : "if (" + condition(s.when) + ") {\n" + body + "}\n";
    }
    case Kind::repeat: return repetition(s, pass);
    case Kind::event: return event(s.node);
    case Kind::look: return unless(call_of("find_crossings"), "return false;\n");
    case Kind::observe: return "if (before_event) before_event(observer);\n";
    case Kind::integrate: return unless(call_of("integrate"), "return false;\n");
    case Kind::evaluate:
        return unless(call_of(s.pass == program::first ? "compute" : "compute_again"), "return false;\n");
    case Kind::call:
        return unless(call_of(procedures_[static_cast<std::size_t>(s.number)]), "return false;\n");
    case Kind::fail: return failing(s.node, message(s.failure.text()));
    case Kind::solve: // refused, as adaptive solvers are
    case Kind::locate:
    case Kind::restart: break;
    }
    return {};
}

std::string Generator::commits(const Statement& s) const {
    std::string text;
    const auto& slots = block(s.node).resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i].role != Role::discrete_state || (slots[i].size.count() == 0 && !is_dynamic())) continue;
        const std::string state = place_of({s.node, static_cast<int>(i)}).text();
        const std::string next = next_[static_cast<std::size_t>(s.node)][i].text();
        text += slots[i].type == Type::float64
                    ? "if (!commit(" + state + ", " + next + ")) return became_nan(" +
                          literal(node(s.node).path) + ");\n"
                    : assignment(state, slots[i], next, slots[i]);
    }
    return text.empty() ? text
                        : "// The next states become those of now, unless one is not a number.\n" + text;
}

std::string Generator::repetition(const Statement& s, program::Pass pass) {
    // Loops stand within loops.
    const std::string depth = ++loop_depth_ > 1 ? "_" + number(loop_depth_) : "";
    const std::string i = "iteration" + depth, goes_on = "goes_on" + depth;
    const bool has_count = s.signal.node >= 0, can_end = !s.when.empty();
    std::string text, most = number(s.number);
    if (has_count) {
        most = "most" + depth;
        text = "const double " + most + " = static_cast<double>(in(" + place_of(s.signal).text() + ")[0]);\n";
    }
    if (can_end) text += "bool " + goes_on + " = true;\n";
    text += std::string("for (") + (has_count ? "double " : "int ") + i + " = 1; " +
            (can_end ? goes_on + " && " : "") + i + " <= " + most + "; ++" + i + ") {\n" +
            text_of(s.body, pass, 4) + (can_end ? "    " + goes_on + " = " + condition(s.when) + ";\n" : "") +
            "}\n";
    if (!s.otherwise.empty()) text += "if (" + goes_on + ") {\n" + text_of(s.otherwise, pass, 4) + "}\n";
    --loop_depth_;
    return can_end || has_count ? "{\n" + indented(text, 4) + "}\n" : text;
}

std::vector<Generator::ControlQuantity> Generator::control_quantities() const {
    std::vector<ControlQuantity> all;
    const auto name_of = [](const std::string& place) { return place.substr(place.rfind('.') + 1); };
    for (const int f : used_flags_)
        if (const auto& its = program_.flags[static_cast<std::size_t>(f)];
            its.kind != program::Flag::Kind::local)
            all.push_back({"bool", name_of(flag(f)), comment(its.name)});
    for (const int f : used_flags_)
        if (const auto& its = program_.flags[static_cast<std::size_t>(f)];
            its.kind == program::Flag::Kind::hit)
            if (diagram_.rates[static_cast<std::size_t>(its.number)].trigger == 0)
                all.push_back({"int64_t", "until_hit_" + hit_name(its),
                               (its.task < 0 ? "steps" : "calls") + std::string(" to the next one, every ") +
                                   literal(diagram_.period(its.number), Type::float64) + " s",
                               std::to_string(calls_before(its))});
    for (const auto& task : program_.tasks) {
        const std::string r = number(task.rate);
        all.push_back({"int64_t", "steps_" + r,
                       "of the model before this call of step_" + rate_name(task.rate),
                       std::to_string(diagram_.rates[static_cast<std::size_t>(task.rate)].offset)});
        all.push_back({cpp_name(real()), "time_" + r, "of this call [s]"});
    }
    for (int m = 0; m < static_cast<int>(program_.memories.size()); ++m) {
        const auto& signal = program_.memories[static_cast<std::size_t>(m)].signal;
        const std::string name = name_of(memory(m)),
                          doc = comment(diagram_.end_path(signal)) + ", at the last look";
        if (is_dynamic())
            all.push_back({"std::vector<double>", name, doc});
        else
            all.push_back({"double", name + "[" + number(diagram_.slot(signal).size.count()) + "]", doc});
    }
    for (const int rate : timed_rates_)
        all.push_back(
            {"Clock", "clock_" + number(rate),
             comment(program_.flags[static_cast<std::size_t>(program_.hit[static_cast<std::size_t>(rate)])]
                         .name)});
    return all;
}

std::string Generator::control_declarations() const {
    std::string text, members;
    for (const auto& name : procedures_) text += "    bool " + name + "() noexcept;\n";
    if (!is_split()) text += "    bool compute() noexcept;\n";
    for (const auto& task : program_.tasks)
        for (const char* half : {"output_", "update_"})
            text += "    bool " + (half + rate_name(task.rate)) + "() noexcept;\n";
    if (!guards_.empty()) text += "    bool compute_again() noexcept;\n    bool find_crossings() noexcept;\n";
    for (const auto& [type, name, doc, value] : control_quantities())
        members += "        " +
                   (type == "int64_t" ? "std::int64_t"
                    : type == "Clock" ? "bf::program::Clock<Real>"
                                      : type) +
                   " " + name + "{" + value + "}; // " + doc + "\n";
    return members.empty() ? text
                           : text + "    struct Control {\n" + members + "    };\n    Control control_{};\n";
}

std::string Generator::has_fired() const {
    std::string cases;
    for (std::size_t r = 0; r < diagram_.rates.size(); ++r)
        if (diagram_.rates[r].trigger > 0 && !options_.embedded)
            cases +=
                "        case " + number(static_cast<int>(r)) + ": return " + flag(program_.hit[r]) + ";\n";
    return cases.empty() ? cases
                         : "    /// Did the trigger of that rate fire in this step?\n    bool has_fired(int "
                           "rate) const noexcept {\n        switch (rate) {\n" +
                               cases + "        default: return false;\n        }\n    }\n";
}

std::string Generator::control_resets() const {
    std::string text;
    if (control_declarations().find("Control control_") != std::string::npos)
        text = "    control_ = Control();\n";
    for (int m = 0; m < static_cast<int>(program_.memories.size()); ++m)
        text += "    forget(" + memory(m) + ", in(" +
                place_of(program_.memories[static_cast<std::size_t>(m)].signal).text() + ").size());\n";
    if (!guards_.empty())
        text += "    forget(elements<Real>(guards_before_), " + number(guard_count()) + ");\n";
    return text;
}

std::string Generator::procedure_functions() {
    std::string text, locals;
    const auto find = [&](const auto& self, const Statements& statements) -> void {
        for (const auto& s : statements) {
            if (s.flag >= 0 &&
                program_.flags[static_cast<std::size_t>(s.flag)].kind == program::Flag::Kind::local)
                if (const std::string line = "    bool " + flag(s.flag) + " = false;\n";
                    locals.find(line) == std::string::npos)
                    locals += line;
            self(self, s.body);
        }
    };
    for (std::size_t i = 0; i < procedures_.size(); ++i) {
        const auto& procedure = program_.procedures[i];
        time_ = time_of(procedure.task);
        locals.clear();
        find(find, procedure.body);
        text += "// " + comment(procedure.name) + "\n" + head_of(procedures_[i]) + " {\n" + locals +
                text_of(procedure.body, program::first, 4) + "    return true;\n}\n\n";
    }
    time_ = time_inside();
    return text;
}

int Generator::guard_count() const {
    int count = 0;
    for (const auto& field : guards_) count += field.slot->size.count();
    return count;
}

std::string Generator::crossings_functions(const Calls& calls) const {
    const std::string count = number(guard_count());
    return "// After an event.\nbool " + class_ + "::compute_again() noexcept { return " +
           called(calls.again) + "; }\n\nbool " + class_ +
           "::find_crossings() noexcept {\n    forget(elements<Real>(guards_), " + count +
           "); // of subsystems that do not run\n    if (!(" + called(calls.guards) +
           ")) return false;\n    " + flag(crossed_flag()) +
           " = bf::generated::find_crossings(elements<Real>(guards_), elements<Real>(guards_before_), " +
           count + ");\n    return true;\n}\n\n";
}

int Generator::crossed_flag() const {
    const auto& flags = program_.flags;
    return static_cast<int>(
        std::find_if(flags.begin(), flags.end(),
                     [](const program::Flag& flag) { return flag.kind == program::Flag::Kind::crossed; }) -
        flags.begin());
}

// ---- functions of bounded length

std::vector<Guarded> Generator::guarded(const Statements& statements, program::Pass pass) {
    std::vector<Guarded> all;
    for (const auto& s : statements) {
        const bool is_conditional = s.kind == Kind::when;
        if (is_conditional || all.empty() || !all.back().condition.empty())
            all.push_back({is_conditional ? condition(s.when) : "", {}});
        for (const auto& one : is_conditional ? s.body : Statements{s})
            if (s.passes & one.passes & pass) all.back().statements.push_back(printed(one, pass));
    }
    return all;
}

/// What takes part in the same evaluations of the outputs is printed once for all of them.
void Generator::print_outputs(const Statements& outputs, Calls& calls) {
    struct Part {
        int passes;
        std::vector<Guarded> all;
    };
    std::vector<Part> parts;
    const auto add = [&](const std::string& when, const Printed& statement, int passes) {
        if (parts.empty() || parts.back().passes != passes) parts.push_back({passes, {}});
        auto& all = parts.back().all;
        if (all.empty() || all.back().condition != when) all.push_back({when, {}});
        all.back().statements.push_back(statement);
    };
    for (const auto& s : outputs)
        for (const auto& one : s.kind == Kind::when ? s.body : Statements{s}) {
            std::vector<std::pair<Printed, int>> texts; // and the passes of each
            for (const auto pass : {program::first, program::again, program::inside, program::between}) {
                if (!(s.passes & one.passes & pass)) continue;
                Printed its = printed(one, pass);
                if (texts.empty() || texts.back().first.text != its.text)
                    texts.emplace_back(std::move(its), 0);
                texts.back().second |= pass;
            }
            if (one.passes & program::inside) calls.inner_statements += size_of({one});
            for (const auto& [text, passes] : texts)
                add(s.kind == Kind::when ? condition(s.when) : "", text, passes);
        }
    const auto append = [](PieceNumbers& to, const PieceNumbers& more) {
        to.insert(to.end(), more.begin(), more.end());
    };
    for (const auto& [passes, all] : parts) {
        const PieceNumbers some = functions("outputs", all);
        if (passes & program::first) append(calls.outputs, some);
        if (passes & program::again) append(calls.again, some);
        if (passes & program::inside) append(calls.inside, some);
        if (passes & program::between) append(calls.between, some);
    }
}

/// Computations stand in functions of their own.
std::string Generator::update_body(const Statements& all) {
    std::string text;
    for (auto first = all.begin(); first != all.end();) {
        const auto last = std::find_if_not(first, all.end(), is_computation);
        if (last != first) {
            text +=
                indented(unless(called(functions("updates", guarded({first, last}))), "return false;\n"), 4);
            first = last;
        } else {
            text += indented(text_of(*first++), 4);
        }
    }
    return text;
}

std::string Generator::called(const PieceNumbers& pieces) const {
    std::string text;
    for (const int i : pieces)
        text += (text.empty() ? "" : " && ") + call_of(pieces_[static_cast<std::size_t>(i)].name);
    return text.empty() ? "true" : text;
}

PieceNumbers Generator::functions(const std::string& family, const std::vector<Guarded>& all) {
    PieceNumbers made;
    Piece piece;
    const auto finish = [&] {
        if (piece.statements == 0) return;
        piece.name = family + "_" + number(++piece_numbers_[family]);
        declarations_.push_back(declaration_of(piece.name));
        made.push_back(static_cast<int>(pieces_.size()));
        pieces_.push_back(std::exchange(piece, {}));
    };
    for (const auto& g : all) {
        const int indent = g.condition.empty() ? 4 : 8;
        bool is_open = false;
        std::string title; // of the statement before
        const auto close = [&] {
            if (is_open && !g.condition.empty()) piece.body += "    }\n";
            is_open = false;
        };
        for (const auto& [statement, is_differentiable] : g.statements) {
            if (statement.empty()) continue;
            if (!is_open && !g.condition.empty()) piece.body += "    if (" + g.condition + ") {\n";
            is_open = true;
            piece.is_differentiable = piece.is_differentiable && is_differentiable && g.condition.empty();
            const auto line = statement.starts_with("//") ? statement.find('\n') + 1 : 0;
            const bool goes_on = line > 0 && title == statement.substr(0, line);
            title = statement.substr(0, line);
            piece.body += indented(goes_on ? statement.substr(line) : statement, indent);
            if (++piece.statements >= options_.statements_per_function) {
                close();
                finish();
                title.clear();
            }
        }
        close();
    }
    finish();
    return made;
}

} // namespace bf::codegen
