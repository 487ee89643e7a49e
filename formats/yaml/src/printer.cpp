#include "printer.hpp"

#include "rows.hpp"
#include "scalar.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

using model::Quotes;

constexpr std::size_t max_width = 110;

bool may_flow(const Content& content) {
    return content.may_flow && content.kind != Content::Kind::literal &&
           std::ranges::all_of(content.items, [](const Item& inner) {
               return (!inner.comments || inner.comments->empty()) && may_flow(inner.content);
           });
}

std::string flow(const Content& content) {
    if (content.kind == Content::Kind::scalar) return content.text;
    const bool map = content.kind == Content::Kind::map;
    std::string line = map ? "{" : "[";
    for (const Item& inner : content.items)
        line += (line.size() > 1 ? ", " : "") + (map ? inner.key + ": " : "") + flow(inner.content);
    return line + (map ? "}" : "]");
}

std::string head_of(const Item& item) { return item.key.empty() ? "-" : item.key + ":"; }

bool is_one_line(std::string_view text) { return text.find('\n') == text.npos; }

/// The items, where their order means nothing (they have no place of their own), as the text has them.
std::vector<const Item*> in_order_of(const Content& content, const Entry& entry) {
    std::vector<const Item*> items;
    for (const Item& item : content.items) items.push_back(&item);
    if (content.kind != Content::Kind::map ||
        std::ranges::any_of(content.items, [](const Item& item) { return item.where; }))
        return items;
    std::ranges::stable_sort(items, {}, [&](const Item* item) {
        return std::ranges::find(entry.entries, item->key,
                                 [](const Entry& e) { return key_text(e.key->text); }) -
               entry.entries.begin();
    });
    return items;
}

/// Whether the value in the text is of the same kind as what is to be written.
bool is_alike(const Content& content, const Node& value) {
    return content.kind == Content::Kind::map ? value.is_map()
                                              : content.kind == Content::Kind::list && value.is_sequence();
}

} // namespace

void Printer::print(const Item& item, int indent, Entry* parent) {
    Entry* entry = base_ ? base_->find(item, parent) : nullptr;
    if (entry && !entry->in_brackets) return print_edited(item, *entry, indent);
    if (item.comments) print_lines(item.comments->before, indent);
    text.append(indent, ' ');
    text += head_of(item);
    print_value(item, indent);
}

void Printer::print_value(const Item& item, int indent) {
    static const std::string none;
    const std::string& trailing = item.comments ? item.comments->trailing : none;
    const Content& content = item.content;
    const std::size_t column = indent + width(item.key) + 2;
    if (content.kind == Content::Kind::scalar) return print_scalar(content.text, column, trailing);
    if (content.kind == Content::Kind::literal) {
        text += content.text.ends_with('\n') ? " |" : " |-";
        end_line(trailing);
        return print_literal(content.text, indent + 2);
    }
    const bool empty = content.items.empty();
    const std::string line = empty || may_flow(content) ? flow(content) : "";
    if (empty || (!line.empty() && column + width(line) <= max_width)) {
        text += " " + line;
        return end_line(trailing);
    }
    end_line(trailing);
    for (const Item& inner : content.items) print(inner, indent + 2);
}

void Printer::print_lines(const std::vector<std::string>& lines, int indent) {
    for (const std::string& line : lines)
        text += line.empty() ? "\n" : std::string(indent, ' ') + line + "\n";
}

void Printer::end_line(const std::string& trailing) {
    if (!trailing.empty()) text += (trailing[0] == '#' ? "  " : "") + trailing;
    text += '\n';
}

/// A scalar, whose further lines (of a matrix) stand under its first element. The comment follows the last
/// line: a line that ends with ';' goes on behind the break, where YAML allows none.
void Printer::print_scalar(std::string_view scalar, std::size_t column, const std::string& trailing) {
    text += ' ';
    for (char c : scalar) {
        text += c;
        if (c == '\n') text.append(column + 1, ' ');
    }
    end_line(trailing);
}

