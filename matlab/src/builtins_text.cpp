#include "builtins.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace bf::matlab {
namespace {

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}
std::string upper(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return text;
}
std::string trim(const std::string& text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n\v\f");
    if (first == std::string::npos) return "";
    return text.substr(first, text.find_last_not_of(" \t\r\n\v\f") - first + 1);
}

/// f of a text, or of every element of a cell of texts.
template <typename F> Value each_text(const Value& x, F f) {
    if (!x.is_cell()) return Value(std::string_view(f(x.text())));
    Value result = x;
    for (Index i = 0; i < x.numel(); ++i) result.set_at(i, Value(std::string_view(f(x.at(i).text()))));
    return result;
}

/// printf with one number; `conversion` is a checked `%...g` or the like.
std::string print(const std::string& conversion, double x) {
    std::string buffer(512, '\0');
    const int n = std::snprintf(buffer.data(), buffer.size(), conversion.c_str(), x);
    buffer.resize(std::clamp<int>(n, 0, int(buffer.size()) - 1));
    return buffer;
}

std::string escaped(const std::string& format) {
    std::string out;
    for (std::size_t i = 0; i < format.size(); ++i) {
        if (format[i] != '\\' || i + 1 == format.size()) {
            out += format[i];
            continue;
        }
        switch (format[++i]) {
        case 'n': out += '\n'; break;
        case 't': out += '\t'; break;
        case 'r': out += '\r'; break;
        case '\\': out += '\\'; break;
        default: out += std::string("\\") + format[i];
        }
    }
    return out;
}

/// The next element to print: a number, or the whole of a text argument.
struct Element {
    double number = 0;
    std::string text;
    bool is_text = false;
};

std::string print_element(std::string flags, char conversion, const Element& element) {
    if (conversion == 's' || conversion == 'c') {
        std::string text = element.text;
        if (!element.is_text)
            text = conversion == 'c'
                       ? std::string(1, char(static_cast<unsigned char>(cast(element.number, Class::Char))))
                       : print("%.5g", element.number);
        const bool left = flags.find('-') != std::string::npos;
        int width = 0;
        for (const char c : flags) {
            if (c == '.') break;
            if (c >= '0' && c <= '9') width = std::min(width * 10 + (c - '0'), 400);
        }
        const std::size_t fill = std::size_t(width) > text.size() ? width - text.size() : 0;
        return left ? text + std::string(fill, ' ') : std::string(fill, ' ') + text;
    }
    if (element.is_text && element.text.size() != 1) return element.text;
    const double x = element.is_text ? double(static_cast<unsigned char>(element.text[0])) : element.number;
    if (std::string_view("diuxX").find(conversion) != std::string_view::npos) {
        if (x != std::round(x))
            return print("%" + flags + (flags.find('.') == std::string::npos ? "e" : "f"), x);
        if (conversion == 'x' || conversion == 'X') {
            char digits[24];
            const auto end =
                std::to_chars(digits, digits + 24, std::uint64_t(std::clamp(x, 0.0, 9e18)), 16).ptr;
            return conversion == 'x' ? std::string(digits, end) : upper({digits, end});
        }
        return print("%" + flags.substr(0, flags.find('.')) + ".0f", x);
    }
    return print("%" + flags + conversion, x);
}

std::vector<Element> elements(const std::vector<Value>& arguments, std::size_t first) {
    std::vector<Element> list;
    for (std::size_t i = first; i < arguments.size(); ++i) {
        const Value& x = arguments[i];
        if (x.is_text()) {
            list.push_back({0, x.text(), true});
        } else if (x.is_array()) {
            for (Index k = 0; k < x.numel(); ++k) list.push_back({x[k], "", false});
        } else {
            throw Error("a " + std::string(x.type_name()) + " cannot be printed");
        }
    }
    return list;
}

/// Digits that num2str shows of numbers up to `largest`.
int shown_digits(double largest) {
    const double magnitude = largest > 0 && std::isfinite(largest) ? std::floor(std::log10(largest)) : 0;
    return int(std::clamp(magnitude + 5, 5.0, 16.0));
}

