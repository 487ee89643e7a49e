#pragma once

#include "bf/model/model.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bf::formats {

/// A node of the YAML syntax tree, with its place in the text.
struct Node {
    enum class Kind { null, scalar, sequence, map };

    Kind kind = Kind::null;
    std::string text = {}; ///< of a scalar, unescaped
    model::Quotes quotes = model::Quotes::none;
    bool flow = false;            ///< written with brackets
    std::vector<Node> items = {}; ///< of a sequence; of a map: key, value, key, value, ...
    int line = 0;
    int column = 0;
    std::size_t position = 0; ///< of the first character in the text
    std::size_t end = 0;      ///< behind the last one; of what has no brackets, that of its last item

    /// Is it a map with that key?
    bool has(std::string_view key) const {
        for (std::size_t i = 0; is_map() && i < items.size(); i += 2)
            if (items[i].text == key) return true;
        return false;
    }
    bool is_map() const { return kind == Kind::map; }
    bool is_scalar() const { return kind == Kind::scalar; }
    bool is_sequence() const { return kind == Kind::sequence; }
    bool is_null() const { return kind == Kind::null; }
    bool quoted() const { return quotes != model::Quotes::none; }
};

/// Text made of lines that end in '\n', as the parser gets it.
struct Source {
    std::string text;
    std::vector<std::size_t> line_starts;
    std::shared_ptr<const std::string> file;

    Source(std::string_view raw, const std::string& name);

    std::string_view line(int number) const; ///< from 1, without its '\n'
    int line_count() const { return static_cast<int>(line_starts.size()); }
    int line_of(std::size_t position) const;
    model::Location at(int line, int column) const { return {file, line, column}; }
    model::Location at(std::size_t position) const;
};

/// Parses; throws model::Errors on text that is not UTF-8 or not YAML, or that uses what a model file does
/// not have (anchors, aliases, tags, several documents). `quoted` receives the extents of quoted and literal
/// scalars.
Node parse(const Source& source, std::vector<std::pair<std::size_t, std::size_t>>& quoted);

} // namespace bf::formats
