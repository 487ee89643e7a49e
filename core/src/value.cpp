#include "bf/core/value.hpp"

#include <sstream>

namespace bf {

std::string Value::describe() const {
    if (kind == Kind::text) return "the text '" + text + "'";
    if (kind == Kind::texts) return "a list of " + std::to_string(texts.size()) + " texts";
    if (data.size() != 1) return "a " + std::to_string(rows) + "x" + std::to_string(cols) + " matrix";
    if (type == Type::boolean) return data[0] != 0 ? "true" : "false";
    std::ostringstream number;
    number << data[0];
    return number.str();
}

} // namespace bf