std::string number_cell(double x, int digits) {
    if (std::isnan(x)) return "NaN";
    if (std::isinf(x)) return x > 0 ? "Inf" : "-Inf";
    if (x == std::round(x) && std::abs(x) < 1e15) return print("%.0f", x == 0 ? 0 : x);
    return print("%." + std::to_string(digits) + "g", x);
}

Value num2str(const Call& call) {
    const Value& x = call[0];
    if (x.is_text()) return x;
    if (call.size() == 2 && call[1].is_text()) return Value(formatted(call.text(1), {x}, 0));
    double largest = 0;
    for (Index i = 0; i < x.numel(); ++i)
        if (std::isfinite(x[i])) largest = std::max(largest, std::abs(x[i]));
    const int digits =
        call.size() == 2 ? int(std::clamp<Index>(call.length(1), 1, 50)) : shown_digits(largest);
    std::vector<std::vector<std::string>> rows(x.rows());
    std::size_t width = 0;
    for (Index i = 0; i < x.rows(); ++i) {
        for (Index j = 0; j < x.cols(); ++j) {
            rows[i].push_back(number_cell(x[i + j * x.rows()], digits));
            width = std::max(width, rows[i].back().size());
        }
    }
    std::vector<std::string> lines;
    std::size_t indent = std::string::npos, length = 0;
    for (const auto& row : rows) {
        std::string line;
        for (const std::string& text : row) line += std::string(width + 2 - text.size(), ' ') + text;
        indent = std::min(indent, line.find_first_not_of(' '));
        length = std::max(length, line.size());
        lines.push_back(line);
    }
    std::vector<Value> values;
    for (const std::string& line : lines)
        values.emplace_back(std::string_view(line).substr(indent == std::string::npos ? 0 : indent));
    return values.empty() ? Value("") : concatenate_rows(values, call.budget());
}

Value int2str(const Call& call) {
    Value x = call[0];
    if (x.is_text()) return x;
    for (Index i = 0; i < x.numel(); ++i) x.mutable_data()[i] = std::round(x[i]);
    call.arguments[0] = std::move(x);
    return num2str(call);
}

/// "[1 2;3 4]" with 15 significant digits, or as many as the second argument says.
Value mat2str(const Call& call) {
    const Value& x = call[0];
    if (!x.is_numeric() && !x.is_logical()) return Value(x.to_text());
    const int digits = call.size() == 2 ? int(std::clamp<Index>(call.length(1), 1, 50)) : 15;
    std::string text;
    for (Index i = 0; i < x.rows(); ++i)
        for (Index j = 0; j < x.cols(); ++j) {
            if (i + j > 0) text += j > 0 ? " " : ";";
            const double element = x[i + j * x.rows()];
            text += x.is_logical() ? element != 0 ? "true" : "false" : number_cell(element, digits);
        }
    if (x.numel() == 0) text = "zeros(" + std::to_string(x.rows()) + "," + std::to_string(x.cols()) + ")";
    return Value(x.numel() > 1 ? "[" + text + "]" : text);
}

Value str2double(const Call& call) {
    const std::optional<double> x = plain_number(trim(call.text(0)));
    return x ? Value(*x) : Value(std::nan(""));
}

Value str2num(const Call& call) {
    if (const std::optional<double> x = plain_number(trim(call.text(0)))) return Value(*x);
    throw Error(
        "str2num computes no text here: write the expression itself, or str2double, which gives NaN for "
        "what is no number");
}

template <bool IgnoreCase, bool Prefix> Value compare(const Call& call) {
    const Value &a = call[0], &b = call[1];
    const double n = Prefix ? call.scalar(2) : 0;
    const auto same = [n](const Value& x, const Value& y) {
        if (!x.is_text() || !y.is_text()) return false;
        std::string p = x.text(), q = y.text();
        if (Prefix) {
            if (double(p.size()) < n || double(q.size()) < n) return false;
            const auto keep = std::size_t(std::max(0.0, n));
            p.resize(keep);
            q.resize(keep);
        }
        return IgnoreCase ? lower(p) == lower(q) : p == q;
    };
    if (!a.is_cell() && !b.is_cell()) return same(a, b);
    const Value& shape = a.is_cell() ? a : b;
    if (a.is_cell() && b.is_cell() && a.numel() != b.numel())
        throw Error("size mismatch: " + a.size_text() + " cell and " + b.size_text() + " cell");
    Value::Numbers result;
    for (Index i = 0; i < shape.numel(); ++i)
        result.push_back(same(a.is_cell() ? a.at(i) : a, b.is_cell() ? b.at(i) : b));
    return Value::array(Class::Logical, shape.rows(), shape.cols(), std::move(result));
}

