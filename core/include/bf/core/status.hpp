// The result of a step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace bf {

/// Result of a step. Never allocates: the message is a string literal, in which each `{}` stands for one of
/// two integers, e.g. Status::failure("H({}, {}) is not finite", row, column). Fits in two registers.
class [[nodiscard]] Status {
  public:
    constexpr Status() = default;

    template <std::size_t N>
    static constexpr Status failure(const char (&literal)[N], std::int32_t first = 0,
                                    std::int32_t second = 0) {
        Status status;
        status.message_ = literal;
        status.first_ = first;
        status.second_ = second;
        return status;
    }

    constexpr explicit operator bool() const { return message_ == nullptr; }
    /// The message with its integers filled in; "ok" when nothing failed. Allocates: not for use in a step.
    std::string text() const;

  private:
    const char* message_ = nullptr;
    std::int32_t first_ = 0, second_ = 0;
};

inline constexpr Status ok{};

} // namespace bf
