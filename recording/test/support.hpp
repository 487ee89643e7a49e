#pragma once

#include "bf/recording/reader.hpp"
#include "bf/recording/writer.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>
#include <vector>

namespace bf::recording {

/// A folder that lives as long as a test.
class Folder {
  public:
    Folder() {
        std::string name = testing::TempDir() + "bf_recording_XXXXXX";
        path_ = ::mkdtemp(name.data());
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    std::filesystem::path operator/(const char* name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline std::string error_of(const auto& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "no error";
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << text

/// Bytes of a pseudo-random sequence. As doubles they are NaNs, infinities and denormals too.
inline std::vector<std::byte> noise(std::size_t count, std::uint64_t seed, ElementType type) {
    std::vector<std::byte> bytes(count);
    std::uint64_t state = seed * 0x9E3779B97F4A7C15u + 1;
    for (std::byte& byte : bytes) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        byte = static_cast<std::byte>(type == ElementType::Boolean ? state >> 63 : state >> 56);
    }
    return bytes;
}

} // namespace bf::recording
