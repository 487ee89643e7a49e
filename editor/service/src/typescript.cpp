#include "typescript.hpp"

#include "bf/realtime/statistics.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

namespace bf::service {

using namespace std::string_view_literals;

namespace {

/// The headers that declare what is said, by their names.
constexpr std::pair<std::string_view, std::string_view> headers[] = {
#include "declarations.inc"
};

bool is_letter(char c) { return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0; }

std::string trimmed(std::string_view text) {
    const auto begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t");
    return begin == text.npos ? "" : std::string(text.substr(begin, end - begin + 1));
}

void add_words(std::string& text, const std::string& more) {
    text += (text.empty() || more.empty() ? "" : " ") + more;
}

std::string last_word(std::string_view text) {
    auto end = text.size();
    while (end > 0 && !is_letter(text[end - 1])) --end;
    auto begin = end;
    while (begin > 0 && is_letter(text[begin - 1])) --begin;
    return std::string(text.substr(begin, end - begin));
}

/// "int a = 0, b = 0" gives "a" and "b".
std::vector<std::string> names_in(std::string_view declaration) {
    std::vector<std::string> names;
    int depth = 0;
    std::string part;
    const auto take = [&] { names.push_back(last_word(std::exchange(part, {}))); };
    bool is_value = false;
    for (const char c : declaration) {
        if (c == '<' || c == '{' || c == '(') ++depth;
        if (c == '>' || c == '}' || c == ')') --depth;
        if (c == '=' && depth == 0) is_value = true;
        if (c == ',' && depth == 0)
            take(), is_value = false;
        else if (!is_value)
            part += c;
    }
    take();
    return names;
}

/// "Action" of "std::optional<Action> action = {}".
std::string type_in(std::string_view declaration) {
    const auto value = std::min(declaration.find('='), declaration.size());
    const auto end = declaration.substr(0, value).find('>');
    if (end != declaration.npos) return last_word(declaration.substr(0, end));
    const auto name = declaration.substr(0, std::min(declaration.find(','), value));
    return last_word(name.substr(0, name.rfind(last_word(name))));
}

/// What the headers say, by "Type", "Type.member" and "Enumeration": the comments before a declaration, and
/// the one behind it. The layout is that of the formatter.
class Comments {
  public:
    explicit Comments(std::string_view text) {
        std::string before;          // the comment that stands before what comes next
        std::string* open = nullptr; // the comment that may go on in the next line
        for (std::size_t at = 0; at < text.size();) {
            const auto end = std::min(text.find('\n', at), text.size());
            const std::string line = trimmed(text.substr(at, end - at));
            at = end + 1;
            const auto mark = line.find("///");
            const std::string code = trimmed(std::string_view(line).substr(0, mark));
            const std::string comment =
                mark == line.npos
                    ? ""
                    : trimmed(std::string_view(line).substr(line.find_first_not_of("/<", mark)));
            const bool is_behind = line.compare(std::min(mark, line.size()), 4, "///<") == 0;
            if (code.empty()) {
                if (is_behind && open)
                    add_words(*open, comment);
                else if (mark != line.npos)
                    add_words(before, comment);
                else
                    before.clear();
                continue;
            }
            open = declare(code, before, comment);
        }
    }

    std::map<std::string, std::string> all;

  private:
    /// Returns the comment that a next line may go on with.
    std::string* declare(const std::string& code, std::string& before, const std::string& comment) {
        for (const auto& [key, is_one] : {std::pair("struct "sv, false), std::pair("enum class "sv, true)})
            if (code.starts_with(key) && code.ends_with("{")) {
                names_.push_back(last_word(code));
                is_enumeration_ = is_one;
                if (is_one) all.erase(names_.back() + "."); // another one of that name
                add_words(all[names_.back()], std::exchange(before, {}));
                return nullptr;
            }
        if (names_.empty()) return before.clear(), nullptr;
        if (code.starts_with("}")) {
            names_.pop_back();
            is_enumeration_ = false;
            return before.clear(), nullptr;
        }
        add_words(before, comment);
        if (is_enumeration_) { // its words are said where it is a member
            if (before.empty()) return nullptr;
            std::string& words = all[names_.back() + "."];
            words += (words.empty() ? "" : "; ") + last_word(code) + ": " + std::exchange(before, {});
            return &words;
        }
        add_words(declaration_, code);
        if (!code.ends_with(";")) return nullptr;
        const std::string type = type_in(declaration_), text = std::exchange(before, {});
        std::string* last = nullptr;
        for (const auto& name : names_in(std::exchange(declaration_, {}))) {
            last = &all[names_.back() + "." + name];
            add_words(*last, text);
            if (const auto words = all.find(type + "."); words != all.end() && !words->second.empty())
                *last += (last->empty() ? "" : "; ") + words->second;
        }
        return last;
    }

