// State charts from files of SCXML (W3C, "State Chart XML (SCXML): State Machine Notation for Control
// Abstraction", 2015).
#include "actions.hpp"

#include "bf/base/numbers.hpp"
#include "bf/charts/chart.hpp"

#include <algorithm>
#include <boost/property_tree/xml_parser.hpp>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

namespace bf::charts {

namespace {

/// An element with its name, without the prefix of its namespace.
struct Element {
    std::string name;
    const boost::property_tree::ptree& tree;

    std::string attribute(const std::string& of) const {
        const auto all = tree.find("<xmlattr>");
        if (all == tree.not_found()) return {};
        const auto found = all->second.find(of);
        return found == all->second.not_found() ? "" : found->second.data();
    }
    template <class F> void each(const F& on_child) const {
        for (const auto& [name, child] : tree)
            if (!name.starts_with('<')) on_child(Element{name.substr(name.find(':') + 1), child});
    }
};
using Texts = std::vector<std::string>;

constexpr int deepest = 100; ///< nested elements

class XmlReader {
  public:
    explicit XmlReader(const std::string& file) : file_(file) {}

    Chart read(const Element& root) {
        chart_.is_completed = true;
        if (root.name != "scxml") refuse(root, "the file is no SCXML; it begins with <scxml>");
        const std::string language = root.attribute("datamodel");
        if (!language.empty() && language != "null" && language != "matlab")
            refuse(root, "its data model is '" + language +
                             "'; write formulas of this project, and datamodel=\"matlab\"");
        if (root.attribute("binding") == "late")
            refuse(root, "its data is bound late; assign to it in <onentry>, and leave the binding out");
        note_sends(root);
        chart_.root.initial = names(root.attribute("initial"));
        root.each([&](const Element& e) { child(e, chart_.root, 0); });
        find_events(chart_);
        if (!problems_.empty()) throw Refused(std::move(problems_));
        return std::move(chart_);
    }

  private:
    void refuse(const Element& e, const std::string& what) {
        problems_.push_back(file_ + ", <" + e.name + ">" +
                            (where_.empty() ? "" : " in state '" + where_ + "'") + ": " + what);
    }
    static Texts words(const std::string& text) {
        std::istringstream stream(text);
        Texts all;
        for (std::string word; stream >> word;) all.push_back(word);
        return all;
    }
    /// Identifiers of XML may have characters that names of states do not have.
    static std::string identifier(std::string id) {
        for (char& c : id)
            if (c == '-' || c == '.' || c == ':') c = '_';
        return id;
    }
    static Texts names(const std::string& text) {
        Texts all = words(text);
        std::ranges::transform(all, all.begin(), identifier);
        return all;
    }
    /// In('s') is the name of a state.
    static std::string formula(std::string text) {
        for (const char quote : {'\'', '"'})
            for (std::size_t at = text.find(std::string("In(") + quote); at != text.npos;
                 at = text.find(std::string("In(") + quote, at)) {
                const std::size_t end = text.find(std::string(1, quote) + ")", at + 4);
                if (end == text.npos) break;
                text.replace(at, end + 2 - at, "(" + identifier(text.substr(at + 4, end - at - 4)) + ")");
            }
        return trimmed(text);
    }
    void refuse_attributes(const Element& e, const std::set<std::string>& known) {
        const auto all = e.tree.find("<xmlattr>");
        if (all == e.tree.not_found()) return;
        for (const auto& [name, value] : all->second)
            if (!known.contains(name) && name.find(':') == name.npos && name != "xmlns")
                refuse(e, "it has the attribute '" + name + "', which is not read here");
    }

    void data(const Element& datamodel) {
        datamodel.each([&](const Element& e) {
            const std::string id = e.attribute("id"), value = formula(e.attribute("expr"));
            refuse_attributes(e, {"id", "expr"});
            const auto number = number_of(value);
            chart_.variables.emplace_back(id, number.value_or(0));
            if (!number && !value.empty()) chart_.root.begin += id + " = " + value + "\n";
        });
    }

