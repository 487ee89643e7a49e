#include "event.hpp"

#include "bf/base/elements.hpp"
#include "bf/base/value_text.hpp"

#include "session.hpp"

#include <cmath>
#include <regex>

namespace bf::tools {

namespace {

std::string trimmed(const std::string& text) {
    const auto begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t");
    return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

} // namespace

bool Event::operator()(const Simulation& simulation) const {
    return holds(read_value(simulation.context().data(signal.node, signal.slot),
                            simulation.diagram().slot(signal).type, element));
}

Node::End find_signal(const Diagram& diagram, const std::string& path) {
    std::vector<std::string> names;
    for (const auto& input : diagram.inputs) {
        if (input.path == path) return input.end;
        names.push_back(input.path);
    }
    if (const auto end = diagram.find_signal(path); end.node >= 0) return end;
    for (const auto& signal : diagram.signals()) names.push_back(signal.path);
    throw CommandError("there is no signal '" + path + "'" + did_you_mean(path, names) +
                       "; bf check lists the signals");
}

Element parse_element(const Diagram& diagram, const std::string& text) {
    const auto [path, which] = split_element(text);
    Element element{std::string(path), find_signal(diagram, std::string(path)), 0};
    const Size& size = diagram.slot(element.signal).size;
    element.index = bf::find_element(which, size.rows, size.cols, diagram.element_names(element.signal));
    if (element.index >= 0) return element;
    const std::string first = element.path + diagram.element_text(element.signal, 0);
    throw CommandError("'" + text + "' is no element: '" + element.path + "' has " +
                       (size.is_scalar() ? "only one"
                        : size.cols > 1  ? std::to_string(size.rows) + " x " + std::to_string(size.cols)
                                         : std::to_string(size.rows)) +
                       (size.is_scalar() ? "; call it " : ", counted from 1; name one, e.g. ") + first);
}

Event parse_event(const Diagram& diagram, const std::string& text) {
    static const std::regex form(R"((.*?)(>=|<=|==|~=|!=|>|<)(.*))");
    std::smatch parts;
    double limit = 0;
    const auto is_number = [&](const std::string& number) {
        return read_value(number, limit).empty() && !std::isnan(limit);
    };
    if (!std::regex_match(text, parts, form) || !is_number(trimmed(parts[3])))
        throw CommandError("'" + text +
                           "' is no event; write SIGNAL, one of > >= < <= == ~=, and a number, "
                           "e.g. --until 'controller.x > 0.3'");
    const Element element = parse_element(diagram, trimmed(parts[1]));
    const std::string comparison = parts[2];
    Event event{text, element.signal, element.index, {}};
    if (comparison == ">") event.holds = [limit](double x) { return x > limit; };
    if (comparison == ">=") event.holds = [limit](double x) { return x >= limit; };
    if (comparison == "<") event.holds = [limit](double x) { return x < limit; };
    if (comparison == "<=") event.holds = [limit](double x) { return x <= limit; };
    if (comparison == "==") event.holds = [limit](double x) { return x == limit; };
    if (comparison == "~=" || comparison == "!=") event.holds = [limit](double x) { return x != limit; };
    return event;
}

} // namespace bf::tools
