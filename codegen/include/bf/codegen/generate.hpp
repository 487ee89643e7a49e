// Diagram → C++ project.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bf::codegen {

/// A diagram that cannot be generated. The text says which blocks, why, and the remedy.
struct GenerationError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

enum class Language { cpp, c };

struct Options {
    /// C: plain C11 without templates, for diagrams of rules that are arithmetic on numbers and short
    /// vectors. Sizes at run time are not for it.
    Language language = Language::cpp;
    /// Statements per function and per file. Compile time grows faster than the length of a function, so that
    /// large models are split.
    int statements_per_function = 200;
    int statements_per_file = 2000;
    /// For microcontrollers: a library without heap, exceptions and streams instead of a program. In C only
    /// the program is left out.
    bool embedded = false;
    /// Embedded or C: float instead of double. The results then differ from the simulation's.
    bool single = false;
    /// Besides step() one function for each rate, for schedulers that let a shorter period interrupt a longer
    /// one.
    bool has_function_per_rate = false;
    /// Sizes are found when the program starts: it elaborates the model then, with the values of its
    /// parameter file, and runs the generated steps on memory of these sizes. Needs `texts`.
    bool has_runtime_sizes = false;
    /// The model's files by their path in the model's folder, and what was changed in them.
    std::map<std::string, std::string> texts = {};
    std::string model_file = {};
    std::vector<std::pair<std::string, std::string>> overrides = {};
    /// Folder of the model: relative file names in arguments of blocks are meant from there.
    std::string folder = ".";
    /// Of the names of class and files, so that several models of one name are in one program.
    std::string suffix = {};
};

/// Texts by file name relative to the project's folder.
using Files = std::map<std::string, std::string>;

/// Lines of a file that a block became; from 1.
struct BlockPlace {
    std::size_t node; ///< its number in the diagram
    std::string file;
    int first = 0, last = 0;
};

/// The project: one class with initialize(), step() and terminate(), its main program, the used kernels and a
/// CMakeLists.txt. It computes what bf::Simulation computes, bit for bit. A diagram of blocks that are rules
/// needs a C++17 compiler only. `places`, if given, gets the lines of all blocks, in the diagram's order.
/// Throws GenerationError naming every block that cannot be generated, with the reason.
Files generate(const Diagram& diagram, const Options& options = {},
               std::vector<BlockPlace>* places = nullptr);

/// Bytes of the structures of the generated class, without the functions and tables in its program memory.
struct MemoryReport {
    std::size_t inputs = 0, outputs = 0, parameters = 0, signals = 0;
    std::size_t states = 0; ///< with the next ones, and what the solver needs
    std::size_t workspace = 0;
};
MemoryReport memory_report(const Diagram& diagram, const Options& options = {});

/// The blocks that the program makes through the factory, "path (type)".
std::vector<std::string> hosted_blocks(const Diagram& diagram);
/// Does the program make some blocks through the factory, because they are more than rules that can be
/// printed? It then needs the installed BlockFactory and their plugins.
bool has_hosted_blocks(const Diagram& diagram);

/// Name of the generated class: UpperCamel of the diagram's name; and of its files: snake_case.
std::string class_name(const Diagram& diagram);
std::string file_name(const Diagram& diagram);

/// Writes all files into the folder, which must not exist or be empty. Throws FileError when it holds
/// something or cannot be written; it then holds nothing new.
void write(const Files& files, const std::filesystem::path& folder);

} // namespace bf::codegen
