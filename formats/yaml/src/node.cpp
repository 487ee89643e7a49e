#include "node.hpp"

#include <algorithm>
#include <sstream>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

namespace bf::formats {
namespace {

using Extents = std::vector<std::pair<std::size_t, std::size_t>>;

/// Where the quoted scalar ends that begins at `begin` (behind its closing quote); npos if it is not closed.
std::size_t quoted_end(std::string_view text, std::size_t begin) {
    const char quote = text[begin];
    for (std::size_t i = begin + 1; i < text.size(); ++i) {
        if (quote == '"' && text[i] == '\\')
            ++i;
        else if (text[i] == quote && quote == '\'' && i + 1 < text.size() && text[i + 1] == quote)
            ++i;
        else if (text[i] == quote)
            return i + 1;
    }
    return std::string_view::npos;
}

/// The lines of the literal scalar whose header stands at `header`: all that follow, blank or indented as far
/// as the first of them that is not blank.
std::pair<std::size_t, std::size_t> literal_extent(std::string_view text, std::size_t header) {
    std::size_t line = std::min(text.find('\n', header), text.size() - 1) + 1;
    const std::size_t begin = line;
    std::size_t end = line, indent = std::string_view::npos;
    while (line < text.size()) {
        const std::size_t line_end = std::min(text.find('\n', line), text.size());
        const std::size_t first = text.find_first_not_of(' ', line);
        if (first < line_end) {
            if (indent == std::string_view::npos) indent = first - line;
            if (first - line < indent || indent == 0) break;
            end = line_end;
        }
        line = line_end + 1;
    }
    return {begin, end};
}

/// Where the plain scalar ends that begins at `begin`: the parser only folds its blanks and line ends.
std::size_t plain_end(std::string_view text, std::size_t begin, std::string_view value) {
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\n'; };
    std::size_t end = begin;
    for (const char c : value) {
        if (is_blank(c)) continue;
        while (end < text.size() && is_blank(text[end])) ++end;
        end = std::min(end + 1, text.size());
    }
    return end;
}

/// Behind the bracket that closes a flow collection whose last item ends at `at`.
std::size_t bracket_end(std::string_view text, std::size_t at) {
    for (; at < text.size() && text[at] != ']' && text[at] != '}'; ++at)
        if (text[at] == '#') at = std::min(text.find('\n', at), text.size() - 1);
    return std::min(at + 1, text.size());
}

/// Builds the tree from the parser's events.
class TreeBuilder : public YAML::EventHandler {
  public:
    TreeBuilder(const Source& source, Extents& quoted) : source_(source), quoted_(quoted) {}

    Node root;
    std::vector<model::Diagnostic> wrong;

