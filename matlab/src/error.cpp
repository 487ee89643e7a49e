#include "bf/matlab/error.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

std::string shortened(std::string_view text) {
    constexpr std::size_t longest = 60;
    std::string line(text.substr(0, text.find('\n')));
    if (line.size() == text.size() && line.size() <= longest) return line;
    return line.substr(0, longest) + " ...";
}

std::string full_text(const std::string& message, const Location& at, const std::string& text) {
    std::string place = at.file.empty() ? "" : at.file + ":";
    place += std::to_string(at.line) + ":" + std::to_string(at.column) + ": " + message;
    return text.empty() ? place : place + ", in '" + text + "'";
}

} // namespace

std::string_view Span::text() const {
    return source ? std::string_view(source->text).substr(begin, end - begin) : std::string_view();
}

Location Span::location() const {
    if (!source) return {};
    Location at = source->start;
    for (std::size_t i = 0; i < std::min(begin, source->text.size()); ++i) {
        if (source->text[i] == '\n') {
            ++at.line;
            at.column = 1;
        } else {
            ++at.column;
        }
    }
    return at;
}

Error::Error(const std::string& message) : std::runtime_error(message), message_(message) {}

Error::Error(const std::string& message, const Span& span)
    : Error(message, span.location(), shortened(span.text())) {}

Error::Error(const std::string& message, const Location& location, const std::string& text)
    : std::runtime_error(full_text(message, location, text)), message_(message), location_(location),
      text_(text), located_(true) {}

} // namespace bf::matlab
