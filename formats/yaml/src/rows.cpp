#include "rows.hpp"

#include "flow.hpp"

#include "bf/formats/yaml.hpp"
#include "bf/model/location.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

using Texts = std::vector<std::string_view>;

bool is_blank(std::string_view text) { return text.find_first_not_of(" \t\n") == text.npos; }

/// The entries of a row; brackets hold their blanks and commas together.
Texts entries_of(std::string_view row) {
    Texts entries;
    int depth = 0;
    std::size_t begin = 0;
    for (std::size_t at = 0; at <= row.size(); ++at) {
        const char c = at < row.size() ? row[at] : ',';
        depth += (c == '(' || c == '[' || c == '{') - (c == ')' || c == ']' || c == '}');
        if (depth > 0 || (c != ',' && c != ' ')) continue;
        if (at > begin) entries.push_back(row.substr(begin, at - begin));
        begin = at + 1;
    }
    return entries;
}

/// What it costs that a row comes or goes, and that it becomes another one: of rows that changed by more than
/// two thirds of their entries that is dearer, unless nothing else is to be had in their place.
std::size_t cost_of(const Texts& row) { return 2 * row.size(); }
std::size_t cost_of(const Texts& before, const Texts& after) {
    const std::size_t most = cost_of(before) + cost_of(after) - 1;
    if (before.size() != after.size()) return most;
    std::size_t changed = 0;
    for (std::size_t i = 0; i < before.size(); ++i) changed += before[i] != after[i];
    return std::min(6 * changed, most);
}

/// Which row each of `after` was before, in the cheapest way.
std::vector<std::optional<std::size_t>> origins(const std::vector<Texts>& before,
                                                const std::vector<Texts>& after) {
    const std::size_t n = before.size(), m = after.size();
    std::vector<std::vector<std::size_t>> cost(n + 1, std::vector<std::size_t>(m + 1));
    const auto changed = [&](std::size_t i, std::size_t j) {
        return cost[i + 1][j + 1] + cost_of(before[i], after[j]);
    };
    const auto gone = [&](std::size_t i, std::size_t j) { return cost[i + 1][j] + cost_of(before[i]); };
    const auto come = [&](std::size_t i, std::size_t j) { return cost[i][j + 1] + cost_of(after[j]); };
    for (std::size_t i = n + 1; i-- > 0;)
        for (std::size_t j = m + 1; j-- > 0;) {
            if (i == n && j == m) continue;
            cost[i][j] = i == n   ? come(i, j)
                         : j == m ? gone(i, j)
                                  : std::min({changed(i, j), gone(i, j), come(i, j)});
        }
    std::vector<std::optional<std::size_t>> from(m);
    for (std::size_t i = 0, j = 0; j < m;)
        if (i < n && cost[i][j] == changed(i, j))
            from[j++] = i++;
        else if (i < n && cost[i][j] == gone(i, j))
            ++i;
        else
            ++j;
    return from;
}

/// The same by where they were read; nothing where that is not known of all of them, or their order changed.
std::optional<std::vector<std::optional<std::size_t>>> known_origins(
    const std::vector<model::Location>& before, const std::vector<model::Location>& after, std::size_t n,
    std::size_t m) {
    if (before.size() != n || after.size() != m) return {};
    std::vector<std::optional<std::size_t>> from(m);
    std::size_t next = 0;
    for (std::size_t k = 0; k < m; ++k) {
        if (!after[k]) continue;
        const auto is_it = [&](const model::Location& place) {
            return place.line == after[k].line && place.column == after[k].column;
        };
        const auto found =
            std::find_if(before.begin() + static_cast<std::ptrdiff_t>(next), before.end(), is_it);
        if (found == before.end()) return {};
        from[k] = static_cast<std::size_t>(found - before.begin());
        next = *from[k] + 1;
    }
    return from;
}

/// A row where it stands: what leads to it from the end of the line before, or from the row before on the
/// same line, and what follows it on its line.
struct Row {
    std::string lead, text, trail;
};

