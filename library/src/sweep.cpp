#include "bf/library/sweep.hpp"

#include "bf/base/numbers.hpp"
#include "bf/core/hash.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/matlab/value.hpp"
#include "bf/run/comparison.hpp"
#include "workers.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <thread>

namespace bf {

namespace {

using Json = nlohmann::ordered_json;

/// splitmix64 (Steele, Lea, Flood, 2014): a bijection that mixes all bits.
std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
}

/// In (0, 1).
double fraction(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

/// Doubles as texts, since JSON has no infinity and no NaN.
std::string encoded(const SweepRow& row) {
    Json json{{"error", row.error}, {"failed_at", row.failed_at}, {"results", Json::array()}};
    for (const auto& [name, value] : row.results) json["results"].push_back({name, number_text(value)});
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

SweepRow decoded(const std::string& text) {
    const Json json = Json::parse(text);
    SweepRow row{{}, json["error"], json["failed_at"]};
    for (const auto& result : json["results"])
        row.results.emplace_back(result[0], std::strtod(result[1].get<std::string>().c_str(), nullptr));
    return row;
}

/// Keeps what signals were when the last step was observed: one that fails leaves others.
class Finals final : public Run::Observer {
  public:
    explicit Finals(std::vector<Quantity> signals) : signals_(std::move(signals)) {
        for (const auto& signal : signals_)
            for (std::size_t i = 0; i < signal.info.elements(); ++i)
                values.emplace_back(signal.path + signal.info.element_text(i), std::nan(""));
    }
    void observe(const Run&) noexcept override {
        std::size_t k = 0;
        for (const auto& signal : signals_)
            for (std::size_t i = 0; i < signal.info.elements(); ++i)
                values[k++].second = signal[static_cast<int>(i)];
    }
    std::vector<std::pair<std::string, double>> values;

  private:
    const std::vector<Quantity> signals_;
};

SweepRow run_point(const Sweep& sweep, const Point& point) {
    SweepRow row;
    try {
        std::vector<Override> overrides = sweep.overrides;
        for (const auto& [name, value] : point) overrides.push_back({name, value});
        const LoadedModel loaded = load(sweep.file, overrides, sweep.texts);
        const Diagram& diagram = loaded.diagram;
        if (!std::isfinite(diagram.stop))
            throw RunError(
                diagram.name +
                " does not say when it ends: give --stop SECONDS, or write 'stop: SECONDS' in the model");
        Simulation simulation(diagram);
        if (const auto devices = simulation.context().devices(); !devices.empty())
            throw RunError(diagram.nodes[static_cast<std::size_t>(devices[0])].path +
                           ": is a device, and a sweep only simulates");
        std::vector<Quantity> signals = simulation.quantities(diagram.outputs);
        for (const auto& path : sweep.finals) signals.push_back(find_signal(simulation, path));
        Finals finals(std::move(signals));
        simulation.add_observer(finals);
        simulation.leave_outputs_of_solver();
        simulation.start();
        simulation.run_until(diagram.stop);
        row.error = simulation.failure();
        if (!row.error.empty()) row.failed_at = simulation.time();
        for (const auto& check : simulation.checks()) row.results.emplace_back(check.name, check.value);
        row.results.insert(row.results.end(), finals.values.begin(), finals.values.end());
        simulation.stop();
    } catch (const std::exception& error) {
        row.error = error.what();
    }
    return row;
}

} // namespace

double Random::sample(std::uint64_t seed, std::uint64_t i) const {
    const std::uint64_t stream =
        mixed(mixed(seed) ^ fnv1a(std::as_bytes(std::span(name.data(), name.size()))));
    const double u = fraction(mixed(stream + 2 * i)), v = fraction(mixed(stream + 2 * i + 1));
    switch (kind) {
    case Kind::uniform: return std::lerp(a, b, u);
    case Kind::integers: return a + std::floor((b - a + 1) * u);
    case Kind::normal: break;
    }
    // Box and Muller, 1958.
    return a + b * std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

std::size_t Points::size() const {
    constexpr double most = 1e6;
    double count = static_cast<double>(samples);
    for (const auto& axis : axes) count *= static_cast<double>(axis.values.size());
    if (count > most)
        throw RunError("the sweep has " + number_text(count) + " runs; at most 1000000 go at once");
    return static_cast<std::size_t>(count);
}

Point Points::operator[](std::size_t i) const {
    const std::uint64_t sample = i % samples;
    std::size_t rest = i / samples;
    Point point;
    for (auto axis = axes.rbegin(); axis != axes.rend(); ++axis) {
        point.insert(point.begin(), {axis->name, axis->values[rest % axis->values.size()]});
        rest /= axis->values.size();
    }
    for (const auto& random : randoms)
        point.emplace_back(random.name, matlab::number_text(random.sample(seed, sample)));
    return point;
}

std::vector<std::string> Points::names() const {
    std::vector<std::string> names;
    for (const auto& axis : axes)
        if (axis.values.size() > 1) names.push_back(axis.name);
    for (const auto& random : randoms) names.push_back(random.name);
    return names;
}

std::vector<std::optional<SweepRow>> sweep(const Sweep& sweep,
                                           const std::function<bool(std::size_t done)>& go_on) {
    std::vector<std::optional<SweepRow>> rows(sweep.points.size());
    std::size_t done = 0;
    const int processors = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    share(
        rows.size(), sweep.jobs > 0 ? sweep.jobs : processors,
        [&](std::size_t i) { return encoded(run_point(sweep, sweep.points[i])); },
        [&](std::size_t i, const std::string& answer, const std::string& death) {
            rows[i] = death.empty() ? decoded(answer) : SweepRow{{}, death};
            ++done;
        },
        [&] { return !go_on || go_on(done); });
    return rows;
}

} // namespace bf