    void OnDocumentStart(const YAML::Mark& mark) override {
        if (++documents_ != 2) return;
        const bool marked =
            source_.text.compare(std::min<std::size_t>(mark.pos, source_.text.size()), 3, "---") == 0;
        if (marked)
            refuse(mark, "a second YAML document", "a model file holds one document");
        else
            refuse(mark, "the YAML syntax is wrong: text outside of the mapping", "write `key: value` lines");
    }
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        refuse_anchor(mark, anchor);
        close(node(Node::Kind::null, mark));
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
        refuse(mark, "a YAML alias", "give the value a name in `variables` and use it in expressions");
        close(node(Node::Kind::null, mark));
    }
    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        refuse_anchor(mark, anchor);
        refuse_tag(mark, tag);
        Node scalar = node(Node::Kind::scalar, mark);
        scalar.text = value;
        const char first = scalar.position < source_.text.size() ? source_.text[scalar.position] : ' ';
        if (first == '\'' || first == '"') {
            scalar.quotes = first == '"' ? model::Quotes::twofold : model::Quotes::single;
            quoted_.emplace_back(scalar.position, quoted_end(source_.text, scalar.position));
            if (quoted_.back().second == std::string::npos)
                refuse(mark, "a quote that is not closed", std::string("end the text with ") + first);
        } else if (first == '|' || first == '>') {
            scalar.quotes = model::Quotes::literal;
            quoted_.push_back(literal_extent(source_.text, scalar.position));
        }
        scalar.end =
            scalar.quoted() ? quoted_.back().second : plain_end(source_.text, scalar.position, scalar.text);
        close(std::move(scalar));
    }
    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value style) override {
        open(Node::Kind::sequence, mark, tag, anchor, style);
    }
    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value style) override {
        open(Node::Kind::map, mark, tag, anchor, style);
    }
    void OnSequenceEnd() override { close_top(); }
    void OnMapEnd() override { close_top(); }

    void refuse(const YAML::Mark& mark, std::string message, std::string remedy) {
        wrong.push_back(
            {source_.at(mark.line + 1, mark.column + 1), "", std::move(message), std::move(remedy)});
    }

  private:
    Node node(Node::Kind kind, const YAML::Mark& mark) const {
        return {.kind = kind,
                .line = mark.line + 1,
                .column = mark.column + 1,
                .position = static_cast<std::size_t>(mark.pos)};
    }
    void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
        if (anchor)
            refuse(mark, "a YAML anchor", "give the value a name in `variables` and use it in expressions");
    }
    void refuse_tag(const YAML::Mark& mark, const std::string& tag) {
        if (!tag.empty() && tag != "?" && tag != "!")
            refuse(mark, "the YAML tag '" + tag + "'", "remove it: types follow from the blocks");
    }
    void open(Node::Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
              YAML::EmitterStyle::value style) {
        refuse_anchor(mark, anchor);
        refuse_tag(mark, tag);
        stack_.push_back(node(kind, mark));
        stack_.back().flow = style == YAML::EmitterStyle::Flow;
    }
    void close_top() {
        Node done = std::move(stack_.back());
        stack_.pop_back();
        done.end = done.items.empty() ? done.position + done.flow : done.items.back().end;
        if (done.flow) done.end = bracket_end(source_.text, done.end);
        close(std::move(done));
    }
    void close(Node done) {
        if (stack_.empty()) {
            if (documents_ == 1) root = std::move(done);
            return;
        }
        std::vector<Node>& items = stack_.back().items;
        const bool is_key = stack_.back().is_map() && items.size() % 2 == 0;
        if (done.is_null() && !is_key) { // the parser's mark of a missing value is that of the next token
            const Node& last = items.empty() ? stack_.back() : items.back();
            done.line = last.line;
            done.column = last.column;
            done.position = done.end = last.end;
        }
        items.push_back(std::move(done));
    }

    const Source& source_;
    Extents& quoted_;
    std::vector<Node> stack_;
    int documents_ = 0;
};

/// The first byte that is not UTF-8 or a control character other than tab and line end, else npos.
std::size_t first_bad_byte(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
        const auto byte = static_cast<unsigned char>(text[i]);
        if ((byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f) return i;
        const std::size_t more = byte < 0x80       ? 0
                                 : byte >> 5 == 6  ? 1
                                 : byte >> 4 == 14 ? 2
                                 : byte >> 3 == 30 ? 3
                                                   : 4;
        if (more == 4 || i + more >= text.size() + (more == 0)) return i;
        unsigned code = more == 0 ? byte : byte & (0x3f >> more);
        for (std::size_t k = 1; k <= more; ++k) {
            const auto next = static_cast<unsigned char>(text[i + k]);
            if (next >> 6 != 2) return i;
            code = code << 6 | (next & 0x3f);
        }
        const unsigned least[] = {0, 0x80, 0x800, 0x10000};
        if (code < least[more] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return i;
        i += more + 1;
    }
    return std::string_view::npos;
}

void report_tabs(const Source& source, const Extents& quoted, std::vector<model::Diagnostic>& wrong) {
    for (int number = 1; number <= source.line_count(); ++number) {
        const std::string_view line = source.line(number);
        const std::size_t first = line.find_first_not_of(" \t"), tab = line.find('\t');
        if (first == line.npos || tab > first) continue;
        const std::size_t position = source.line_starts[number - 1] + tab;
        const bool inside = std::ranges::any_of(
            quoted, [&](const auto& extent) { return extent.first <= position && position < extent.second; });
        if (inside) continue;
        wrong.push_back({source.at(position), "", "a tab in the indentation", "indent by blanks"});
        return;
    }
}

/// What a person can do about a syntax error; the parser's messages say only what it expected.
const char* syntax_remedy(std::string_view message) {
    if (message.find("flow") != message.npos || message.find("EOF") != message.npos)
        return "close the bracket or quote; inside [ ] and { } put expressions with ',' or brackets in "
               "double quotes";
    return "check the indentation; put expressions with ': ', ' #' or a leading bracket in double quotes";
}

} // namespace