/// Texts joined, trailing blanks of each removed; a cell argument gives a cell.
Value strcat_(const Call& call) {
    const auto cell =
        std::ranges::find_if(call.arguments, [](const Value& v) { return v.is_cell() && !v.is_scalar(); });
    const bool any_cell = std::ranges::any_of(call.arguments, [](const Value& v) { return v.is_cell(); });
    const Value shape = cell != call.arguments.end() ? *cell : Value::cell(1, 1);
    Value result = shape;
    for (Index i = 0; i < shape.numel(); ++i) {
        std::string joined;
        for (const Value& x : call.arguments) {
            if (x.is_cell()) {
                if (x.numel() != 1 && x.numel() != shape.numel())
                    throw Error("size mismatch: " + x.size_text() + " cell and " + shape.size_text() +
                                " cell");
                joined += x.at(x.numel() == 1 ? 0 : i).text();
            } else {
                std::string text = x.text();
                text.erase(text.find_last_not_of(" \t\r\n\v\f") + 1);
                joined += text;
            }
        }
        call.budget().spend(double(joined.size()));
        result.set_at(i, Value(std::string_view(joined)));
    }
    return any_cell ? result : result.numel() == 1 ? result.at(0) : Value("");
}

Value char_(const Call& call) {
    if (call.size() == 1 && call[0].is_array()) return call[0].as(Class::Char);
    std::vector<std::string> rows;
    for (const Value& x : call.arguments) {
        if (!x.is_cell())
            rows.push_back(x.as(Class::Char).text());
        else
            for (Index i = 0; i < x.numel(); ++i) rows.push_back(x.at(i).text());
    }
    std::size_t width = 0;
    for (const std::string& row : rows) width = std::max(width, row.size());
    call.budget().allocate(double(rows.size()), double(width));
    std::vector<Value> padded;
    for (const std::string& row : rows)
        padded.emplace_back(std::string_view(row + std::string(width - row.size(), ' ')));
    return padded.empty() ? Value("") : concatenate_rows(padded, call.budget());
}

std::string replaced(const std::string& text, const std::string& from, const std::string& to) {
    if (from.empty()) return text;
    std::string out;
    std::size_t at = 0;
    for (std::size_t hit; (hit = text.find(from, at)) != std::string::npos; at = hit + from.size())
        out += text.substr(at, hit - at) + to;
    return out + text.substr(at);
}

Value strrep(const Call& call) {
    const std::string from = call.text(1), to = call.text(2);
    if (!call[0].is_cell()) call.budget().allocate(double(call[0].numel()), double(to.size() + 1));
    return each_text(call[0], [&](const std::string& text) { return replaced(text, from, to); });
}

Value strsplit(const Call& call) {
    const std::string text = call.text(0), separator = call.size() == 2 ? call.text(1) : " ";
    if (separator.empty()) throw Error("strsplit needs a separator");
    Value::Cells parts;
    std::size_t at = 0;
    for (std::size_t hit; (hit = text.find(separator, at)) != std::string::npos; at = hit + separator.size())
        parts.emplace_back(std::string_view(text).substr(at, hit - at));
    parts.emplace_back(std::string_view(text).substr(at));
    const auto n = static_cast<Index>(parts.size());
    return Value::cell(1, n, std::move(parts));
}

Value strjoin(const Call& call) {
    const std::string separator = call.size() == 2 ? escaped(call.text(1)) : " ";
    std::string joined;
    for (Index i = 0; i < call[0].numel(); ++i) {
        joined += (i > 0 ? separator : "") + call[0].at(i).text();
        call.budget().allocate(1, double(joined.size()));
    }
    return Value(std::string_view(joined));
}

Value strfind(const Call& call) {
    const std::string text = call.text(0), wanted = call.text(1);
    Value::Numbers places;
    if (!wanted.empty())
        for (std::size_t at = text.find(wanted); at != std::string::npos; at = text.find(wanted, at + 1))
            places.push_back(double(at + 1));
    const auto n = static_cast<Index>(places.size());
    return n == 0 ? Value() : Value::array(Class::Double, 1, n, std::move(places));
}

