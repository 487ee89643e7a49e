#include "bf/core/status.hpp"

#include "bf/base/elements.hpp"
#include "bf/core/resolution.hpp"

namespace bf {

std::string Status::text(const Resolution* block) const {
    if (!message_) return "ok";
    std::string text = message_;
    constexpr std::string_view element = "{element}";
    if (const auto hole = text.find(element); hole != std::string::npos)
        text.replace(hole, element.size(),
                     !block        ? "element " + std::to_string(second_ + 1)
                     : second_ < 0 ? block->slots[static_cast<std::size_t>(first_)].name
                                   : block->element_name(first_, second_));
    for (const std::int32_t value : {first_, second_})
        if (const auto hole = text.find("{}"); hole != std::string::npos)
            text.replace(hole, 2, std::to_string(value));
    return text;
}

} // namespace bf
