#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace bf::matlab {

/// A place in a text file; lines and columns count from 1.
struct Location {
    std::string file; ///< empty when the text has no file
    int line = 1;
    int column = 1;
    bool operator==(const Location&) const = default;
};

/// A text and where its first character stands, shared by every node of its syntax tree.
struct Source {
    std::string text;
    Location start;
};

/// The bytes [begin, end) of a source.
struct Span {
    std::shared_ptr<const Source> source;
    std::size_t begin = 0;
    std::size_t end = 0;

    std::string_view text() const; ///< the bytes themselves
    Location location() const;     ///< where the first of them stands
};

/// The one exception of `bf::matlab`: wrong text, a wrong operation, or a limit exceeded.
/// `what()` reads `file:line:column: message, in 'text'`.
class Error : public std::runtime_error {
  public:
    /// An error that does not know its place; `resolve` adds it.
    explicit Error(const std::string& message);
    Error(const std::string& message, const Span& span);

    bool located() const { return located_; }
    const std::string& message() const { return message_; } ///< rule and remedy, without the place
    const Location& location() const { return location_; }
    const std::string& text() const { return text_; } ///< the offending source text, shortened

  private:
    Error(const std::string& message, const Location& location, const std::string& text);

    std::string message_;
    Location location_;
    std::string text_;
    bool located_ = false;
};

} // namespace bf::matlab
