#include "table.hpp"

#include "bf/base/numbers.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace bf::blocks {

namespace {

bool is_separator(char c) { return c == ',' || c == ';' || c == ' ' || c == '\t' || c == '\r'; }

/// The numbers of a line; false at the first word that is none, which `word` then holds.
bool parse(std::string_view line, std::vector<double>& numbers, std::string& word) {
    numbers.clear();
    for (std::size_t i = 0; i < line.size();) {
        if (is_separator(line[i])) {
            ++i;
            continue;
        }
        std::size_t end = i;
        while (end < line.size() && !is_separator(line[end])) ++end;
        double number = 0;
        const char *const first = line.data() + i, *const last = line.data() + end;
        const auto [stop, error] = read_number(*first == '+' ? first + 1 : first, last, number);
        if (error != std::errc{} || stop != last) {
            word.assign(first, last);
            return false;
        }
        numbers.push_back(number);
        i = end;
    }
    return true;
}

} // namespace

Table read_table(const std::string& file) {
    std::error_code error;
    if (std::filesystem::exists(file, error) && !std::filesystem::is_regular_file(file, error))
        throw std::runtime_error("file '" + file + "' is no regular file, which has an end");
    std::ifstream stream(file);
    if (!stream) throw std::runtime_error("file '" + file + "' cannot be read; check its name and rights");
    Table table{{}, {}, 0};
    std::vector<double> numbers;
    std::string line, word;
    bool may_be_heading = true;
    for (int number = 1; std::getline(stream, line); ++number) {
        const auto where = [&] { return "file '" + file + "', line " + std::to_string(number) + ": "; };
        if (line.empty() || line[0] == '#') continue;
        const bool is_row = parse(line, numbers, word);
        if (!is_row && may_be_heading) {
            may_be_heading = false;
            continue;
        }
        may_be_heading = false;
        if (!is_row) throw std::runtime_error(where() + "'" + word + "' is not a number");
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
