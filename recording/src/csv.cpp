#include "bf/recording/export.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <span>

namespace bf::recording {
namespace {

std::string heading(const std::string& name, const std::string& unit) {
    return escape::csv(unit.empty() ? name : name + " (" + unit + ")");
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

void write_table(std::span<const Channel* const> channels, OutputFile& output) {
    constexpr std::size_t enough = 1 << 16;
    std::string line = "time (s)";
    for (const Channel* channel : channels)
        for (std::size_t i = 0; i < channel->info.elements(); ++i)
            line += ',' + heading(channel->element_name(i), channel->info.unit);
    const std::size_t samples = channels.empty() ? 0 : channels.front()->samples();
    for (std::size_t k = 0; k <= samples; ++k) {
        line += '\n';
        if (k == samples || line.size() > enough) {
            output.append(line);
            line.clear();
        }
        if (k == samples) break;
        append_number(line, channels.front()->time(k), ElementType::Double);
        for (const Channel* channel : channels)
            for (std::size_t i = 0; i < channel->info.elements(); ++i) {
                line += ',';
                append_number(line, channel->value(k, i), channel->info.type);
            }
    }
}

/// One for each channel. Names of signals may differ in no more than what a name of a file cannot hold.
std::vector<std::filesystem::path> file_names(const std::vector<Channel>& channels,
                                              const std::filesystem::path& path) {
    std::vector<std::filesystem::path> names;
    std::set<std::string> taken;
    for (const Channel& channel : channels) {
        const std::string plain = path.stem().string() + "_" + escape::file_name(channel.name);
        std::string name = plain;
        for (int i = 2; !taken.insert(name).second; ++i) name = plain + "_" + std::to_string(i);
        names.push_back(path.parent_path() / (name + path.extension().string()));
    }
    return names;
}

} // namespace

std::vector<std::filesystem::path> csv_files(const Recording& recording, const std::filesystem::path& path) {
    const auto& channels = recording.channels;
    const bool together = std::all_of(channels.begin(), channels.end(), [&](const Channel& channel) {
        return channel.time_ns == channels.front().time_ns;
    });
    return together ? std::vector{path} : file_names(channels, path);
}

std::vector<std::filesystem::path> write_csv(const Recording& recording, const std::filesystem::path& path) {
    std::vector<const Channel*> channels;
    for (const Channel& channel : recording.channels) channels.push_back(&channel);
    const auto files = csv_files(recording, path);
    const bool together = files.size() == 1;
    // All are written before the first is put in its place.
    std::vector<OutputFile> outputs(files.begin(), files.end());
    for (std::size_t i = 0; i < files.size(); ++i)
        write_table(together ? std::span<const Channel* const>(channels) : std::span(&channels[i], 1),
                    outputs[i]);
    for (auto& output : outputs) output.commit();
    return files;
}

} // namespace bf::recording
