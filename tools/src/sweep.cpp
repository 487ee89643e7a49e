// bf sweep: runs a model for many values of its parameters and makes one table of the results.
#include "bf/base/numbers.hpp"
#include "files.hpp"
#include "points.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

namespace bf::tools {

namespace {

using Json = nlohmann::ordered_json;

struct SweepOptions {
    ModelOptions model;
    std::vector<std::string> randoms, finals;
    std::string stop, output;
    std::uint64_t samples = 1, seed = 1;
    int jobs = 0;
    bool is_quiet = false, as_json = false;
};

std::string failure(const SweepRow& row) {
    return row.error.empty() || row.failed_at < 0 ? row.error
                                                  : "at t = " + number(row.failed_at) + " s: " + row.error;
}

/// What all rows together hold.
class Table {
  public:
    Table(const Points& points, std::vector<std::optional<SweepRow>> rows)
        : points_(points), names_(points.names()), rows_(std::move(rows)) {
        for (const auto& row : rows_) {
            if (!row) continue;
            ++done_;
            failed_ += !row->error.empty();
            for (const auto& [name, value] : row->results)
                if (std::find(results_.begin(), results_.end(), name) == results_.end())
                    results_.push_back(name);
        }
    }

    std::size_t done() const { return done_; }
    std::size_t failed() const { return failed_; }
    /// How many runs failed, and every error once, as the first run has it.
    std::string failures() const {
        struct Failure {
            std::size_t first, count;
        };
        std::vector<Failure> failures;
        std::map<std::string, std::size_t> numbers;
        each([&](std::size_t i, const SweepRow& row) {
            if (row.error.empty()) return;
            const auto [known, is_new] = numbers.emplace(row.error, failures.size());
            if (is_new) failures.push_back({i, 0});
            ++failures[known->second].count;
        });
        constexpr std::size_t most = 10;
        std::string text = std::to_string(failed_) + " of " + std::to_string(rows_.size()) + " runs failed";
        for (std::size_t f = 0; f < std::min(most, failures.size()); ++f) {
            const auto& [first, count] = failures[f];
            text += "\n    run " + std::to_string(first) +
                    (count > 1 ? " and " + std::to_string(count - 1) + " more: " : ": ") +
                    failure(*rows_[first]);
        }
        if (failures.size() > most)
            text += "\n    and " + std::to_string(failures.size() - most) + " other errors";
        return text;
    }

    std::string csv() const {
        std::string text = "run";
        for (const auto& name : names_) text += "," + quoted(name);
        for (const auto& name : results_) text += "," + quoted(name);
        text += ",error\n";
        each([&](std::size_t i, const SweepRow& row) {
            text += std::to_string(i);
            for (const auto& value : values(i)) text += "," + quoted(value);
            for (const auto& name : results_) text += "," + cell(row, name);
            text += "," + quoted(failure(row)) + "\n";
        });
        return text;
    }

    Json json() const {
        Json list = Json::array();
        each([&](std::size_t i, const SweepRow& row) {
            Json entry{{"run", i}, {"set", Json::object()}, {"results", Json::object()}};
            const auto its = values(i);
            for (std::size_t n = 0; n < names_.size(); ++n) entry["set"][names_[n]] = its[n];
            for (const auto& [name, value] : row.results) entry["results"][name] = value;
            if (!row.error.empty()) entry["error"] = failure(row);
            list.push_back(std::move(entry));
        });
        return list;
    }

    /// Every row, or where there are many what they come to.
    void print() const {
        constexpr std::size_t most = 24;
        std::vector<std::vector<std::string>> cells;
        if (done_ <= most) {
            cells.push_back({"run"});
            append(cells[0], names_);
            append(cells[0], results_);
            each([&](std::size_t i, const SweepRow& row) {
                auto& line = cells.emplace_back(std::vector<std::string>{std::to_string(i)});
                for (const auto& value : values(i)) line.push_back(short_text(value));
                for (const auto& name : results_) {
                    const auto* value = find(row, name);
                    line.push_back(value ? number(*value) : "-");
                }
                if (!row.error.empty()) line.push_back("failed");
            });
        } else {
            cells.push_back({"", "mean", "deviation", "least", "most"});
            for (const auto& name : results_) cells.push_back(statistics(name));
        }
        print(cells);
    }

