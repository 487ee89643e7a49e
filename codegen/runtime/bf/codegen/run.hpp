// Runs a generated model as a program.
#pragma once

#include "bf/codegen/parameter_file.hpp"

#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

namespace bf::generated {

/// A CSV file of the recorded signals, one row per step; numbers read back exactly.
class CsvFile {
  public:
    CsvFile() = default;
    CsvFile(const CsvFile&) = delete;
    CsvFile& operator=(const CsvFile&) = delete;
    ~CsvFile() { close(); }

    bool open(const std::string& file, Quantities columns) {
        file_ = std::fopen(file.c_str(), "w");
        if (!file_) return false;
        std::fputs("time", file_);
        for (const Quantity& q : columns)
            for (int i = 0; i < q.size(); ++i) {
                std::string name = q.name;
                if (q.size() > 1) name += "(" + std::to_string(i + 1) + ")";
                std::string quoted;
                for (const char c : name) quoted += c == '"' ? "\"\"" : c == '\n' ? " " : std::string(1, c);
                std::fprintf(file_, ",\"%s\"", quoted.c_str());
            }
        std::fputc('\n', file_);
        return true;
    }
    template <class Model> void row(const Model& model) {
        std::fprintf(file_, "%.17g", model.time());
        for (const Quantity& q : Model::recorded_table())
            for (int i = 0; i < q.size(); ++i) std::fprintf(file_, ",%.17g", read(model.data(q), q.type, i));
        std::fputc('\n', file_);
    }
    bool is_open() const { return file_ != nullptr; }
    /// False when something could not be written.
    bool close() {
        if (!file_) return true;
        const bool good = std::ferror(file_) == 0;
        const bool closed = std::fclose(file_) == 0;
        file_ = nullptr;
        return good && closed;
    }

  private:
    std::FILE* file_ = nullptr;
};

inline int usage(const char* program, int code) {
    std::fprintf(code == 0 ? stdout : stderr,
                 "usage: %s [--stop SECONDS] [--parameters FILE] [--csv FILE] [--list] [--time]\n"
                 "  --stop        duration [s]\n"
                 "  --parameters  read `name = values` lines before the first step\n"
                 "  --csv         write the recorded signals\n"
                 "  --list        print all parameters and end\n"
                 "  --time        print the time per step\n",
                 program);
    return code;
}

/// Steps the model until its stop time; returns the exit code of the program.
template <class Model> int run(int argc, char** argv) {
    const auto model = std::make_unique<Model>();
    double stop = Model::stop_time;
    std::string csv_name, parameters;
    bool shows_time = false;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const bool has_value = i + 1 < argc;
        if (option == "--help") return usage(argv[0], 0);
        if (option == "--list") {
            for (const Quantity& q : Model::parameter_table()) {
                std::printf("%s =", q.name);
                for (int e = 0; e < q.size(); ++e) std::printf(" %.17g", read(model->data(q), q.type, e));
                std::printf("  # %dx%d [%s] %s\n", q.rows, q.cols, q.unit, q.doc);
            }
            return 0;
        }
        if (option == "--time")
            shows_time = true;
        else if (option == "--csv" && has_value)
            csv_name = argv[++i];
        else if (option == "--parameters" && has_value)
            parameters = argv[++i];
        else if (option == "--stop" && has_value) {
            char* end = nullptr;
            stop = std::strtod(argv[++i], &end);
            if (*end != '\0' || !(stop >= 0)) return usage(argv[0], 2);
        } else
            return usage(argv[0], 2);
    }
    if (!std::isfinite(stop)) {
        std::fprintf(stderr, "the model names no stop time: give --stop SECONDS\n");
        return 2;
    }
    if (!parameters.empty())
        if (const std::string errors = load_parameters(*model, parameters); !errors.empty()) {
            std::fputs(errors.c_str(), stderr);
            return 1;
        }
    CsvFile csv;
    if (!csv_name.empty() && !csv.open(csv_name, Model::recorded_table())) {
        std::fprintf(stderr, "cannot write %s\n", csv_name.c_str());
        return 1;
    }
    const auto steps = static_cast<std::int64_t>(std::llround(stop / Model::period));
    bool good = model->initialize();
    const auto begin = std::chrono::steady_clock::now();
    for (std::int64_t k = 0; good && k < steps; ++k) {
        good = model->output();
        if (good && csv.is_open()) csv.row(*model);
        good = good && model->update();
    }
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    model->terminate();
    for (const Quantity& q : Model::check_table())
        std::printf("%s = %.17g\n", q.name, read(model->data(q), q.type, 0));
    if (shows_time && steps > 0) std::printf("%.3f ns per step\n", wall * 1e9 / static_cast<double>(steps));
    if (!good)
        std::fprintf(stderr, "stopped at t = %g s: %s: %s\n", model->time(), model->failed_block(),
                     model->failure());
    if (!csv.close()) {
        std::fprintf(stderr, "%s could not be written completely\n", csv_name.c_str());
        return 1;
    }
    return good ? 0 : 1;
}

} // namespace bf::generated
