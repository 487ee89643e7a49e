#include "figure.hpp"

#include "output.hpp"
#include "session.hpp"

#include <cstdio>

namespace bf::tools {

bool is_figure(const std::filesystem::path& file) {
    return file.extension() == ".png" || file.extension() == ".svg";
}

void require_figure(const char* option, const std::string& file) {
    if (!file.empty() && !is_figure(file))
        throw CommandError(std::string(option) + " " + file + ": the name of this file ends in .png or .svg");
}

void write_figure(const recording::Figure& figure, const std::filesystem::path& file, int width, int height) {
    OutputFile output(file.string());
    recording::save(figure, output.path(), width, height);
    output.commit();
    std::printf("%s\n", file.string().c_str());
}

} // namespace bf::tools