  private:
    template <class Visit> void each(Visit&& visit) const {
        for (std::size_t i = 0; i < rows_.size(); ++i)
            if (rows_[i]) visit(i, *rows_[i]);
    }
    static void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
        to.insert(to.end(), more.begin(), more.end());
    }
    static std::string quoted(const std::string& text) {
        if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
        std::string out = "\"";
        for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
        return out + '"';
    }
    std::vector<std::string> values(std::size_t i) const {
        const Point point = points_[i];
        std::vector<std::string> values;
        for (const auto& name : names_)
            values.push_back(std::find_if(point.begin(), point.end(), [&](const auto& p) {
                                 return p.first == name;
                             })->second);
        return values;
    }
    /// A number with six digits, anything else as it is.
    static std::string short_text(const std::string& value) {
        const auto x = number_of(value);
        return x ? number(*x) : value;
    }
    static const double* find(const SweepRow& row, const std::string& name) {
        for (const auto& [its, value] : row.results)
            if (its == name) return &value;
        return nullptr;
    }
    static std::string cell(const SweepRow& row, const std::string& name) {
        const double* value = find(row, name);
        return value ? (std::isnan(*value) ? "NaN" : number_text(*value)) : "";
    }
    std::vector<std::string> statistics(const std::string& name) const {
        double n = 0, mean = 0, squares = 0, least = INFINITY, most = -INFINITY;
        each([&](std::size_t, const SweepRow& row) {
            const double* x = find(row, name);
            if (!x || !row.error.empty()) return;
            const double delta = *x - mean; // Welford's recurrence
            mean += delta / ++n;
            squares += delta * (*x - mean);
            least = std::min(least, *x);
            most = std::max(most, *x);
        });
        if (n == 0) return {name, "-", "-", "-", "-"};
        return {name, number(mean), number(n > 1 ? std::sqrt(squares / (n - 1)) : 0), number(least),
                number(most)};
    }
    static void print(const std::vector<std::vector<std::string>>& cells) {
        std::vector<std::size_t> widths;
        for (const auto& line : cells)
            for (std::size_t c = 0; c < std::min(line.size(), cells[0].size()); ++c) {
                widths.resize(std::max(widths.size(), c + 1));
                widths[c] = std::max(widths[c], line[c].size());
            }
        for (const auto& line : cells) {
            std::string text;
            for (std::size_t c = 0; c < line.size(); ++c)
                text +=
                    "  " + (c < widths.size() ? std::string(widths[c] - line[c].size(), ' ') : "") + line[c];
            std::printf("%s\n", text.c_str());
        }
    }

    const Points& points_;
    std::vector<std::string> names_, results_;
    std::vector<std::optional<SweepRow>> rows_;
    std::size_t done_ = 0, failed_ = 0;
};

std::string progress(std::size_t done, std::size_t count, double wall) {
    constexpr std::size_t width = 30;
    const std::size_t filled = width * done / count;
    std::string text = "  [" + std::string(filled, '#') + std::string(width - filled, '.') + "] " +
                       std::to_string(done) + "/" + std::to_string(count) + " runs, " +
                       number(std::round(wall)) + " s";
    if (done > 0 && done < count)
        text += ", about " +
                number(std::ceil(wall * static_cast<double>(count - done) / static_cast<double>(done))) +
                " s left";
    return text;
}

Points points_of(const SweepOptions& options) {
    Points points;
    for (const auto& set : options.model.sets) points.axes.push_back(parse_axis(set));
    for (const auto& random : options.randoms) points.randoms.push_back(parse_random(random));
    if (options.samples < 1) throw CommandError("--samples 0 leaves nothing to run; give 1 or more");
    if (options.samples > 1 && options.randoms.empty())
        throw CommandError(
            "--samples " + std::to_string(options.samples) +
            " would repeat the same runs: say what is random, e.g. --random 'mass~normal(1,0.1)'");
    points.samples = options.samples;
    points.seed = options.seed;
    std::vector<std::string> names;
    for (const auto& axis : points.axes) names.push_back(axis.name);
    for (const auto& random : points.randoms) names.push_back(random.name);
    for (std::size_t i = 0; i < names.size(); ++i)
        if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
            names.begin() + static_cast<std::ptrdiff_t>(i))
            throw CommandError("'" + names[i] + "' is set twice; give all its values at once");
    return points;
}

