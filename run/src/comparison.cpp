#include "bf/run/comparison.hpp"

#include "bf/base/elements.hpp"
#include "bf/base/value_text.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

namespace bf {

namespace {

std::string trimmed(const std::string& text) {
    const auto begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t");
    return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

/// Which element of the signal "[2]", "[l_knee]" or "[1][2]" names.
int element_of(const Quantity& signal, std::string_view which, const std::string& text) {
    const recording::ChannelInfo& info = signal.info;
    if (const auto element = info.find_element(which)) return static_cast<int>(*element);
    const bool is_scalar = info.elements() == 1;
    throw RunError("'" + text + "' is no element: '" + signal.path + "' has " +
                   (is_scalar       ? "only one; call it "
                    : info.cols > 1 ? std::to_string(info.rows) + " x " + std::to_string(info.cols)
                                    : std::to_string(info.rows)) +
                   (is_scalar ? "" : ", counted from 1; name one, e.g. ") + signal.path +
                   info.element_text(0));
}

} // namespace

Quantity find_signal(const Run& run, const std::string& path) {
    std::vector<Quantity> all = run.inputs();
    for (auto& signal : run.signals()) all.push_back(std::move(signal));
    try {
        Quantity found = find(all, path);
        found.path = path;
        return found;
    } catch (const RunError& error) {
        throw RunError(std::string(error.what()) + "; bf check lists the signals");
    }
}

Comparison::Comparison(const Run& run, const std::string& text) {
    // Names may hold signs of comparison, numbers do not: the last one counts.
    const auto end = text.find_last_of("<>=");
    const bool has_two = end != text.npos && end > 0 && text[end] == '=';
    const auto begin = has_two ? end - 1 : end;
    const std::string comparison = end == text.npos ? "" : text.substr(begin, end - begin + 1);
    static constexpr std::string_view all[]{">", ">=", "<", "<=", "==", "~=", "!="};
    double x = 0;
    if (std::find(std::begin(all), std::end(all), comparison) == std::end(all) ||
        !read_value(trimmed(text.substr(end + 1)), x).empty() || std::isnan(x))
        throw RunError("'" + text +
                       "' is no event; write SIGNAL, one of > >= < <= == ~=, and a number, e.g. --until "
                       "'controller.x > 0.3'");
    const std::string name = trimmed(text.substr(0, begin));
    const auto [path, which] = split_element(name);
    signal_ = find_signal(run, std::string(path));
    element_ = element_of(signal_, which, name);
    if (comparison == ">") holds_ = [x](double y) { return y > x; };
    if (comparison == ">=") holds_ = [x](double y) { return y >= x; };
    if (comparison == "<") holds_ = [x](double y) { return y < x; };
    if (comparison == "<=") holds_ = [x](double y) { return y <= x; };
    if (comparison == "==") holds_ = [x](double y) { return y == x; };
    if (comparison == "~=" || comparison == "!=") holds_ = [x](double y) { return y != x; };
}

} // namespace bf
