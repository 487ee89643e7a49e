// Many generated models compiled together, run, and compared with the simulation bit for bit.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/model/builder.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

namespace bf::codegen::test {

namespace fs = std::filesystem;

/// A model, elaborated, with the registry that its blocks come from.
struct Elaborated {
    std::unique_ptr<Registry> registry = std::make_unique<Registry>();
    Diagram diagram;

    explicit Elaborated(const model::Model& model) {
        registry->add(standard_library());
        diagram = elaborate(model, *registry);
        // Everything that can be seen is recorded: outputs and states.
        diagram.record = diagram.signals();
        for (std::size_t n = 0; n < diagram.nodes.size(); ++n) {
            const auto& slots = diagram.nodes[n].block->declaration().slots;
            for (std::size_t s = 0; s < slots.size(); ++s)
                if (slots[s].role == Role::discrete_state)
                    diagram.record.push_back({diagram.nodes[n].path + "." + slots[s].name + " (state)",
                                              {static_cast<int>(n), static_cast<int>(s)}});
        }
    }
};

/// What a run shows: one row of numbers per step, and the failure that ended it.
struct Recording {
    std::vector<std::vector<double>> rows;
    std::string failure;
};

/// Values of the root inputs for each step, in order; square matrices are symmetric and positive definite.
inline std::vector<std::vector<double>> input_values(const Diagram& diagram, int steps) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<std::vector<double>> all;
    for (int k = 0; k < steps; ++k) {
        all.emplace_back();
        for (const auto& input : diagram.inputs) {
            const Slot& slot = diagram.slot(input.end);
            Matrix value(slot.size.rows, slot.size.cols);
            for (int i = 0; i < slot.size.count(); ++i) value.data()[i] = normal(random);
            if (slot.size.rows == slot.size.cols && slot.size.rows > 1)
                value = (value * value.transpose() + Matrix::Identity(slot.size.rows, slot.size.cols)).eval();
            if (slot.type == Type::boolean)
                value = (value.array() > 0).cast<double>();
            else if (slot.type != Type::float64 && slot.type != Type::float32)
                value *= 10;
            if (slot.type != Type::float64)
                for (int i = 0; i < slot.size.count(); ++i) {
                    double stored = 0;
                    write_values(&stored, slot.type, 1, {value.data()[i]});
                    value.data()[i] = read_value(&stored, slot.type, 0);
                }
            all.back().insert(all.back().end(), value.data(), value.data() + value.size());
        }
    }
    return all;
}

/// The same run in the engine.
inline Recording simulate(const Diagram& diagram, const std::vector<std::vector<double>>& inputs) {
    Recording recording;
    struct Observer final : Simulation::Observer {
        Recording* to;
        void observe(const Simulation& s) noexcept override {
            std::vector<double> row{s.time()};
            for (const auto& signal : s.diagram().record) {
                const Slot& slot = s.diagram().slot(signal.end);
                for (int i = 0; i < slot.size.count(); ++i)
                    row.push_back(
                        read_value(s.context().data(signal.end.node, signal.end.slot), slot.type, i));
            }
            to->rows.push_back(std::move(row));
        }
    } observer;
    observer.to = &recording;
    Simulation simulation(diagram);
    simulation.add_observer(observer);
    simulation.start();
    for (const auto& values : inputs) {
        std::size_t at = 0;
        for (const auto& input : diagram.inputs) {
            const Slot& slot = diagram.slot(input.end);
            const auto count = static_cast<std::size_t>(slot.size.count());
            write_values(simulation.context().data(input.end.node, input.end.slot), slot.type,
                         slot.size.count(), {&values[at], &values[at] + count});
            at += count;
        }
        if (!simulation.step()) break;
    }
    recording.failure = simulation.failure();
    return recording;
}