class Rows {
  public:
    Rows(std::string_view text, const Node& value, bool are_rows) : text_(text), is_flow_(value.flow) {
        for (const Node& item : value.items) extents_.emplace_back(item.position, item.end);
        separator_ = is_flow_ ? "," : "";
        is_nested_ = are_rows;
    }
    /// Of a matrix whose rows end with ';', which YAML does not know.
    Rows(std::string_view text, const Texts& rows) : text_(text), is_flow_(true), separator_(";") {
        for (const std::string_view row : rows) {
            const auto begin = static_cast<std::size_t>(row.data() - text.data());
            extents_.emplace_back(begin, begin + row.size());
        }
    }

    /// Cuts the text between `begin` and `end`, in which the value ends at `close`; false where that is not
    /// the text of so many rows.
    bool cut(std::size_t begin, std::size_t end, std::size_t close, std::size_t count) {
        if (extents_.size() != count || count == 0) return false;
        for (std::size_t i = 0; i < count; ++i) {
            const auto [from, to] = extents_[i];
            if (from < (i > 0 ? extents_[i - 1].second : begin) || to > end || to < from) return false;
            rows_.push_back({{}, std::string(text_.substr(from, to - from)), {}});
        }
        const std::string_view first = text_.substr(begin, extents_[0].first - begin);
        const std::size_t opened = is_flow_ ? first.find('[') + 1 : std::min(first.find('\n'), first.size());
        head_ = first.substr(0, opened);
        rows_[0].lead = first.substr(opened);
        for (std::size_t i = 1; i < count; ++i) {
            std::string_view gap =
                text_.substr(extents_[i - 1].second, extents_[i].first - extents_[i - 1].second);
            if (is_flow_) gap = without_separator(gap);
            const std::size_t line_end = std::min(gap.find('\n'), gap.size());
            const bool is_split = line_end < gap.size();
            rows_[i - 1].trail = is_split ? gap.substr(0, line_end) : "";
            rows_[i].lead = is_split ? gap.substr(line_end) : gap;
        }
        const std::size_t last = extents_.back().second;
        std::string_view rest = text_.substr(last, end - last);
        if (is_flow_) {
            if (close < last + 1 || close > end) return false;
            const std::string_view inner = rest.substr(0, close - 1 - last);
            const std::size_t line_end = inner.find('\n');
            close_ = inner.substr(0, line_end);
            if (line_end == inner.npos) {
                close_ += ']';
                rest.remove_prefix(close - last);
                if (separator_ == ";") { // behind which YAML allows no comment
                    tail_ = rest;
                    return true;
                }
            } else {
                const std::string_view trail = without_separator(inner.substr(0, line_end));
                close_.resize(line_end - trail.size());
                rest.remove_prefix(close_.size());
            }
        }
        const std::size_t line_end = std::min(rest.find('\n'), rest.size());
        rows_.back().trail = rest.substr(0, line_end);
        rest.remove_prefix(line_end);
        tail_ = rest;
        return true;
    }

    std::string written(const Texts& before, const Texts& after,
                        const std::optional<std::vector<std::optional<std::size_t>>>& known) const {
        std::vector<Texts> old_entries, new_entries;
        for (const auto row : before) old_entries.push_back(is_list() ? Texts{row} : entries_of(row));
        for (const auto row : after) new_entries.push_back(is_list() ? Texts{row} : entries_of(row));
        const auto from = known ? *known : origins(old_entries, new_entries);
        std::string result = head_;
        bool is_behind_comment = false;
        for (std::size_t k = 0; k < after.size(); ++k) {
            const Row* const old = from[k] ? &rows_[*from[k]] : nullptr;
            const std::string own = old ? old->lead : new_lead();
            const bool is_first = k == 0, is_last = k + 1 == after.size();
            std::string lead = own;
            if (is_first)
                lead = is_blank(rows_[0].lead) && is_blank(own) ? rows_[0].lead : own;
            else if (old == &rows_[0] && is_flow_ && is_blank(own))
                lead = new_lead();
            if (is_behind_comment && lead.find('\n') == lead.npos) lead = "\n" + std::string(column(), ' ');
            result += lead;
            result += old ? changed(*old, before[*from[k]], after[k], old_entries[*from[k]], new_entries[k])
                          : in_form(after[k]);
            const std::string trail = old ? old->trail : "";
            result += is_last ? close_ : separator_;
            result += trail;
            is_behind_comment = trail.find('#') != trail.npos;
        }
        return result + tail_;
    }

