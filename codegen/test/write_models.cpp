#include "write_models.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>

namespace bf::codegen::test {

namespace fs = std::filesystem;

namespace {

/// Files that do not change keep their time, so that nothing is compiled again for them.
void write_changed(const fs::path& file, const std::string& text) {
    std::ostringstream known;
    known << std::ifstream(file, std::ios::binary).rdbuf();
    if (known.str() == text) return;
    fs::create_directories(file.parent_path());
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

struct Part {
    std::size_t size = 0, hash = 0;
    std::string includes, calls;
};

Part& smallest(std::vector<Part>& parts) {
    return *std::min_element(parts.begin(), parts.end(),
                             [](const Part& a, const Part& b) { return a.size < b.size; });
}

/// The same model as a C program whose main has a name of its own.
void add_c(const Case& one, const fs::path& folder, std::vector<Part>& parts) {
    const auto& diagram = one.elaborated.diagram;
    const std::string name = file_name(diagram);
    if (!is_c_case(one)) return;
    Part& part = smallest(parts);
    for (const auto& [file, text] : c_files(one)) {
        write_changed(folder / "c" / name / file, text);
        part.hash = part.hash * 31 + std::hash<std::string>{}(text);
        part.size += text.size();
    }
    const std::string main = name + "_main", place = "\"c/" + name + "/";
    part.includes += "#include " + place + name + ".c\"\n#define main " + main + "\n#include " + place +
                     "main.c\"\n#undef main\n";
    part.calls += "    run(\"" + name + "\", " + std::to_string(one.steps) + ", " + main + ");\n";
}

} // namespace

void write_models(const std::vector<std::vector<Case> (*)()>& families, const fs::path& folder,
                  std::size_t count) {
    std::vector<Part> parts(count), hosted(1), in_c(2);
    for (auto* make : families)
        for (const auto& one : make()) {
            const auto& diagram = one.elaborated.diagram;
            const std::string name = file_name(diagram);
            const Files files = generate(diagram, one.options);
            auto& among = files.contains(name + "_hosted.cpp") ? hosted : parts;
            Part& part = smallest(among);
            add_c(one, folder, in_c);
            for (const auto& [file, text] : files) {
                write_changed(
                    folder / (file.starts_with("include/") ? fs::path(file) : fs::path(name) / file), text);
                part.hash = part.hash * 31 + std::hash<std::string>{}(text);
                // Each shared library has one table of what recorders ask.
                if (!file.ends_with(".cpp") || file == "main.cpp" || file.ends_with("_run.cpp")) continue;
                part.includes += "#include \"" + name + "/" + file + "\"\n";
                part.size += text.size() + 4000;
            }
            part.calls += "    run<" + class_name(diagram) + ">(\"" + name + "\", " +
                          std::to_string(one.steps) + ");\n";
        }
    const auto write = [&](const std::vector<Part>& all, const std::string& stem, const std::string& driver,
                           const std::string& suffix, const std::string& header) {
        std::string declarations, calls;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const std::string unit = stem + std::to_string(i), head = "void run_" + unit + "(void)";
            write_changed(folder / (unit + suffix), "// " + std::to_string(all[i].hash) + "\n" +
                                                        all[i].includes + "#include \"" + header + "\"\n\n" +
                                                        head + ";\n" + head + " {\n" + all[i].calls + "}\n");
            declarations += head + ";\n";
            calls += "    run_" + unit + "();\n";
        }
        write_changed(folder / (driver + suffix), declarations + "\nint main(void) {\n" + calls + "}\n");
    };
    write(parts, "part_", "driver", ".cpp", "case_driver.hpp");
    write(hosted, "hosted_", "hosted_driver", ".cpp", "case_driver.hpp");
    write(in_c, "c_part_", "c_driver", ".c", "case_driver.h");
}

} // namespace bf::codegen::test
