// Robot descriptions whose numbers are none or describe no robot.
#pragma once

#include <string>

namespace bf {

/// Throws std::runtime_error for the first number of a link or joint that is none or is impossible (a
/// negative mass, an axis of length 0, a lower limit that is above the upper one or, but for 0, equal to it),
/// and for a joint whose links or whose leader can be none: it names the file, the line, the link or joint,
/// the attribute and the remedy; and for more than a thousand links. A text that is no XML or holds no
/// <robot> is left to whoever reads it.
void check_urdf(const std::string& xml, const std::string& file);

} // namespace bf