  private:
    bool is_list() const { return separator_ != ";" && !is_nested_; }

    std::string_view without_separator(std::string_view gap) const {
        const std::size_t at = gap.find(separator_);
        return at == gap.npos || !is_blank(gap.substr(0, at)) ? gap : gap.substr(at + 1);
    }

    /// Of the first row.
    std::size_t column() const {
        const std::size_t begin = extents_[0].first, line_end = text_.rfind('\n', begin);
        return begin - (line_end == text_.npos ? 0 : line_end + 1);
    }

    /// As that of the last row, without its comments.
    std::string new_lead() const {
        const std::string& lead = rows_.back().lead;
        if (const std::size_t line = lead.rfind('\n'); line != lead.npos) return lead.substr(line);
        return rows_.size() > 1 ? lead : " ";
    }

    std::string in_form(std::string_view row) const {
        return is_nested_ ? "[" + std::string(row) + "]" : std::string(row);
    }

    std::string changed(const Row& row, std::string_view before, std::string_view after,
                        const Texts& old_entries, const Texts& new_entries) const {
        if (before == after) return row.text;
        if (old_entries.size() != new_entries.size()) return in_form(after);
        std::string text = row.text;
        std::size_t at = 0;
        for (std::size_t i = 0; i < old_entries.size(); ++i) {
            at = text.find(old_entries[i], at);
            if (at == text.npos) return in_form(after);
            text.replace(at, old_entries[i].size(), new_entries[i]);
            at += new_entries[i].size();
        }
        return text;
    }

    const std::string_view text_;
    const bool is_flow_;
    bool is_nested_ = false; ///< is each row a sequence of its own?
    std::string separator_;
    std::vector<std::pair<std::size_t, std::size_t>> extents_;
    std::vector<Row> rows_;
    std::string head_, close_, tail_; ///< around the rows; `close_` follows the last one before its trail
};

/// What `lines` mean behind a key.
std::string read_again(const std::string& lines) {
    try {
        const auto variables = read_yaml_variables("x: " + lines, "");
        return variables.size() == 1 ? variables[0].value.text : "";
    } catch (const model::Errors&) {
        return "";
    }
}

} // namespace

std::optional<std::string> edited_rows(std::string_view text, std::size_t begin, std::size_t end,
                                       const Node& value, const model::Expression& old,
                                       const model::Expression& wanted) {
    const std::string before = old.matlab(), after = wanted.matlab();
    constexpr std::size_t most_pairs = 1000000; // each of which is compared
    if (!before.starts_with('[') || !after.starts_with('[')) return {};
    const bool are_rows = !value.items.empty() &&
                          std::ranges::all_of(value.items, [](const Node& n) { return n.is_sequence(); });
    const bool has_ends = !are_rows && value.flow && (before + after).find(';') != std::string::npos;
    const char separator = are_rows || has_ends ? ';' : ',';
    const Texts old_rows = flow_items(before, separator), new_rows = flow_items(after, separator);
    if (new_rows.empty() || old_rows.size() * new_rows.size() > most_pairs) return {};
    const std::string_view slice = text.substr(value.position, value.end - value.position);
    Rows rows = has_ends ? Rows(text, flow_items(slice, separator)) : Rows(text, value, are_rows);
    if (!rows.cut(begin, end, value.end, old_rows.size())) return {};
    std::string edited = rows.written(old_rows, new_rows,
                                      known_origins(old.rows, wanted.rows, old_rows.size(), new_rows.size()));
    return read_again(edited) == after ? std::optional(std::move(edited)) : std::nullopt;
}

} // namespace bf::formats