Value bin2dec(const Call& call) {
    double x = 0;
    for (const char c : call.text(0)) {
        if (c != '0' && c != '1' && c != ' ')
            throw Error("bin2dec needs text of 0 and 1, got " + call[0].describe());
        if (c != ' ') x = 2 * x + (c - '0');
    }
    return x;
}

Value fullfile(const Call& call) {
    std::string path;
    for (const Value& part : call.arguments) {
        const std::string text = part.text();
        if (text.empty()) continue;
        if (!path.empty() && path.back() != '/') path += '/';
        path += !path.empty() && text[0] == '/' ? text.substr(1) : text;
    }
    return Value(std::string_view(path));
}

/// Its folder.
Value fileparts(const Call& call) {
    const std::string path = call.text(0);
    const std::size_t slash = path.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : slash == 0 ? "/" : path.substr(0, slash);
    return Value(std::string_view(folder));
}

Value lower_(const Call& call) { return each_text(call[0], lower); }
Value upper_(const Call& call) { return each_text(call[0], upper); }
Value strtrim(const Call& call) { return each_text(call[0], trim); }
Value sprintf_(const Call& call) { return Value(formatted(call.text(0), call.arguments, 1)); }

} // namespace

std::string formatted(const std::string& format, const std::vector<Value>& arguments, std::size_t first) {
    constexpr std::size_t longest = 1'000'000;
    const std::string text = escaped(format);
    const std::vector<Element> list = elements(arguments, first);
    const bool had_arguments = arguments.size() > first;
    std::string out;
    std::size_t next = 0;
    for (bool consumed = true; consumed;) {
        consumed = false;
        for (std::size_t i = 0; i < text.size(); ++i) {
            if (out.size() > longest)
                throw Error("the printed text exceeds " + std::to_string(longest) + " characters");
            if (text[i] != '%') {
                out += text[i];
                continue;
            }
            if (i + 1 < text.size() && text[i + 1] == '%') {
                out += '%';
                ++i;
                continue;
            }
            const std::size_t begin = ++i;
            while (i < text.size() &&
                   std::string_view("-+ #0123456789.").find(text[i]) != std::string_view::npos)
                ++i;
            const std::string flags = text.substr(begin, i - begin);
            if (i == text.size() ||
                std::string_view("diufFeEgGxXsc").find(text[i]) == std::string_view::npos ||
                flags.size() > 8 || std::ranges::count(flags, '.') > 1)
                throw Error("the format '" + format + "' has an unknown conversion");
            if (next >= list.size()) {
                if (had_arguments && next > 0) return out; // the elements are used up
                continue;
            }
            out += print_element(flags, text[i], list[next++]);
            consumed = true;
        }
        if (next >= list.size()) break;
    }
    return out;
}

void add_text(Builtins& t) {
    t["num2str"] = {1, 2, num2str};
    t["int2str"] = {1, 1, int2str};
    t["mat2str"] = {1, 2, mat2str};
    t["str2double"] = {1, 1, str2double};
    t["str2num"] = {1, 1, str2num};
    t["sprintf"] = {1, -1, sprintf_};
    t["strcmp"] = {2, 2, compare<false, false>};
    t["strcmpi"] = {2, 2, compare<true, false>};
    t["strncmp"] = {3, 3, compare<false, true>};
    t["strncmpi"] = {3, 3, compare<true, true>};
    t["strcat"] = {1, -1, strcat_};
    t["char"] = {1, -1, char_};
    t["string"] = {1, 1, num2str};
    t["lower"] = {1, 1, lower_};
    t["upper"] = {1, 1, upper_};
    t["strtrim"] = {1, 1, strtrim};
    t["strrep"] = {3, 3, strrep};
    t["strsplit"] = {1, 2, strsplit};
    t["strjoin"] = {1, 2, strjoin};
    t["strfind"] = {2, 2, strfind};
    t["bin2dec"] = {1, 1, bin2dec};
    t["fullfile"] = {1, -1, fullfile};
    t["fileparts"] = {1, 1, fileparts};
}

} // namespace bf::matlab
