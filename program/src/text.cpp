// A program in words.
#include "bf/program/program.hpp"

#include "bf/base/numbers.hpp"

#include <cstdio>

namespace bf::program {

namespace {

using Kind = Statement::Kind;

class Text {
  public:
    explicit Text(const Program& program) : p_(program), d_(*program.diagram) {}

    std::string run() {
        std::uint8_t passes = 0;
        for (const auto& statement : p_.outputs) passes |= statement.passes;
        section("constants", p_.constants);
        section("start", p_.start);
        section("step", p_.step);
        shows_passes_ = passes != first;
        is_callers_ = (passes & between) != 0;
        section(is_callers_
                    ? "outputs (first in a step, again after events, inside it, between two by the caller)"
                : shows_passes_ ? "outputs (first in a step, again after events, inside it by the solver)"
                                : "outputs",
                p_.outputs);
        shows_passes_ = false;
        section("update", p_.update);
        section("derivatives", p_.derivatives);
        section("guards", p_.guards);
        section("marks", p_.marks);
        section("arrive at the end of a step", p_.arrive);
        section("event inside a step", p_.event);
        for (const auto& task : p_.tasks) {
            const std::string& its = flag(p_.hit[static_cast<std::size_t>(task.rate)]);
            section("hits at " + its, task.hits);
            section("outputs at " + its, task.outputs);
            section("update at " + its, task.update);
        }
        for (const auto& procedure : p_.procedures) section(procedure.name, procedure.body);
        return std::move(text_);
    }

  private:
    void section(const std::string& name, const Statements& statements) {
        if (statements.empty()) return;
        text_ += (text_.empty() ? "" : "\n") + name + ":\n";
        print(statements, "    ");
    }
    void line(const std::string& margin, const std::string& indent, const std::string& what) {
        text_ += margin + indent + what + "\n";
    }
    void print(const Statements& statements, const std::string& indent) {
        for (const auto& s : statements) {
            std::string margin;
            if (shows_passes_)
                margin = {' ', ' ', s.passes & first ? 'f' : ' ', s.passes & again ? 'a' : ' ',
                          s.passes & inside ? 'i' : ' '};
            if (shows_passes_ && is_callers_) margin += s.passes & between ? 'b' : ' ';
            line(margin, indent, words(s));
            print(s.body, indent + "    ");
            if (s.otherwise.empty()) continue;
            line(margin, indent, "otherwise");
            print(s.otherwise, indent + "    ");
        }
    }

    std::string words(const Statement& s) const {
        static constexpr const char* phases[] = {"output ", "update ", "derivative of ", "guards of "};
        switch (s.kind) {
        case Kind::run:
            return phases[static_cast<std::size_t>(s.phase)] + path(s.node) +
                   (s.index > 0 ? " (" + std::to_string(s.index + 1) + ")" : "");
        case Kind::commit: return "commit " + path(s.node);
        case Kind::reset: return "reset " + path(s.node);
        case Kind::rest: return "rest " + path(s.node);
        case Kind::set: {
            const Set& set = p_.sets[static_cast<std::size_t>(s.number)];
            return d_.end_path(set.quantity) +
                   " := " + (set.source.node >= 0 ? d_.end_path(set.source) : numbers(set.values));
        }
        case Kind::start: return "start all blocks";
        case Kind::constants: return "constants";
        case Kind::finite: return "fail unless " + d_.end_path(s.signal) + " is finite";
        case Kind::assign: return flag(s.flag) + " := " + (s.when.empty() ? "true" : all(s.when));
        case Kind::clear: return flag(s.flag) + " := false";
        case Kind::edge: return flag(s.flag) + " := " + edge(s.number);
        case Kind::hit: return "count " + flag(s.flag);
        case Kind::fire: return "clock of " + flag(p_.hit[static_cast<std::size_t>(s.number)]) + " goes on";
        case Kind::when: return "if " + all(s.when);
        case Kind::repeat: {
            const std::string most = s.signal.node >= 0 ? d_.end_path(s.signal) : std::to_string(s.number);
            return s.when.empty() ? "repeat " + most + " times"
                                  : "repeat while " + all(s.when) + ", at most " + most + " times";
        }
        case Kind::solve: return "solve the loop through " + path(s.node);
        case Kind::event: return "event of " + path(s.node);
        case Kind::look: return "look for crossings of guards";
        case Kind::locate: return "take the crossings that the solver found";
        case Kind::observe: return "observe the event";
        case Kind::restart: return "restart the solver";
        case Kind::integrate: return "integrate to the end of the step";
        case Kind::evaluate:
            return std::string("outputs, ") + (s.pass == first     ? "first"
                                               : s.pass == again   ? "again"
                                               : s.pass == between ? "between two steps"
                                                                   : "inside the step");
        case Kind::call: return p_.procedures[static_cast<std::size_t>(s.number)].name;
        case Kind::fail: return "fail at " + path(s.node) + ": " + s.failure.text();
        }
        return {};
    }

    static std::string numbers(const std::vector<double>& values) {
        std::string text;
        for (const double x : values) text += (text.empty() ? "" : ", ") + number_text(x);
        return values.empty() ? "0" : values.size() == 1 ? text : "[" + text + "]";
    }
    const std::string& path(int node) const { return d_.nodes[static_cast<std::size_t>(node)].path; }
    const std::string& flag(int number) const { return p_.flags[static_cast<std::size_t>(number)].name; }
    const Memory& memory(int number) const { return p_.memories[static_cast<std::size_t>(number)]; }
    std::string edge(int number) const {
        static constexpr const char* edges[] = {" rises", " falls", " rises or falls", " > 0"};
        return d_.end_path(memory(number).signal) + edges[static_cast<std::size_t>(memory(number).edge)];
    }
    std::string literal(const Literal& l) const {
        const std::string no = l.is_negated ? "not " : "";
        switch (l.kind) {
        case Literal::Kind::flag: break;
        case Literal::Kind::signal: return no + d_.end_path(l.signal) + " > 0";
        case Literal::Kind::memory: return no + d_.end_path(memory(l.number).signal) + " was > 0";
        case Literal::Kind::crossing: return path(l.number) + (l.is_negated ? " did not cross" : " crossed");
        }
        return no + flag(l.number);
    }
    std::string all(const std::vector<Literal>& literals) const {
        std::string text;
        for (const auto& l : literals) text += (text.empty() ? "" : " and ") + literal(l);
        return text;
    }

    const Program& p_;
    const Diagram& d_;
    bool shows_passes_ = false, is_callers_ = false;
    std::string text_;
};

} // namespace

std::string period_text(const Diagram& diagram, int rate) {
    const auto seconds = [](double time) {
        char text[32];
        std::snprintf(text, sizeof text, "%.12g s", time);
        return std::string(text);
    };
    const auto offset = diagram.rates[static_cast<std::size_t>(rate)].offset;
    return seconds(diagram.period(rate)) +
           (offset > 0 ? " + " + seconds(static_cast<double>(offset) * diagram.step) : "");
}

std::string text_of(const Program& program) { return Text(program).run(); }

} // namespace bf::program
