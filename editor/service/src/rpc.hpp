// The texts of JSON-RPC 2.0.
#pragma once

#include "json.hpp"

#include <string>
#include <string_view>

namespace bf::service {

enum class Code { parse = -32700, request = -32600, method = -32601, params = -32602, refused = -32000 };

std::string error_text(const Json& id, Code code, const std::string& message);
std::string notification(const char* method, const Json& params);

/// How deeply brackets of a JSON text are nested; who reads it goes as deep.
int depth_of(std::string_view text);

} // namespace bf::service