void Printer::print_literal(std::string_view lines, int indent) {
    if (lines.ends_with('\n')) lines.remove_suffix(1);
    for (std::size_t begin = 0; begin <= lines.size();) {
        const std::size_t end = std::min(lines.find('\n', begin), lines.size());
        if (end > begin) text.append(indent, ' ');
        text += lines.substr(begin, end - begin);
        text += '\n';
        begin = end + 1;
    }
}

void Printer::add_shifted(std::string_view lines, int shift) {
    while (!lines.empty()) {
        const std::size_t end = std::min(lines.find('\n'), lines.size() - 1) + 1;
        std::string_view line = lines.substr(0, end);
        const std::size_t blanks = std::min(line.find_first_not_of(' '), line.size());
        if (shift < 0) line.remove_prefix(std::min<std::size_t>(blanks, -shift));
        if (shift > 0 && blanks < line.size() && line[blanks] != '\n') text.append(shift, ' ');
        text += line;
        lines.remove_prefix(end);
    }
}

void Printer::print_rest(const Entry& entry, int shift) {
    for (const Entry& each : entry.entries)
        if (!each.is_used && !each.old) add_shifted(base_->text(each.begin, each.end), shift);
}

void Printer::print_edited(const Item& item, Entry& entry, int indent) {
    const Base& base = *base_;
    const Content& content = item.content;
    const Node& value = *entry.value;
    const int shift = indent - entry.indent;
    const auto all = base.text(entry.begin, entry.end);
    if (entry.old && is_same(*entry.old, item)) return add_shifted(all, shift);

    add_shifted(base.text(entry.begin, entry.head - entry.indent), shift);
    text.append(indent, ' ');
    text += entry.old && entry.old->key == item.key ? std::string(base.text(entry.head, entry.head_end))
                                                    : head_of(item);
    if (entry.old && is_same(entry.old->content, content)) {
        const std::string_view rest = base.text(entry.head_end, entry.end);
        const std::size_t line = rest.find('\n') + 1;
        text += rest.substr(0, line);
        return add_shifted(rest.substr(line), shift);
    }
    if (const auto rows = rows_edited(content, entry, entry.head_end)) {
        const std::size_t line = rows->find('\n') + 1;
        text += rows->substr(0, line);
        return add_shifted(std::string_view(*rows).substr(line), shift);
    }
    if (entry.has_lines() && is_alike(content, value) && !content.items.empty()) {
        text += base.text(entry.head_end, entry.entries[0].begin);
        const int inner = entry.entries[0].indent + shift;
        for (const Item* each : in_order_of(content, entry)) print(*each, inner, &entry);
        return print_rest(entry, shift);
    }
    std::optional<std::string> replaced;
    const std::string_view gap =
        value.position > entry.head_end ? base.text(entry.head_end, value.position) : "";
    const bool is_scalar = content.kind == Content::Kind::scalar;
    if (value.flow && is_alike(content, value))
        replaced = flow_edited(content, entry);
    else if (is_scalar && is_one_line(content.text) && value.quotes != Quotes::literal &&
             (value.is_scalar() || value.flow))
        replaced = content.text;
    if (replaced && is_one_line(gap)) {
        const std::string_view rest = base.text(value.end, entry.end);
        const std::size_t column = indent + width(head_of(item)) + width(gap) + width(*replaced);
        const bool is_longer = content.items.size() > entry.entries.size() && column > max_width;
        if (!is_longer) {
            const std::string lines = std::string(gap) + *replaced + std::string(rest);
            const std::size_t first = lines.find('\n') + 1;
            text += lines.substr(0, first);
            return add_shifted(std::string_view(lines).substr(first), shift);
        }
    }
    const std::string_view header =
        base.text(value.position, std::min(all.size() + entry.begin, base.text().find('\n', value.position)));
    const std::string_view bar = content.text.ends_with('\n') ? "|" : "|-";
    if (content.kind == Content::Kind::literal && value.quotes == Quotes::literal &&
        header.starts_with(bar) && (header.size() == bar.size() || header[bar.size()] == ' ')) {
        text += std::string(gap) + std::string(header) + "\n";
        return print_literal(content.text, indent + 2);
    }
    print_value(item, indent);
}