void execute(const SweepOptions& options) {
    const Points points = points_of(options);
    const std::size_t count = points.size();
    if (!std::filesystem::exists(options.model.file))
        throw CommandError("there is no model file " + options.model.file);
    FileSet read = files_of(options.model.file);
    read.insert(options.model.params.begin(), options.model.params.end());
    refuse_overwriting({{"-o", options.output}}, read);
    std::optional<OutputFile> output;
    if (!options.output.empty()) output.emplace(options.output);

    Sweep all{options.model.file, points, ModelOptions{{}, {}, options.model.params}.overrides(),
              options.finals, options.jobs};
    if (!options.stop.empty()) all.overrides.push_back({"stop", options.stop});
    const InterruptGuard guard;
    StatusLine line;
    const auto begin = std::chrono::steady_clock::now();
    const auto wall = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    std::size_t done = 0;
    auto rows = sweep(all, [&](std::size_t finished) {
        done = finished;
        if (!options.is_quiet && wall() > 1 && line.is_due()) line.show(progress(done, count, wall()));
        return !InterruptGuard::signal();
    });
    done = static_cast<std::size_t>(
        std::ranges::count_if(rows, [](const auto& row) { return row.has_value(); }));
    if (!options.is_quiet) line.finish(progress(done, count, wall()));

    const Table table(points, std::move(rows));
    if (output) {
        output->write(table.csv());
        output->commit();
    }
    if (options.as_json)
        std::fputs(to_text(table.json()).c_str(), stdout);
    else if (table.failed() < count)
        table.print();
    std::fflush(stdout);
    const std::string what = std::to_string(table.done()) + " of " + std::to_string(count) + " runs";
    if (InterruptGuard::signal())
        throw Interrupted(InterruptGuard::signal(),
                          "interrupted after " + what +
                              (output ? "; " + options.output + " holds them" : ""));
    if (table.failed() == count) throw CommandError(table.failures());
    if (options.as_json) return;
    if (table.failed() > 0) std::printf("  %s\n", table.failures().c_str());
    if (output) std::printf("  table in %s\n", options.output.c_str());
}

} // namespace

void add_sweep(CLI::App& app) {
    auto* command = app.add_subcommand("sweep", "run a model for many values, on all cores, into one table");
    auto options = std::make_shared<SweepOptions>();
    command->add_option("MODEL", options->model.file, "model file (.yaml)")->required()->type_name("");
    command
        ->add_option(
            "--set", options->model.sets,
            "values of a variable, a block's setting, or the model's step, stop and solver settings: each "
            "element is one; may be repeated, and all combinations are run")
        ->type_name("NAME=VALUES")
        ->allow_extra_args(false);
    command->add_option("--params", options->model.params, "YAML file of names and expressions to change")
        ->type_name("FILE")
        ->allow_extra_args(false);
    command
        ->add_option("--random", options->randoms,
                     "a value that differs between samples: ~normal(MEAN,DEVIATION), ~uniform(LEAST,MOST) or "
                     "~integers(LEAST,MOST)")
        ->type_name("NAME~DISTRIBUTION")
        ->allow_extra_args(false);
    command->add_option("--samples", options->samples, "samples of the random values")
        ->type_name("N")
        ->capture_default_str();
    command->add_option("--seed", options->seed, "another seed gives other samples")
        ->type_name("S")
        ->capture_default_str();
    command->add_option("--stop", options->stop, "duration of each run, s (an expression)")->type_name("T");
    command
        ->add_option("--final", options->finals,
                     "a signal whose last value is a column; may be repeated. Checks and the root's outputs "
                     "always are")
        ->type_name("SIGNAL")
        ->allow_extra_args(false);
    command->add_option("-j,--jobs", options->jobs, "runs at the same time; otherwise one per core")
        ->type_name("J")
        ->check(between(1, std::numeric_limits<int>::max()));
    command->add_option("-o,--output", options->output, "write the table to this CSV file")
        ->type_name("FILE");
    command->add_flag("--json", options->as_json, "print the table as JSON");
    command->add_flag("--quiet", options->is_quiet, "show nothing while it runs");
    command->footer(
        "The table is the same for every number of jobs. A run that fails is a row with its error; the exit "
        "code is 1 only if all fail. Ctrl-C leaves the table of the runs that are done.\n"
        "Examples:\n"
        "  bf sweep docs/start/motor.yaml --set Gain.Kp=0.05:0.05:0.3 --set 'supply={6 12 24}' -o motor.csv\n"
        "  bf sweep docs/start/motor.yaml --random 'supply~normal(24,1)' --samples 100 --seed 7");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