/// Models that are generated into one folder, each into a subfolder of its own, and compiled as one program.
class Batch {
  public:
    explicit Batch(const std::string& name)
        : folder_(fs::temp_directory_path() / ("bf_codegen_" + name + "_" + std::to_string(getpid()))) {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    ~Batch() {
        std::error_code ignored;
        if (!testing::Test::HasFailure()) fs::remove_all(folder_, ignored);
    }

    /// The diagram's name is the name of the case and must be an identifier of its own.
    void add(Elaborated elaborated, int steps = 6, const Options& options = {}) {
        const Diagram& diagram = elaborated.diagram;
        const Files files = generate(diagram, options);
        const std::string name = file_name(diagram);
        for (const auto& [file, text] : files)
            write_text(folder_ / (file.starts_with("include/") ? fs::path(file) : fs::path(name) / file),
                       text);
        for (const auto& [file, text] : files)
            if (file.ends_with(".cpp") && file != "main.cpp")
                sources_ += "#include \"" + name + "/" + file + "\"\n";
        calls_ += "    run<" + class_name(diagram) + ">(\"" + name + "\", " + std::to_string(steps) + ");\n";
        auto inputs = input_values(diagram, steps);
        std::ofstream stream(folder_ / (name + ".in"), std::ios::binary);
        for (const auto& row : inputs)
            stream.write(reinterpret_cast<const char*>(row.data()),
                         static_cast<std::streamsize>(row.size() * sizeof(double)));
        Recording expected = simulate(diagram, inputs);
        cases_.push_back({name, std::move(elaborated), std::move(expected)});
    }

    /// Compiles and runs everything with one compiler and compares.
    void expect_equal(const std::string& compiler, const std::string& flags) {
        write_text(folder_ / "driver.cpp", sources_ + driver + "int main() {\n" + calls_ + "}\n");
        const std::string at = "cd " + folder_.string() + " && ";
        ASSERT_EQ(std::system((at + compiler + " -std=c++17 -pedantic -ffp-contract=off " + flags +
                               " -Iinclude driver.cpp -o driver && ./driver")
                                  .c_str()),
                  0)
            << folder_;
        for (const auto& one : cases_) compare(one, compiler + " " + flags);
    }
    std::size_t size() const { return cases_.size(); }
    const Recording& expected(const std::string& name) const { return find(name).expected; }
    /// Column of a scalar signal in the rows of a recording.
    std::size_t column(const std::string& name, const std::string& path) const {
        std::size_t column = 1;
        const Diagram& diagram = find(name).elaborated.diagram;
        for (const auto& signal : diagram.record) {
            if (signal.path == path) return column;
            column += static_cast<std::size_t>(diagram.slot(signal.end).size.count());
        }
        throw std::runtime_error("no signal " + path);
    }
    const fs::path& folder() const { return folder_; }

    static void write_text(const fs::path& file, const std::string& text) {
        fs::create_directories(file.parent_path());
        std::ofstream(file, std::ios::binary) << text;
    }
    static std::string read_text(const fs::path& file) {
        std::ostringstream text;
        text << std::ifstream(file, std::ios::binary).rdbuf();
        return text.str();
    }

  private:
    struct Case {
        std::string name;
        Elaborated elaborated;
        Recording expected;
    };

    static constexpr const char* driver = R"(
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <type_traits>

using namespace bf::generated;
template <class Model> void run(const std::string& name, int steps) {
    const auto model = std::make_unique<Model>();
    std::ifstream in(name + ".in", std::ios::binary);
    std::ofstream out(name + ".out", std::ios::binary), text(name + ".txt");
    const auto put = [&](double x) { out.write(reinterpret_cast<const char*>(&x), sizeof x); };
    bool good = model->initialize();
    for (int k = 0; good && k < steps; ++k) {
        for (const Quantity& q : Model::recorded_table())
            if (q.where == Where::inputs)
                for (int i = 0; i < q.size(); ++i) {
                    double x = 0;
                    in.read(reinterpret_cast<char*>(&x), sizeof x);
                    write(model->data(q), q.type, i, x);
                }
        good = model->output();
        if (!good) break;
        put(model->time());
        for (const Quantity& q : Model::recorded_table())
            for (int i = 0; i < q.size(); ++i) put(read(model->data(q), q.type, i));
        good = model->update();
    }
    model->terminate();
    if (!good) text << model->failed_block() << ": " << model->failure();
}
)";

    const Case& find(const std::string& name) const {
        for (const auto& one : cases_)
            if (one.name == name) return one;
        throw std::runtime_error("no case " + name);
    }
    void compare(const Case& one, const std::string& how) const;

    fs::path folder_;
    std::string sources_, calls_;
    std::vector<Case> cases_;
};

inline void Batch::compare(const Case& one, const std::string& how) const {
    const auto& rows = one.expected.rows;
    EXPECT_EQ(read_text(folder_ / (one.name + ".txt")), one.expected.failure) << one.name << ", " << how;
    const std::string bytes = read_text(folder_ / (one.name + ".out"));
    std::vector<double> seen(bytes.size() / sizeof(double));
    std::memcpy(seen.data(), bytes.data(), seen.size() * sizeof(double));
    const std::size_t width = rows.empty() ? 0 : rows[0].size();
    ASSERT_EQ(seen.size(), rows.size() * width) << one.name << ", " << how;
    for (std::size_t k = 0; k < rows.size(); ++k)
        for (std::size_t i = 0; i < width; ++i) {
            const double expected = rows[k][i], found = seen[k * width + i];
            if (std::memcmp(&expected, &found, sizeof expected) == 0 ||
                (expected != expected && found != found))
                continue;
            std::size_t column = i;
            std::string name = "time";
            if (column-- > 0)
                for (const auto& signal : one.elaborated.diagram.record) {
                    name = signal.path;
                    const auto count =
                        static_cast<std::size_t>(one.elaborated.diagram.slot(signal.end).size.count());
                    if (column < count) break;
                    column -= count;
                }
            FAIL() << one.name << ", " << how << ", step " << k << ", " << name << "(" << column + 1
                   << "): " << found << " instead of " << expected;
        }
}

} // namespace bf::codegen::test