    /// What stands in a state, or in the document.
    void child(const Element& e, State& around, int depth) {
        const std::string name = e.name;
        if (depth > deepest) return refuse(e, "its elements are nested too deeply");
        if (name == "state" || name == "parallel" || name == "final" || name == "history")
            return state(e, around, depth);
        if (name == "initial") return begin(e, around);
        if (name == "datamodel") return data(e); // of a state, too: it is there from the start
        const bool is_in_state = depth > 0;
        if (is_in_state && name == "onentry") return contents(e, around.entry, 0);
        if (is_in_state && name == "onexit") return contents(e, around.exit, 0);
        if (is_in_state && name == "transition") return transition(e, around);
        refuse(e, "it is not read here");
    }
    /// The way from a state to the one that begins in it, or from a history.
    void begin(const Element& e, State& from) {
        e.each([&](const Element& t) {
            from.initial = names(t.attribute("target"));
            contents(t, from.begin, 0);
        });
    }
    void state(const Element& e, State& around, int depth) {
        using Kind = State::Kind;
        const std::string name = e.name, id = e.attribute("id");
        State made{.name = id.empty() ? "state" + std::to_string(++unnamed_) : identifier(id)};
        if (!is_identifier(made.name)) refuse(e, "'" + id + "' is no name of a state here");
        refuse_attributes(e, {"id", "initial", "type"});
        made.initial = names(e.attribute("initial"));
        if (name == "parallel") made.kind = Kind::parallel;
        if (name == "final") made.kind = Kind::final;
        if (name == "history") {
            made.kind = e.attribute("type") == "deep" ? Kind::deep_history : Kind::shallow_history;
            begin(e, made);
        } else {
            const std::string around_it = std::exchange(where_, made.name);
            e.each([&](const Element& inner) { child(inner, made, depth + 1); });
            where_ = around_it;
        }
        around.states.push_back(std::move(made));
    }
    void transition(const Element& e, State& source) {
        Transition made;
        refuse_attributes(e, {"event", "cond", "target", "type"});
        made.to = names(e.attribute("target"));
        const Texts wanted = words(e.attribute("event"));
        for (const auto& event : wanted)
            if (event != "error" && !event.starts_with("error.")) made.events.push_back(event);
        if (made.events.empty() && !wanted.empty()) return; // errors are found before the first step
        made.condition = formula(e.attribute("cond"));
        made.is_internal = e.attribute("type") == "internal";
        contents(e, made.action, 0);
        source.transitions.push_back(std::move(made));
    }

    // ---- executable content

    void contents(const Element& block, std::string& action, int depth) {
        block.each([&](const Element& e) { content(e, action, depth); });
    }
    void content(const Element& e, std::string& action, int depth) {
        const std::string name = e.name;
        if (depth > deepest) return refuse(e, "its elements are nested too deeply");
        if (name == "raise") {
            action += "raise " + raised(e) + "\n";
        } else if (name == "assign") {
            refuse_attributes(e, {"location", "expr"});
            action += e.attribute("location") + " = " + formula(e.attribute("expr")) + "\n";
        } else if (name == "if") {
            action += "if " + formula(e.attribute("cond")) + "\n";
            contents(e, action, depth + 1);
            action += "end\n";
        } else if (name == "elseif") {
            action += "elseif " + formula(e.attribute("cond")) + "\n";
        } else if (name == "else") {
            action += "else\n";
        } else if (name == "send") {
            send(e, action);
        } else if (name == "cancel") {
            const auto sent = sends_.find(e.attribute("sendid"));
            refuse_attributes(e, {"sendid"});
            if (sent == sends_.end()) return refuse(e, "<cancel> names no id of a <send>");
            action += "cancel " + sent->second + "\n";
        } else if (name != "log") {
            refuse(e, "it is not read here");
        }
    }
    std::string raised(const Element& e) {
        const std::string event = e.attribute("event");
        if (event.empty()) refuse(e, "it has no event; write event=\"NAME\"");
        raised_.insert(event);
        return event;
    }
    void send(const Element& e, std::string& action) {
        refuse_attributes(e, {"event", "delay", "id", "target", "type"});
        const std::string event = raised(e), target = e.attribute("target"), delay = e.attribute("delay");
        if (target == "#_internal") {
            action += "raise " + event + "\n";
            return;
        }
        if (!target.empty())
            return refuse(e, "<send> has the target '" + target + "'; charts send to themselves");
        const bool is_milli = delay.ends_with("ms");
        const auto number = number_of(delay.empty()          ? "0"
                                      : is_milli             ? delay.substr(0, delay.size() - 2)
                                      : delay.ends_with('s') ? delay.substr(0, delay.size() - 1)
                                                             : "");
        if (!number || !(*number >= 0))
            return refuse(e, "<send> has the delay '" + delay + "'; write seconds, '1.5s', or '20ms'");
        action += "send " + event + " after " + number_text(is_milli ? *number / 1000 : *number) + "\n";
    }
    void note_sends(const Element& e) {
        if (e.name == "send" && !e.attribute("id").empty()) sends_[e.attribute("id")] = e.attribute("event");
        e.each([&](const Element& inner) { note_sends(inner); });
    }

