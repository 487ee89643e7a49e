#include "points.hpp"

#include "bf/core/hash.hpp"
#include "bf/matlab/error.hpp"
#include "bf/matlab/interpreter.hpp"
#include "session.hpp"

#include <cmath>
#include <numbers>
#include <regex>
#include <span>

namespace bf::tools {

namespace {

/// splitmix64 (Steele, Lea, Flood, 2014): a bijection that mixes all bits.
std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
}

/// In (0, 1).
double fraction(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

double number_of(const std::string& text, const std::string& whole) {
    try {
        const auto value = matlab::evaluate(text, matlab::Workspace());
        if (value.is_numeric() && value.is_scalar() && std::isfinite(value.scalar())) return value.scalar();
    } catch (const matlab::Error&) {
    }
    throw CommandError("'" + text + "' in --random '" + whole + "' is no number");
}

} // namespace

Axis parse_axis(const std::string& set) {
    const auto equals = set.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == set.size())
        throw CommandError("'" + set + "' is no NAME=VALUES, e.g. --set Gain.Kp=1:0.5:3 or --set 'n={2 4}'");
    Axis axis{set.substr(0, equals), {}};
    const std::string text = set.substr(equals + 1);
    matlab::Value value;
    try {
        value = matlab::evaluate(text, matlab::Workspace());
    } catch (const matlab::Error&) {
        axis.values = {text}; // of the model's variables; if it is wrong, elaboration says so
        return axis;
    }
    if (value.is_text() || value.is_function() || value.is_struct()) {
        axis.values = {text};
    } else if (value.is_empty()) {
        throw CommandError("--set '" + set + "' has no values; write [] as one value in braces: {[]}");
    } else if (value.is_cell()) {
        for (matlab::Index i = 0; i < value.numel(); ++i) axis.values.push_back(value.at(i).to_text());
    } else if (value.is_scalar()) {
        axis.values = {text};
    } else if (value.is_vector()) {
        for (matlab::Index i = 0; i < value.numel(); ++i)
            axis.values.push_back(matlab::Value::array(value.type(), 1, 1, {value[i]}).to_text());
    } else {
        throw CommandError("--set '" + set +
                           "' is a matrix; matrices that are values stand in braces: {[1 2; 3 4]}");
    }
    return axis;
}

double Random::sample(std::uint64_t seed, std::uint64_t i) const {
    const std::uint64_t stream =
        mixed(mixed(seed) ^ fnv1a(std::as_bytes(std::span(name.data(), name.size()))));
    const double u = fraction(mixed(stream + 2 * i)), v = fraction(mixed(stream + 2 * i + 1));
    switch (kind) {
    case Kind::uniform: return a + (b - a) * u;
    case Kind::integers: return a + std::floor((b - a + 1) * u);
    case Kind::normal: break;
    }
    // Box and Muller, 1958.
    return a + b * std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

Random parse_random(const std::string& text) {
    static const std::regex form(R"(\s*([^~\s]+)\s*~\s*(\w+)\s*\(([^,]*),([^,]*)\)\s*)");
    std::smatch parts;
    if (!std::regex_match(text, parts, form))
        throw CommandError("'" + text +
                           "' is no distribution; write NAME~normal(MEAN,DEVIATION), "
                           "NAME~uniform(LEAST,MOST) or NAME~integers(LEAST,MOST)");
    Random random{parts[1], Random::Kind::normal, number_of(parts[3], text), number_of(parts[4], text)};
    if (parts[2] == "uniform")
        random.kind = Random::Kind::uniform;
    else if (parts[2] == "integers")
        random.kind = Random::Kind::integers;
    else if (parts[2] != "normal")
        throw CommandError("there is no distribution '" + std::string(parts[2]) + "'" +
                           did_you_mean(parts[2], {"normal", "uniform", "integers"}) +
                           "; there are normal, uniform and integers");
    if (random.kind == Random::Kind::normal ? random.b < 0 : random.b < random.a)
        throw CommandError("--random '" + text + "': " +
                           (random.kind == Random::Kind::normal ? "the deviation is negative"
                                                                : "the first bound is above the second"));
    if (random.kind == Random::Kind::integers &&
        (random.a != std::floor(random.a) || random.b != std::floor(random.b)))
        throw CommandError("--random '" + text + "': the bounds must be whole numbers");
    return random;
}

std::size_t Points::size() const {
    constexpr double most = 1e6;
    double count = static_cast<double>(samples);
    for (const auto& axis : axes) count *= static_cast<double>(axis.values.size());
    if (count > most)
        throw CommandError("the sweep has " + number(count) + " runs; at most 1000000 go at once");
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

} // namespace bf::tools
