// The FMUs that were written by hand for tests.
#pragma once

#include "bf/base/files.hpp"
#include "bf/fmi/archive.hpp"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>
#include <utility>

namespace bf::fmi::test {

/// tests/fmi/NAME.c and .xml as odd.fmu in that folder; `options` of the compiler, and a part of the
/// description with what it is replaced by.
inline std::filesystem::path odd_fmu(const std::string& name, const std::filesystem::path& folder,
                                     const std::string& options = {},
                                     const std::pair<std::string, std::string>& change = {}) {
    const std::string source = BF_SOURCE_DIRECTORY "/tests/fmi/" + name,
                      library = (folder / "odd.so").string();
    EXPECT_EQ(std::system(("cc -w -shared -fPIC -I" BF_SOURCE_DIRECTORY "/fmi/include " + options + " " +
                           source + ".c -o " + library)
                              .c_str()),
              0);
    std::string description = read_text_file(source + ".xml");
    if (const auto at = description.find(change.first); at != std::string::npos)
        description.replace(at, change.first.size(), change.second);
    write_archive(
        {{"modelDescription.xml", description}, {"binaries/x86_64-linux/odd.so", read_text_file(library)}},
        folder / "odd.fmu");
    return folder / "odd.fmu";
}

} // namespace bf::fmi::test
