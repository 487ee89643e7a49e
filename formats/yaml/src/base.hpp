#pragma once

#include "content.hpp"
#include "node.hpp"

#include <map>
#include <set>

namespace bf::formats {

/// An entry of a mapping or sequence in the text that a model was read from. Without brackets it has whole
/// lines, those of the comments above it being the first; in brackets it has `key: value`.
struct Entry {
    const Node* key = nullptr; ///< null in a sequence
    const Node* value = nullptr;
    const Item* old = nullptr; ///< what the writer would make of it; null if that is nothing
    std::size_t begin = 0, end = 0;
    std::size_t head = 0;     ///< where its key or its '-' begins
    std::size_t head_end = 0; ///< behind the key and, without brackets, the ':' or '-'
    int indent = 0;           ///< without brackets
    bool in_brackets = false;
    std::vector<Entry> entries = {}; ///< of the value, where it is a mapping or sequence of items
    bool is_used = false;            ///< written already

    /// Whether its value has items on lines of their own.
    bool has_lines() const { return !entries.empty() && !value->flow; }
};

/// The text that a model was read from, by its entries.
class Base {
  public:
    /// `old` is the content that was read from `root`, `now` what is to be written.
    Base(const Source& source, const Node& root, const Content& old, const Content& now,
         const std::shared_ptr<const std::string>& file);

    Entry root;

    std::string_view text() const { return source_.text; }
    std::string_view text(std::size_t begin, std::size_t end) const {
        return text().substr(begin, end - begin);
    }

    /// The entry that has become `item`: the one at its place, else one of that key in `parent`. Each is
    /// found once.
    Entry* find(const Item& item, Entry* parent);

  private:
    using Place = std::pair<int, int>;

    void add_entries(Entry& parent, const Content& old);
    void add_lines(Entry& entry);
    void index(Entry& parent);
    void claim(const Content& content);
    const model::Location* place(const Item& item) const;
    std::size_t line_end(std::size_t position) const;

    const Source& source_;
    std::shared_ptr<const std::string> file_;
    std::size_t cursor_ = 0;
    std::map<Place, Entry*> by_place_;
    std::set<Place> claimed_;
};

/// Whether both are written alike; comments do not count.
bool is_same(const Item& a, const Item& b);
bool is_same(const Content& a, const Content& b);

} // namespace bf::formats
