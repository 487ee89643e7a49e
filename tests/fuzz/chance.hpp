// Random numbers, the same on every machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>

namespace bf::fuzz {

/// splitmix64 (Steele, Lea, Flood, 2014).
class Chance {
  public:
    explicit Chance(std::uint64_t seed) : state_(seed) {}
    std::uint64_t operator()() {
        std::uint64_t x = state_ += 0x9e3779b97f4a7c15;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
        x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
        return x ^ (x >> 31);
    }
    /// 0 ... count - 1
    std::size_t below(std::size_t count) { return static_cast<std::size_t>((*this)() % count); }
    bool one_in(std::size_t n) { return below(n) == 0; }
    template <class List> const auto& of(const List& list) { return list[below(std::size(list))]; }

  private:
    std::uint64_t state_;
};

} // namespace bf::fuzz
