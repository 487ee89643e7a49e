#include "bf/recording/export.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <stdexcept>

namespace bf::recording {
namespace {

/// RFC 4180: a field with a separator, a quote or a line break stands in quotes.
std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
    return out + '"';
}

std::string heading(const std::string& name, const std::string& unit) {
    return quoted(unit.empty() ? name : name + " (" + unit + ")");
}

/// The shortest text that reads back as the same number (at most 17 digits).
void append_number(std::string& line, double value, ElementType type) {
    char text[32];
    const auto result = std::isnan(value) ? std::to_chars(text, std::end(text), std::abs(value))
                        : type == ElementType::Single
                            ? std::to_chars(text, std::end(text), static_cast<float>(value))
                            : std::to_chars(text, std::end(text), value);
    line.append(text, result.ptr);
}

void write_table(std::span<const Channel* const> channels, const std::filesystem::path& path) {
    std::ofstream file(path, std::ios::binary);
    std::string line = "time (s)";
    for (const Channel* channel : channels)
        for (std::size_t i = 0; i < channel->info.elements(); ++i)
            line += ',' + heading(channel->element_name(i), channel->info.unit);
    const std::size_t samples = channels.empty() ? 0 : channels.front()->samples();
    for (std::size_t k = 0; k <= samples && file; ++k) {
        line += '\n';
        file.write(line.data(), static_cast<std::streamsize>(line.size()));
        if (k == samples) break;
        line.clear();
        append_number(line, channels.front()->time(k), ElementType::Double);
        for (const Channel* channel : channels)
            for (std::size_t i = 0; i < channel->info.elements(); ++i) {
                line += ',';
                append_number(line, channel->value(k, i), channel->info.type);
            }
    }
    file.close();
    if (!file) throw std::runtime_error("cannot write '" + path.string() + "': " + std::strerror(errno));
}

} // namespace

std::vector<std::filesystem::path> write_csv(const Recording& recording, const std::filesystem::path& path) {
    std::vector<const Channel*> channels;
    for (const Channel& channel : recording.channels) channels.push_back(&channel);
    const bool together = std::all_of(channels.begin(), channels.end(), [&](const Channel* channel) {
        return channel->time_ns == channels.front()->time_ns;
    });
    if (together) {
        write_table(channels, path);
        return {path};
    }
    std::vector<std::filesystem::path> paths;
    for (const Channel*& channel : channels) {
        std::string name = channel->name;
        std::replace(name.begin(), name.end(), '/', '_');
        paths.push_back(path.parent_path() / (path.stem().string() + "_" + name + path.extension().string()));
        write_table({&channel, 1}, paths.back());
    }
    return paths;
}

} // namespace bf::recording
