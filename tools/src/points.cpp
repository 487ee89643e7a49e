#include "points.hpp"

#include "bf/base/names.hpp"
#include "bf/matlab/error.hpp"
#include "bf/matlab/formula.hpp"
#include "session.hpp"

#include <cmath>
#include <regex>

namespace bf::tools {

namespace {

double number_in(const std::string& text, const std::string& whole) {
    try {
        const auto value = matlab::evaluate(text, matlab::Workspace());
        if (value.is_numeric() && value.is_scalar() && std::isfinite(value.scalar())) return value.scalar();
    } catch (const matlab::Error&) {
    }
    throw CommandError("'" + text + "' in --random '" + whole + "' is no number");
}

} // namespace

Axis parse_axis(const std::string& set, const std::string& option) {
    const auto equals = set.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == set.size())
        throw CommandError("'" + set + "' is no NAME=VALUES, e.g. " + option + " Gain.Kp=1:0.5:3 or " +
                           option + " 'n={2 4}'");
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
        throw CommandError(option + " '" + set + "' has no values; write [] as one value in braces: {[]}");
    } else if (value.is_cell()) {
        for (matlab::Index i = 0; i < value.numel(); ++i) axis.values.push_back(value.at(i).to_text());
    } else if (value.is_scalar()) {
        axis.values = {text};
    } else if (value.is_vector()) {
        for (matlab::Index i = 0; i < value.numel(); ++i)
            axis.values.push_back(matlab::Value::array(value.type(), 1, 1, {value[i]}).to_text());
    } else {
        throw CommandError(option + " '" + set +
                           "' is a matrix; matrices that are values stand in braces: {[1 2; 3 4]}");
    }
    return axis;
}

Random parse_random(const std::string& text) {
    static const std::regex form(R"(\s*([^~]*[^~\s])\s*~\s*(\w+)\s*\(([^,]*),([^,]*)\)\s*)");
    std::smatch parts;
    if (!std::regex_match(text, parts, form))
        throw CommandError("'" + text +
                           "' is no distribution; write NAME~normal(MEAN,DEVIATION), "
                           "NAME~uniform(LEAST,MOST) or NAME~integers(LEAST,MOST)");
    Random random{parts[1], Random::Kind::normal, number_in(parts[3], text), number_in(parts[4], text)};
    if (parts[2] == "uniform")
        random.kind = Random::Kind::uniform;
    else if (parts[2] == "integers")
        random.kind = Random::Kind::integers;
    else if (parts[2] != "normal")
        throw CommandError("there is no distribution '" + std::string(parts[2]) + "'" +
                           did_you_mean(parts[2].str(), {"normal", "uniform", "integers"}) +
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

} // namespace bf::tools
