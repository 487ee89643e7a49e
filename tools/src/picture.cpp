#include "picture.hpp"

#include "bf/base/numbers.hpp"
#include "bf/view/draw.hpp"
#include "output.hpp"
#include "session.hpp"

#include <cmath>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char** environ;

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

constexpr int pixels = 2; ///< of a PNG, for one of the drawing

/// librsvg says what it cannot do with another picture, in words that do not help here.
void require_png(const editor::Rectangle& sheet) {
    constexpr double most = 32767;
    const double width = std::ceil(pixels * sheet.width), height = std::ceil(pixels * sheet.height);
    if (width <= most && height <= most) return;
    throw CommandError("the picture would be " + number_text(width) + " pixels wide and " +
                       number_text(height) + " high, and a PNG has at most " + number_text(most) +
                       "; move what stands far away closer, or give a name that ends in .svg or .pdf");
}

/// SVG as another format, by librsvg.
void convert(const fs::path& svg, const fs::path& output, const std::string& format) {
    std::vector<std::string> words = {"rsvg-convert", "-f", format, "-o", output, svg};
    if (format == "png") words.insert(words.end() - 1, {"-z", std::to_string(pixels)});
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int problem = ::posix_spawnp(&child, "rsvg-convert", &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (problem != 0)
        throw CommandError("rsvg-convert is missing, which makes PDF and PNG; apt install librsvg2-bin "
                           "fonts-liberation, or give a name that ends in .svg");
    if (::waitpid(child, &status, 0) != child || status != 0)
        throw CommandError("rsvg-convert cannot make a " + format +
                           " of the picture; give a name that ends in .svg");
}

} // namespace

void write_picture(const editor::Drawing& drawing, bool is_dark, const std::string& file) {
    save_picture(drawing, is_dark, file);
    if (file != "/dev/stdout") std::printf("%s\n", file.c_str());
}

void save_picture(const editor::Drawing& drawing, bool is_dark, const std::string& file) {
    const std::string format = fs::path(file).extension().string();
    if (format == ".png") require_png(editor::sheet_of(drawing));
    const std::string svg = editor::to_svg(drawing, is_dark);
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
}

} // namespace bf::tools