    // ---- events

    void find_events(Chart& chart) {
        Texts awaited;
        visit(chart.root, awaited);
        for (const auto& wanted : awaited) {
            const std::string event = bare_event(wanted);
            const bool is_own =
                event == "*" || matches("done", event) ||
                std::ranges::any_of(raised_, [&](const auto& own) { return matches(event, own); });
            if (!is_own && std::ranges::find(chart.events, event) == chart.events.end())
                chart.events.push_back(event);
        }
    }
    static void visit(const State& state, Texts& awaited) {
        for (const auto& t : state.transitions)
            awaited.insert(awaited.end(), t.events.begin(), t.events.end());
        for (const auto& inner : state.states) visit(inner, awaited);
    }

    std::string file_, where_; ///< the file, and the state that is read
    std::vector<std::string> problems_;
    Chart chart_;
    std::map<std::string, std::string> sends_; ///< events by the ids of their elements
    std::set<std::string> raised_;
    int unnamed_ = 0;
};

/// Where the mark-up that begins here ends, as the parser sees it: values of attributes may have a '>'.
std::size_t end_of_markup(const std::string& text, std::size_t at, const std::string& file) {
    constexpr const char* pairs[][2] = {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}};
    for (const auto& [begin, end] : pairs)
        if (const std::size_t size = std::strlen(begin); text.compare(at, size, begin) == 0)
            return text.find(end, at + size);
    if (text[at + 1] == '!') {
        const std::size_t end = text.find('>', at);
        if (std::string_view(text).substr(at, end - at).find('[') != text.npos)
            throw Refused({file + ": it declares a type of document, which is not read here"});
        return end;
    }
    bool has_blank = false; // an attribute comes behind one
    char quote = 0, last = '<';
    for (; at < text.size(); ++at) {
        const char c = text[at];
        if (quote != 0)
            quote = c == quote ? '\0' : quote;
        else if ((c == '"' || c == '\'') && has_blank && last == '=')
            quote = c;
        else if (c == '>')
            return at;
        if (std::isspace(static_cast<unsigned char>(c)) != 0)
            has_blank = true;
        else
            last = c;
    }
    return text.npos;
}

/// Parsers call themselves for each element within another one.
void hold_to_depth(const std::string& text, const std::string& file) {
    int depth = 0;
    for (std::size_t i = text.find('<'); i != text.npos && i + 1 < text.size(); i = text.find('<', i)) {
        const char next = text[i + 1];
        i = std::min(end_of_markup(text, i, file), text.size() - 1);
        if (next == '/')
            --depth;
        else if (next != '?' && next != '!' && text[i - 1] != '/')
            ++depth;
        if (depth > 2 * deepest) throw Refused({file + ": its elements are nested too deeply"});
    }
}

} // namespace

Chart read_scxml(const std::string& file) {
    constexpr std::uintmax_t largest = 4'000'000;
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    if (error) throw Refused({"there is no file '" + file + "'; names are relative to the model's folder"});
    if (size > largest) throw Refused({file + ": the file has more than 4 MB; split the chart"});
    std::ifstream stream(file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(stream), {}};
    hold_to_depth(text, file);
    std::istringstream source(text);
    boost::property_tree::ptree document;
    try {
        boost::property_tree::read_xml(source, document, boost::property_tree::xml_parser::no_comments);
    } catch (const boost::property_tree::xml_parser_error& wrong) {
        throw Refused(
            {file + ":" + std::to_string(wrong.line()) + ": the file is no XML: " + wrong.message()});
    }
    for (const auto& [name, tree] : document)
        if (!name.starts_with('<')) return XmlReader(file).read({name.substr(name.find(':') + 1), tree});
    throw Refused({file + ": the file has no elements; it begins with <scxml>"});
}

} // namespace bf::charts
