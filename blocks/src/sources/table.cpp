#include "table.hpp"

#include "bf/base/text_file.hpp"
#include "bf/base/value_text.hpp"

#include <sstream>
#include <stdexcept>
#include <string_view>

namespace bf::blocks {

namespace {

bool is_separator(char c) { return c == ',' || c == ';' || c == ' ' || c == '\t' || c == '\r'; }

/// The numbers of a line; false at the first word that is none, of which `wrong` then tells.
bool parse(std::string_view line, std::vector<double>& numbers, std::string& wrong) {
    numbers.clear();
    for (std::size_t i = 0; i < line.size();) {
        if (is_separator(line[i])) {
            ++i;
            continue;
        }
        std::size_t end = i;
        while (end < line.size() && !is_separator(line[end])) ++end;
        double number = 0;
        wrong = read_value(std::string(line.substr(i, end - i)), number);
        if (!wrong.empty()) return false;
        numbers.push_back(number);
        i = end;
    }
    return true;
}

} // namespace

Table read_table(const std::string& file) {
    std::string text;
    if (const std::string wrong = read_file(file, text); !wrong.empty())
        throw std::runtime_error("file '" + file + "' cannot be read: " + wrong);
    std::istringstream stream(std::move(text));
    Table table{{}, {}, 0};
    std::vector<double> numbers;
    std::string line, wrong;
    bool may_be_heading = true;
    for (int number = 1; std::getline(stream, line); ++number) {
        const auto where = [&] { return "file '" + file + "', line " + std::to_string(number) + ": "; };
        if (line.empty() || line[0] == '#') continue;
        const bool is_row = parse(line, numbers, wrong);
        if (!is_row && may_be_heading) {
            may_be_heading = false;
            continue;
        }
        may_be_heading = false;
        if (!is_row) throw std::runtime_error(where() + wrong);
        if (numbers.empty()) continue;
        const int width = static_cast<int>(numbers.size()) - 1;
        if (table.times.empty()) table.width = width;
        if (width < 1) throw std::runtime_error(where() + "a row needs a time and at least one value");
        if (width != table.width)
            throw std::runtime_error(where() + std::to_string(width + 1) +
                                     " columns, but the rows before have " + std::to_string(table.width + 1));
        if (!table.times.empty() && !(numbers[0] > table.times.back()))
            throw std::runtime_error(where() + "the time does not grow; rows must be in order of time");
        table.times.push_back(numbers[0]);
        table.values.insert(table.values.end(), numbers.begin() + 1, numbers.end());
    }
    if (table.times.empty()) throw std::runtime_error("file '" + file + "' has no row of numbers");
    return table;
}

} // namespace bf::blocks
