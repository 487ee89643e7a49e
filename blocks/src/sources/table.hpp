// Reading a table of numbers over time.
#pragma once

#include <string>
#include <vector>

namespace bf::blocks {

struct Table {
    std::vector<double> times{0};  ///< increasing [s]
    std::vector<double> values{0}; ///< row by row
    int width = 1;                 ///< values per row

    double value(std::size_t row, int column) const {
        return values[row * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
    }
};

/// Reads comma-, semicolon- or space-separated numbers, first column time. Lines that begin with '#' and one
/// line of headings are passed over. Throws std::runtime_error with file and line.
Table read_table(const std::string& file);

} // namespace bf::blocks
