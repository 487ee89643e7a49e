#pragma once

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

namespace bf::service {

/// An empty folder of its own for the running test.
inline std::filesystem::path test_folder() {
    const auto folder = std::filesystem::path(BF_BINARY_DIRECTORY) / "service_test" /
                        ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    return folder;
}

/// As editors do: beside the file, whose place it then takes.
inline void write_beside(const std::filesystem::path& file, const std::string& text) {
    const std::filesystem::path beside = file.string() + ".new";
    std::ofstream(beside) << text;
    std::filesystem::rename(beside, file);
}

} // namespace bf::service
