// Lists of texts, as settings write them: [idle, move, 'lift (left)'].
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace bf::model {

/// An item of a list, and where it stands in it.
struct ListedText {
    std::size_t begin = 0, end = 0;
    std::string text; ///< without the quotes around it

    bool operator==(const ListedText&) const = default;
};

/// What stands between the commas, with or without brackets around all. An item in single or double quotes
/// may hold commas, and its own quotes twice; a quote inside of a word is an apostrophe.
std::vector<ListedText> listed_texts(std::string_view list);

/// The text as an item: in single quotes where it would be read as another one without them.
std::string listed(const std::string& text);

} // namespace bf::model
