// Messages of JSON-RPC.
#pragma once

#include "json.hpp"

#include <algorithm>
#include <string>
#include <string_view>

namespace bf::service {

/// A code of JSON-RPC 2.0.
enum class Code { parse = -32700, request = -32600, method = -32601, params = -32602, refused = -32000 };

inline std::string error_text(const Json& id, Code code, const std::string& message) {
    return Json{
        {"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", static_cast<int>(code)}, {"message", message}}}}
        .dump(-1, ' ', false, Json::error_handler_t::replace);
}

inline std::string notification(const char* method, const Json& params) {
    return Json{{"jsonrpc", "2.0"}, {"method", method}, {"params", params}}.dump(
        -1, ' ', false, Json::error_handler_t::replace);
}

/// How deeply brackets of a JSON text are nested; who reads it goes as deep.
inline int depth_of(std::string_view text) {
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
