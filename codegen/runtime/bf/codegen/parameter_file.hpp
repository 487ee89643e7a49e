// Parameter files: one `name = values` per line; `#` at the beginning or after a space begins a comment.
// Values are separated by spaces or commas, column by column; one value expands.
#pragma once

#include "bf/codegen/quantity.hpp"

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace bf::generated {

namespace detail {
inline std::string trimmed(const std::string& text) {
    const auto first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
    return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
}

/// The numbers of a text, or false.
inline bool numbers(std::string text, std::vector<double>& values) {
    for (char& c : text)
        if (c == ',' || c == ';' || c == '[' || c == ']') c = ' ';
    const char* at = text.c_str();
    for (;;) {
        while (*at == ' ' || *at == '\t') ++at;
        if (*at == '\0') return !values.empty();
        char* end = nullptr;
        values.push_back(std::strtod(at, &end));
        if (end == at || (*end != '\0' && *end != ' ' && *end != '\t')) return false;
        at = end;
    }
}
} // namespace detail

/// Gives a model all values of a file, or none. Returns an empty text, or every mistake on a line of its own.
template <class Model> std::string load_parameters(Model& model, const std::string& file) {
    std::ifstream stream(file);
    if (!stream) return "cannot read the parameter file " + file + "\n";
    const auto before = model.parameters;
    std::string errors, line;
    for (int number = 1; std::getline(stream, line); ++number) {
        line = detail::trimmed(line.substr(0, line.find(" #")));
        if (line.empty() || line[0] == '#') continue;
        const std::string where = file + ":" + std::to_string(number) + ": ";
        const auto equals = line.rfind('=');
        if (equals == std::string::npos) {
            errors += where + "write name = values, not '" + line + "'\n";
            continue;
        }
        const std::string name = detail::trimmed(line.substr(0, equals));
        const Quantity* q = Model::parameter_table().find(name.c_str());
        std::vector<double> values;
        if (!q) {
            errors += where + "there is no parameter '" + name + "'; --list names all\n";
        } else if (!detail::numbers(line.substr(equals + 1), values)) {
            errors += where + "'" + detail::trimmed(line.substr(equals + 1)) + "' is no list of numbers\n";
        } else if (const char* wrong = write_all(model.data(*q), *q, values.data(), int(values.size()))) {
            errors += where + "parameter '" + name + "': " + wrong + " (it has " + std::to_string(q->size()) +
                      ", the line gives " + std::to_string(values.size()) + ")\n";
        }
    }
    if (!errors.empty()) model.parameters = before;
    return errors;
}

} // namespace bf::generated
