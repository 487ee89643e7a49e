// Generated programs, compiled and run in a folder of their own.
#pragma once

#include "folder.hpp"

#include "bf/codegen/generate.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <string>
#include <sys/wait.h>

namespace bf::codegen::test {

/// A generated program in a folder of its own.
struct Program {
    explicit Program(const Diagram& diagram, const std::string& name = "program",
                     const std::string& more_source = "")
        : folder(name) {
        write(generate(diagram), folder.path);
        write_text(folder.path / "more.cpp", more_source);
        compiled = std::system((at + BF_CXX
                                " -std=c++17 -Wall -Wextra -Werror -ffp-contract=off -I. -Iinclude *.cpp "
                                "-o program")
                                   .c_str());
    }
    int operator()(const std::string& options) const {
        return std::system((at + "./program " + options + " > out.txt 2> errors.txt").c_str());
    }
    int code(const std::string& options) const { return WEXITSTATUS((*this)(options)); }
    std::string text(const std::string& file) const { return read_text(folder.path / file); }

    Folder folder;
    std::string at = "cd " + folder.path.string() + " && ";
    int compiled;
};

/// The running program is told what this text in Python says, and its assertions hold.
inline void expect_commands(const Program& program, const std::string& text) {
    write_text(program.folder.path / "client.py", "from commanded import Commanded\n" + text);
    const std::string run =
        program.at + "PYTHONPATH='" BF_SOURCE_DIRECTORY "/tests/generated' timeout 60 python3 client.py";
    EXPECT_EQ(std::system(run.c_str()), 0);
}

} // namespace bf::codegen::test
