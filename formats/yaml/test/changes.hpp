#pragma once

#include "../src/printer.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/operation.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <sstream>

namespace bf::formats {

using Lines = std::vector<std::string>;

inline Lines lines_of(const std::string& text) {
    Lines lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

/// "- line" and "+ line" of what differs between the texts (a longest common subsequence stays).
inline Lines difference_of(const std::string& before, const std::string& after) {
    const Lines a = lines_of(before), b = lines_of(after);
    std::vector<std::vector<int>> common(a.size() + 1, std::vector<int>(b.size() + 1));
    for (std::size_t i = a.size(); i-- > 0;)
        for (std::size_t k = b.size(); k-- > 0;)
            common[i][k] =
                a[i] == b[k] ? common[i + 1][k + 1] + 1 : std::max(common[i + 1][k], common[i][k + 1]);
    Lines changed;
    for (std::size_t i = 0, k = 0; i < a.size() || k < b.size();)
        if (i < a.size() && k < b.size() && a[i] == b[k])
            ++i, ++k;
        else if (i < a.size() && (k == b.size() || common[i + 1][k] >= common[i][k + 1]))
            changed.push_back("- " + a[i++]);
        else
            changed.push_back("+ " + b[k++]);
    return changed;
}

/// What an operation changes in a text, which it has back when it is undone.
inline Lines changes(const model::Operation& operation, const std::string& text) {
    model::Model model = read_yaml_text(text);
    const model::operations::Patch back = edit(model, operation);
    const auto edited = edited_yaml(model);
    EXPECT_TRUE(edited) << "written anew";
    EXPECT_EQ(edited, write_yaml(model));
    edit(model, model::operation_from_json(model::to_json(back)));
    EXPECT_EQ(write_yaml(model), text) << "undone";
    return difference_of(text, edited.value_or(""));
}

} // namespace bf::formats