    std::vector<std::string> names_;
    bool is_enumeration_ = false;
    std::string declaration_; ///< what was read of it
};

const Comments& comments() {
    static const Comments found = [] {
        std::string text;
        for (const auto& [name, content] : headers) text += std::string(content) + "\n";
        return Comments(text);
    }();
    return found;
}

/// What the protocol says before its declarations.
std::string protocol_introduction() {
    std::string text;
    for (const auto& [name, content] : headers) {
        if (!name.ends_with("protocol.hpp")) continue;
        for (std::size_t at = 0; content.substr(at).starts_with("//");) {
            const auto end = content.find('\n', at);
            text += std::string(content.substr(at, end + 1 - at));
            at = end + 1;
        }
    }
    return text;
}

/// What people call the causes of missed deadlines, by the members of TimingMisses.
std::string typescript_causes() {
    std::string text = "export const cause_texts: Record<keyof TimingMisses, string> = {\n";
    for (std::size_t i = 0; i < realtime::Statistics().misses.size(); ++i) {
        const auto cause = static_cast<realtime::Cause>(i);
        text += "  " + std::string(name(cause)) + ": \"" + realtime::text(cause) + "\",\n";
    }
    return text + "};\n";
}

/// What the declaration of a type or of its member says, as a comment of TypeScript; empty: nothing.
std::string typescript_comment(const std::string& declared, const std::string& indent) {
    const auto found = comments().all.find(declared);
    if (found == comments().all.end() || found->second.empty()) return "";
    return indent + "/** " + found->second + " */\n";
}

} // namespace

std::string typescript_list(const std::string& item) {
    return item.find(' ') == std::string::npos ? item + "[]" : "(" + item + ")[]";
}

std::string typescript_choice(const Words& words) {
    std::string all;
    for (const auto& word : words) all += (all.empty() ? "\"" : " | \"") + word + "\"";
    return all;
}

void add_typescript_member(std::string& members, const std::string& owner, const std::string& name,
                           const std::string& type) {
    members += typescript_comment(owner + "." + name, "  ") + "  " + name + ": " + type + ";\n";
}

std::string typescript_interface(const std::string& name, const std::string& members) {
    return typescript_comment(name, "") + "export interface " + name + " {\n" + members + "}\n";
}

std::string typescript_protocol(std::map<std::string, std::string> types, const std::string& methods) {
    const std::string notifications =
        "  changed: " + typescript_of<DocumentState>(types) + "; // by a page, or by another program\n" +
        "  run: " + typescript_of<RunState>(types) + ";\n" + "  live: " + typescript_of<LiveReport>(types) +
        "; // of the program that is attached\n" + "  recorded: " + typescript_of<Recorded>(types) +
        "; // what was asked for by `read`\n";
    std::string text =
        protocol_introduction() +
        "//\n// Written by scripts/update-reference from editor/service/include/bf/service/protocol.hpp.\n\n"
        "export const protocol = " +
        std::to_string(protocol_version) + ";\n\n";
    for (const auto& [name, declaration] : types) text += declaration + "\n";
    text += typescript_causes() + "\n";
    return text + "export interface Methods {\n" + methods + "}\nexport type Method = keyof Methods;\n\n" +
           "export interface Notifications {\n" + notifications + "}\n";
}

} // namespace bf::service
