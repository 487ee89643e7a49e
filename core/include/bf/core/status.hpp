// The result of a step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace bf {

struct Resolution;

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

    /// The same about an element (from 0) of a quantity of the block: in the message `{element}` stands for
    /// its name, e.g. Status::failure("{element} is not finite", tau, i); -1: the whole quantity.
    template <std::size_t N, class Key>
    requires requires(const Key& key) { key.index(); }
    static constexpr Status failure(const char (&literal)[N], const Key& quantity, std::int32_t element) {
        return failure(literal, quantity.index(), element);
    }

    constexpr explicit operator bool() const { return message_ == nullptr; }
    /// The message with its integers filled in; "ok" when nothing failed. The block that failed knows how its
    /// elements are called: "tau[l_knee]", otherwise it is "element 4". Allocates: not for use in a step.
    std::string text(const Resolution* block = nullptr) const;

  private:
    const char* message_ = nullptr;
    std::int32_t first_ = 0, second_ = 0;
};

inline constexpr Status ok{};

} // namespace bf
