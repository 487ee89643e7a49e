#include "output.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace bf::tools {

std::string to_text(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", x + 0.0); // no -0
    return text;
}

} // namespace bf::tools
