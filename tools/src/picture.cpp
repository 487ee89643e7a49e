#include "picture.hpp"

#include "output.hpp"
#include "session.hpp"

#include <cstdio>
#include <filesystem>
#include <spawn.h>
#include <sys/wait.h>
#include <vector>

extern char** environ;

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

/// SVG as another format, by librsvg.
void convert(const fs::path& svg, const fs::path& output, const std::string& format) {
    std::vector<std::string> words = {"rsvg-convert", "-f", format, "-o", output, svg};
    if (format == "png") words.insert(words.end() - 1, {"-z", "2"});
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    if (::posix_spawnp(&child, "rsvg-convert", nullptr, nullptr, arguments.data(), environ) != 0)
        throw CommandError(
            "rsvg-convert is missing, which makes PDF and PNG; apt install librsvg2-bin, or give a name "
            "that ends in .svg");
    if (::waitpid(child, &status, 0) != child || status != 0)
        throw CommandError("rsvg-convert failed; give a name that ends in .svg");
}

} // namespace

void write_picture(const std::string& svg, const std::string& file) {
    const std::string format = fs::path(file).extension().string();
    OutputFile output(file);
    if (format == ".svg" || file == "/dev/stdout") {
        output.write(svg);
    } else if (format == ".pdf" || format == ".png") {
        const fs::path beside = output.path().string() + ".svg";
        OutputFile picture(beside);
        picture.write(svg);
        picture.commit();
        try {
            convert(beside, output.path(), format.substr(1));
        } catch (...) {
            fs::remove(beside);
            throw;
        }
        fs::remove(beside);
    } else {
        throw CommandError("cannot tell the format of " + file +
                           ": give a name that ends in .svg, .pdf or .png");
    }
    output.commit();
    if (file != "/dev/stdout") std::printf("%s\n", file.c_str());
}

} // namespace bf::tools