Source::Source(std::string_view raw, const std::string& name)
    : file(std::make_shared<const std::string>(name)) {
    if (raw.starts_with("\xef\xbb\xbf")) raw.remove_prefix(3);
    text.reserve(raw.size() + 1);
    for (std::size_t i = 0; i < raw.size(); ++i)
        if (raw[i] != '\r')
            text += raw[i];
        else if (i + 1 == raw.size() || raw[i + 1] != '\n')
            text += '\n';
    if (!text.empty() && text.back() != '\n') text += '\n';
    for (std::size_t start = 0; start < text.size(); start = text.find('\n', start) + 1)
        line_starts.push_back(start);
}

std::string_view Source::line(int number) const {
    const std::size_t start = line_starts[number - 1];
    return std::string_view(text).substr(start, text.find('\n', start) - start);
}

int Source::line_of(std::size_t position) const {
    return static_cast<int>(std::ranges::upper_bound(line_starts, position) - line_starts.begin());
}

model::Location Source::at(std::size_t position) const {
    const int number = line_of(position);
    return at(number, number > 0 ? static_cast<int>(position - line_starts[number - 1]) + 1 : 1);
}

Node parse(const Source& source, Extents& quoted) {
    if (const std::size_t bad = first_bad_byte(source.text); bad != std::string::npos)
        throw model::Errors(
            {{source.at(bad), "", "a byte that is no text in UTF-8",
              "save the file as UTF-8, and write control characters as escapes in double quotes"}});
    TreeBuilder builder(source, quoted);
    try {
        std::istringstream in(source.text);
        YAML::Parser parser(in);
        // The parser finds documents without end where it cannot go on, such as at a ',' outside of brackets.
        for (int document = 0; document < 2 && parser.HandleNextDocument(builder); ++document) {
        }
    } catch (const YAML::Exception& error) {
        const int last = std::max(1, source.line_count());
        const YAML::Mark& mark = error.mark;
        const bool known = !mark.is_null() && mark.line < last;
        const model::Location where = known ? source.at(mark.line + 1, mark.column + 1) : source.at(last, 1);
        if (const auto* const deep = dynamic_cast<const YAML::DeepRecursion*>(&error))
            builder.wrong.push_back({where, "",
                                     "values are nested more than " + std::to_string(deep->depth()) + " deep",
                                     "close brackets where they end, and put parts into files of their own"});
        else
            builder.wrong.push_back(
                {where, "", "the YAML syntax is wrong: " + error.msg, syntax_remedy(error.msg)});
    }
    std::vector<model::Diagnostic> tabs;
    report_tabs(source, quoted, tabs);
    if (!tabs.empty()) throw model::Errors(std::move(tabs)); // what else is wrong may come of it
    if (!builder.wrong.empty()) throw model::Errors(std::move(builder.wrong));
    return std::move(builder.root);
}

} // namespace bf::formats
