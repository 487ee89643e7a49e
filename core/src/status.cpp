#include "bf/core/status.hpp"

namespace bf {

std::string Status::text() const {
    if (!message_) return "ok";
    std::string text = message_;
    for (const std::int32_t value : {first_, second_})
        if (const auto hole = text.find("{}"); hole != std::string::npos)
            text.replace(hole, 2, std::to_string(value));
    return text;
}

} // namespace bf
