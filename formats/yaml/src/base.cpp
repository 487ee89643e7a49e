#include "base.hpp"

#include "scalar.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

const Item* find_old(const Content& old, const Node& head, bool is_map) {
    for (const Item& item : old.items)
        if (item.where && item.where->line == head.line && item.where->column == head.column) return &item;
    for (const Item& item : old.items)
        if (is_map && item.key == key_text(head.text)) return &item;
    return nullptr;
}

} // namespace

bool is_same(const Content& a, const Content& b) {
    return a.kind == b.kind && a.text == b.text &&
           std::ranges::equal(a.items, b.items, [](const Item& x, const Item& y) { return is_same(x, y); });
}

bool is_same(const Item& a, const Item& b) { return a.key == b.key && is_same(a.content, b.content); }

Base::Base(const Source& source, const Node& root_node, const Content& old, const Content& now,
           const std::shared_ptr<const std::string>& file)
    : source_(source), file_(file) {
    root.value = &root_node;
    add_entries(root, old);
    root.end = cursor_;
    index(root);
    claim(now);
}

std::size_t Base::line_end(std::size_t position) const {
    return std::min(text().find('\n', position), text().size() - 1) + 1;
}

void Base::add_entries(Entry& parent, const Content& old) {
    const Node& collection = *parent.value;
    const std::size_t step = collection.is_map() ? 2 : 1;
    for (std::size_t i = 0; i + step <= collection.items.size(); i += step) {
        Entry& entry = parent.entries.emplace_back();
        if (collection.is_map()) entry.key = &collection.items[i];
        entry.value = &collection.items[i + step - 1];
        const Node& head = entry.key ? *entry.key : *entry.value;
        entry.old = find_old(old, head, collection.is_map());
        entry.in_brackets = collection.flow;
        entry.begin = entry.head = head.position;
        entry.head_end = head.end;
        entry.end = std::max(entry.value->end, head.end);
        if (!collection.flow) add_lines(entry);
        const bool has_items = entry.old && (entry.old->content.kind == Content::Kind::map ||
                                             entry.old->content.kind == Content::Kind::list);
        const bool is_collection = entry.value->is_map() || entry.value->is_sequence();
        const bool is_below = entry.value->flow || (is_collection && !entry.value->items.empty() &&
                                                    entry.value->items[0].position >= cursor_);
        if (has_items && is_collection && is_below) add_entries(entry, entry.old->content);
        if (collection.flow) continue;
        if (is_collection && !entry.value->flow) cursor_ = std::max(cursor_, line_end(entry.value->end - 1));
        entry.end = cursor_;
    }
}

void Base::add_lines(Entry& entry) {
    entry.head = entry.key ? entry.key->position : text().rfind('-', entry.value->position);
    entry.begin = cursor_;
    entry.indent = static_cast<int>(entry.head - source_.line_starts[source_.line_of(entry.head) - 1]);
    entry.head_end = (entry.key ? text().find(':', entry.key->end) : entry.head) + 1;
    const Node& value = *entry.value;
    const bool has_lines = (value.is_map() || value.is_sequence()) && !value.flow;
    const bool is_empty = value.is_null() || (value.quotes == model::Quotes::literal && value.text.empty());
    const std::size_t end = has_lines || is_empty ? entry.head_end : value.end;
    cursor_ = line_end(std::max(end, entry.head_end) - 1);
}

void Base::index(Entry& parent) {
    for (Entry& entry : parent.entries) {
        const Node& head = entry.key ? *entry.key : *entry.value;
        by_place_.emplace(Place(head.line, head.column), &entry);
        index(entry);
    }
}

const model::Location* Base::place(const Item& item) const {
    return item.where && *item.where && item.where->file == file_ ? item.where : nullptr;
}

void Base::claim(const Content& content) {
    for (const Item& item : content.items) {
        if (const auto* where = place(item)) claimed_.emplace(where->line, where->column);
        claim(item.content);
    }
}

Entry* Base::find(const Item& item, Entry* parent) {
    Entry* found = nullptr;
    if (const auto* where = place(item))
        if (const auto known = by_place_.find({where->line, where->column}); known != by_place_.end())
            found = known->second;
    if (!found && parent)
        for (Entry& entry : parent->entries) {
            const Node& head = entry.key ? *entry.key : *entry.value;
            const std::string& name = item.key.empty() ? item.content.text : item.key;
            if (!entry.is_used && !claimed_.contains({head.line, head.column}) &&
                key_text(head.text) == name) {
                found = &entry;
                break;
            }
        }
    if (!found || found->is_used) return nullptr;
    found->is_used = true;
    return found;
}

} // namespace bf::formats
