#include "rpc.hpp"

#include <algorithm>

namespace bf::service {

std::string error_text(const Json& id, Code code, const std::string& message) {
    return Json{
        {"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", static_cast<int>(code)}, {"message", message}}}}
        .dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string notification(const char* method, const Json& params) {
    return Json{{"jsonrpc", "2.0"}, {"method", method}, {"params", params}}.dump(
        -1, ' ', false, Json::error_handler_t::replace);
}

int depth_of(std::string_view text) {
    int depth = 0, deepest = 0;
    bool is_quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (is_quoted) {
            if (c == '\\') ++i;
            is_quoted = c != '"';
        } else if (c == '"') {
            is_quoted = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return deepest;
}

} // namespace bf::service