std::optional<std::string> Printer::rows_edited(const Content& content, const Entry& entry,
                                                std::size_t begin) {
    const model::Expression* const before = entry.old ? entry.old->content.value : nullptr;
    if (!before || !content.value || !entry.value->is_sequence()) return {};
    return edited_rows(base_->text(), begin, entry.end, *entry.value, *before, *content.value);
}

std::optional<std::string> Printer::flow_edited(const Content& content, Entry& entry) {
    const Node& value = *entry.value;
    const std::size_t open = value.position + 1, close = value.end - 1;
    const std::vector<const Item*> items = in_order_of(content, entry);
    std::vector<Entry*> found;
    for (const Item* item : items) found.push_back(base_->find(*item, &entry));
    const auto& entries = entry.entries;
    const bool keeps_gaps =
        found.size() == entries.size() &&
        std::ranges::equal(found, entries, [](const Entry* a, const Entry& b) { return a == &b; });
    std::string result(1, base_->text()[value.position]), gaps;
    std::size_t at = open;
    for (const Entry& each : entries) gaps += base_->text(at, each.begin), at = each.end;
    const std::string_view last_gap = base_->text(at, close);
    const bool is_plain =
        gaps.find_first_of("#\n") == gaps.npos && last_gap.find_first_of("#\n") == last_gap.npos;
    if (!keeps_gaps && !is_plain) return {}; // comments and lines in brackets have their places

    const auto gap_before = [&](std::size_t i) -> std::string_view {
        const Entry* now = found[i];
        if (!now || now < entries.data() || now >= entries.data() + entries.size()) return i == 0 ? "" : ", ";
        if (i == 0) return now == entries.data() ? base_->text(open, now->begin) : "";
        return found[i - 1] && found[i - 1] + 1 == now ? base_->text(found[i - 1]->end, now->begin) : ", ";
    };
    for (std::size_t i = 0; i < content.items.size(); ++i) {
        const auto item = flow_item(*items[i], found[i] && found[i]->in_brackets ? found[i] : nullptr);
        if (!item) return {};
        result += gap_before(i);
        result += *item;
    }
    const bool keeps_end = !found.empty() && !entries.empty() && found.back() == &entries.back();
    if (keeps_end || content.items.empty()) result += keeps_end ? last_gap : "";
    return result + base_->text()[close];
}

std::optional<std::string> Printer::flow_item(const Item& item, Entry* entry) {
    if (entry && entry->old && is_same(*entry->old, item))
        return std::string(base_->text(entry->begin, entry->end));
    if (!entry && item.comments && !item.comments->empty()) return {};
    std::string head = item.key.empty() ? "" : item.key + ": ";
    const bool has_value = entry && entry->key && !entry->value->is_null();
    if (has_value && entry->old && entry->old->key == item.key)
        head = base_->text(entry->begin, entry->value->position);
    const Content& content = item.content;
    if (has_value && entry->old && is_same(entry->old->content, content))
        return head + std::string(base_->text(entry->value->position, entry->end));
    if (entry && entry->value->flow && is_alike(content, *entry->value)) {
        const auto inner = flow_edited(content, *entry);
        if (!inner) return {};
        return head + *inner;
    }
    if (has_value)
        if (const auto rows = rows_edited(content, *entry, entry->value->position)) return head + *rows;
    if (content.kind == Content::Kind::literal || !is_one_line(content.text)) return {};
    if (content.kind == Content::Kind::scalar)
        return head + (content.may_flow ? content.text : double_quoted(content.text));
    std::string list(1, content.kind == Content::Kind::map ? '{' : '[');
    for (const Item& each : content.items) {
        const auto inner = flow_item(each, nullptr);
        if (!inner) return {};
        list += (list.size() > 1 ? ", " : "") + *inner;
    }
    return head + list + (content.kind == Content::Kind::map ? '}' : ']');
}

} // namespace bf::formats
