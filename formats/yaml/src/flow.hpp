#pragma once

#include <string>
#include <string_view>
#include <vector>

/// MATLAB text that is at the same time a YAML flow sequence or map, such as [1, 2; x 3] or {'a', 'b'}.
namespace bf::formats {

/// Where the flow collection ends that begins at `begin` (behind its closing bracket); the text's end if it
/// is not closed.
std::size_t flow_end(std::string_view text, std::size_t begin);

/// The lines of a flow collection without comments, outer blanks and empty lines.
std::vector<std::string> flow_lines(std::string_view slice);

/// The first of `lines` that ends without a ',', ';' or open bracket while the next does not close one, so
/// that YAML and MATLAB would read the break differently; else `lines.size()`.
std::size_t ambiguous_break(const std::vector<std::string>& lines);

std::string join_flow_lines(const std::vector<std::string>& lines);

/// What stands between the commas of a flow collection, or between the ';' of a matrix.
std::vector<std::string_view> flow_items(std::string_view slice, char separator = ',');

/// MATLAB text of a sequence of sequences, which are the rows of a matrix: [[1, 2], [3, 4]] -> [1, 2; 3, 4].
/// Empty if `slice` is none, or has a ';' somewhere and so is MATLAB text as it stands.
std::string matrix_of_rows(std::string_view slice);

/// Whether `text` may stand unquoted in YAML as a flow collection and is read back as the same expression.
bool is_flow_text(std::string_view text);

} // namespace bf::formats
