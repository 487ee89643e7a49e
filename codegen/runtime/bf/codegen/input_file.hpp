// Values of a model's inputs from a file, for `bf run --inputs` and generated programs alike.
#pragma once

#include "bf/base/text_file.hpp"
#include "bf/base/value_text.hpp"
#include "bf/codegen/csv_file.hpp"

#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace bf::generated {

/// A CSV file: a row of headings, then rows of numbers in the order of time. The first column is the time in
/// s, the others are inputs or elements of inputs under the names that recordings give them, `u`, `x[1]`,
/// `M[1][2]` or `s[l_knee]`; a unit in parentheses may follow. A row holds from its time on until the next
/// one does, of several with one time the last. Before the first row, and where there is no column, an input
/// keeps its initial value.
class InputFile {
  public:
    /// For these inputs, whose rows must outlive the object. Empty, or what is wrong: "FILE:LINE: ...".
    std::string read(const std::string& file, Quantities inputs) {
        const NumberLocale locale;
        std::string text, line;
        if (const std::string wrong = read_file(file, text); !wrong.empty())
            return "cannot read the inputs in " + file + ": " + wrong;
        std::istringstream stream(without_mark(text));
        if (!std::getline(stream, line)) return "there are no inputs in " + file;
        int number = 1;
        const auto problem = [&](const std::string& what) {
            return file + ":" + std::to_string(number) + ": " + what;
        };
        const char* const open_quote = "a quote does not end on its line";
        std::vector<std::string> headings, row;
        if (!fields(line, headings)) return problem(open_quote);
        if (const std::string wrong = find_columns(headings, inputs); !wrong.empty()) return problem(wrong);
        while (std::getline(stream, line)) {
            ++number;
            if (!fields(line, row)) return problem(open_quote);
            if (row.size() == 1 && row[0].empty()) continue;
            if (row.size() != headings.size())
                return problem(std::to_string(row.size()) + " values, but there are " +
                               std::to_string(headings.size()) + " headings");
            for (std::size_t c = 0; c < row.size(); ++c) {
                double value = 0;
                if (const std::string wrong = read_value(row[c], value); !wrong.empty())
                    return problem(wrong);
                if (c == 0 && !(std::isfinite(value) && (times_.empty() || value >= times_.back())))
                    return problem("the time " + row[c] + " does not follow the one before");
                Problem wrong;
                if (c > 0 && check_limits(
                                 *columns_[c - 1].input, 1, [&](int) { return value; }, wrong))
                    return problem(wrong.text);
                if (c == 0)
                    times_.push_back(value);
                else
                    values_.push_back(value);
            }
        }
        return times_.empty() ? problem("there is no row of values") : "";
    }

    /// Writes the row that holds from `time` on, unless it was written before, into data(input). Times that
    /// differ by less than a millionth of the period are one.
    template <class Data> void go_to(double time, double period, Data&& data) noexcept {
        const std::size_t before = next_;
        while (next_ < times_.size() && times_[next_] <= time + 1e-6 * period) ++next_;
        if (next_ == before) return;
        const double* value = &values_[(next_ - 1) * columns_.size()];
        for (const Column& column : columns_)
            write(data(*column.input), column.input->type, column.element, *value++);
    }

  private:
    struct Column {
        const Quantity* input;
        int element;
    };

    /// The fields of a row; quotes as in RFC 4180, but a line ends them: false then.
    static bool fields(const std::string& line, std::vector<std::string>& all) {
        all.assign(1, "");
        bool is_quoted = false;
        for (std::size_t i = 0; i < line.size(); ++i) {
            const char c = line[i];
            if (is_quoted ? c == '"' && i + 1 < line.size() && line[i + 1] == '"' : false)
                all.back() += line[++i];
            else if (c == '"')
                is_quoted = !is_quoted;
            else if (c == ',' && !is_quoted)
                all.emplace_back();
            else if (is_quoted || (c != ' ' && c != '\t' && c != '\r') || (c == ' ' && !all.back().empty()))
                all.back() += c;
        }
        for (std::string& field : all) field.erase(field.find_last_not_of(' ') + 1);
        return !is_quoted;
    }

    std::string find_columns(const std::vector<std::string>& headings, Quantities inputs) {
        std::map<std::string, Column> known;
        std::string names;
        for (const Quantity& q : inputs) {
            names += (names.empty() ? "" : ", ") + std::string(q.name);
            const auto called = names_of_elements(q);
            for (int i = 0; i < q.size(); ++i) {
                known[q.name + element_text(q.rows, q.cols, i)] = {&q, i};
                known[q.name + element_text(q.rows, q.cols, i, called)] = {&q, i};
            }
        }
        if (headings[0] != "time" && headings[0] != "time (s)")
            return "the first column is the time and is called 'time', not '" + headings[0] + "'";
        std::set<std::pair<const Quantity*, int>> seen;
        for (std::size_t c = 1; c < headings.size(); ++c) {
            auto found = known.find(headings[c]);
            const auto unit = headings[c].rfind(" (");
            if (found == known.end() && unit != std::string::npos && headings[c].back() == ')')
                found = known.find(headings[c].substr(0, unit));
            if (found == known.end())
                return "the model has no input '" + headings[c] + "'; " +
                       (names.empty()
                            ? "it has none"
                            : "it has " + names + ", with elements as x[1], M[1][2], counted from 1");
            if (!seen.insert({found->second.input, found->second.element}).second)
                return "a second column '" + headings[c] + "'";
            columns_.push_back(found->second);
        }
        return columns_.empty() ? "there is no column besides the time" : "";
    }

    std::vector<Column> columns_;
    std::vector<double> times_, values_; ///< s; a row of columns per time
    std::size_t next_ = 0;               ///< row that holds next
};

} // namespace bf::generated
