#include "compare.hpp"
#include "folder.hpp"

#include "bf/engine/simulation.hpp"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace bf::codegen::test {

namespace {

/// Values of the root inputs for each step, in order; square matrices are symmetric and positive definite.
std::vector<std::vector<double>> input_values(const Diagram& diagram, int steps) {
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
Recording simulate(const Diagram& diagram, const std::vector<std::vector<double>>& inputs) {
    Recording recording;
    struct Observer final : Simulation::Observer {
        Recording* to;
        void observe(const bf::Run& run) noexcept override {
            const auto& s = static_cast<const Simulation&>(run);
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
    try {
        simulation.start();
    } catch (const RunError& error) {
        recording.failure = error.what();
        return recording;
    }
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

void compare(const Case& one, const Recording& expected, const std::vector<double>& seen,
             const std::string& failure, const std::string& how) {
    const auto& rows = expected.rows;
    const Diagram& diagram = one.elaborated.diagram;
    const std::string name = file_name(diagram);
    EXPECT_EQ(failure, expected.failure) << name << ", " << how;
    const std::size_t width = rows.empty() ? 0 : rows[0].size();
    ASSERT_EQ(seen.size(), rows.size() * width) << name << ", " << how;
    for (std::size_t k = 0; k < rows.size(); ++k)
        for (std::size_t i = 0; i < width; ++i) {
            const double wanted = rows[k][i], found = seen[k * width + i];
            if (std::memcmp(&wanted, &found, sizeof wanted) == 0 || (wanted != wanted && found != found))
                continue;
            std::size_t column = i;
            std::string path = "time";
            if (column-- > 0)
                for (const auto& signal : diagram.record) {
                    path = signal.path;
                    const auto count = static_cast<std::size_t>(diagram.slot(signal.end).size.count());
                    if (column < count) break;
                    column -= count;
                }
            FAIL() << name << ", " << how << ", step " << k << ", " << path << "(" << column + 1
                   << "): " << found << " instead of " << wanted;
        }
}

std::vector<double> numbers_of_bytes(const std::string& bytes) {
    std::vector<double> numbers(bytes.size() / sizeof(double));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
    return numbers;
}

/// Of a CSV text behind its headings.
std::vector<double> numbers_of_text(const std::string& text) {
    std::vector<double> numbers;
    const char* at = text.c_str() + std::min(text.find('\n'), text.size());
    for (char* end = nullptr;; at = end + (*end == ',')) {
        const double x = std::strtod(at, &end);
        if (end == at) return numbers;
        numbers.push_back(x);
    }
}

} // namespace

std::map<std::string, Recording> compare_all(const std::vector<Case>& cases, const Drivers& compiled) {
    const Folder folder;
    std::map<std::string, Recording> all;
    for (const auto& one : cases) {
        const Diagram& diagram = one.elaborated.diagram;
        const auto inputs = input_values(diagram, one.steps);
        std::ofstream stream(folder.path / (file_name(diagram) + ".in"), std::ios::binary);
        for (const auto& row : inputs)
            stream.write(reinterpret_cast<const char*>(row.data()),
                         static_cast<std::streamsize>(row.size() * sizeof(double)));
        std::ofstream text(folder.path / (file_name(diagram) + ".rows"));
        text.precision(17);
        for (const auto& row : inputs) {
            for (const double x : row) text << x << " ";
            text << "\n";
        }
        all[file_name(diagram)] = simulate(diagram, inputs);
    }
    const auto run = [&](const std::string& driver) {
        EXPECT_EQ(std::system(("cd " + folder.path.string() + " && BLOCKFACTORY_PLUGIN_PATH='" +
                               compiled.plugins + "' " + driver)
                                  .c_str()),
                  0);
    };
    std::istringstream drivers(compiled.plain + " " + compiled.hosted);
    for (std::string driver; drivers >> driver;) {
        run(driver);
        for (const auto& one : cases) {
            const std::string name = file_name(one.elaborated.diagram);
            if (has_hosted_blocks(one.elaborated.diagram) == (driver == compiled.hosted))
                compare(one, all.at(name), numbers_of_bytes(read_text(folder.path / (name + ".out"))),
                        read_text(folder.path / (name + ".txt")), driver);
        }
    }
    std::istringstream c_drivers(compiled.in_c);
    for (std::string driver; c_drivers >> driver;) {
        run(driver);
        for (const auto& one : cases) {
            if (!is_c_case(one)) continue;
            const std::string name = file_name(one.elaborated.diagram);
            std::string failure = read_text(folder.path / (name + ".txt"));
            if (failure.ends_with("\n")) failure.pop_back();
            compare(one, all.at(name), numbers_of_text(read_text(folder.path / (name + ".csv"))), failure,
                    driver);
        }
    }
    return all;
}

} // namespace bf::codegen::test
