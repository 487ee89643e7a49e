#include "bf/recording/reader.hpp"

#include "bf/base/elements.hpp"
#include "bf/base/numbers.hpp"
#include "bf/base/open_file.hpp"
#include "bf/recording/bag.hpp"
#include "bf/recording/message.hpp"
#include "compression.hpp"
#include "foreign.hpp"
#include "format.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <istream>
#include <optional>
#include <set>
#include <sstream>
#include <unordered_map>

namespace bf::recording {
namespace {

template <class T> std::optional<T> number(const std::map<std::string, std::string>& map, const char* key) {
    const auto found = map.find(key);
    if (found == map.end()) return std::nullopt;
    return number_of<T>(found->second);
}

std::string text_of(const std::map<std::string, std::string>& map, const char* key) {
    const auto found = map.find(key);
    return found == map.end() ? std::string() : found->second;
}

std::optional<ElementType> type_of(std::string_view name) {
    for (int i = 0; i <= static_cast<int>(ElementType::Boolean); ++i)
        if (name == name_of(static_cast<ElementType>(i))) return static_cast<ElementType>(i);
    return std::nullopt;
}

std::string size_text(std::uint64_t bytes) {
    return bytes < 1 << 20 ? std::to_string(bytes) + " bytes" : std::to_string(bytes >> 20) + " MiB";
}

class Parser {
  public:
    Parser(std::istream& stream, std::string_view name, const LoadOptions& options)
        : stream_(stream), name_(name), options_(options) {
        stream_.seekg(0, std::ios::end);
        const auto size = stream_.tellg();
        stream_.seekg(0);
        if (!stream_ || size < 0) throw std::runtime_error("cannot read '" + name_ + "'");
        left_ = static_cast<std::uint64_t>(size);
        most_kept_ = std::max(left_, options_.most_bytes);
    }

    Recording parse() {
        if (is_bag()) {
            parse_bag();
            return finished();
        }
        if (!read(std::min<std::uint64_t>(left_, magic.size())) || !is_magic())
            throw std::runtime_error(
                "'" + name_ +
                "' is no recording: it does not start with the MCAP signature or that of a bag");
        bool ended = false;
        while (!ended) {
            if (!read(record_header_bytes)) {
                report("the file ends without a footer: the recording was cut");
                break;
            }
            Cursor header(buffer_);
            const auto opcode = header.get<Opcode>();
            const auto length = header.get<std::uint64_t>();
            const std::uint32_t crc_before = previous_crc_;
            const bool cut = !read(length);
            try {
                if (!cut)
                    ended = record(opcode, buffer_, crc_before);
                else if (opcode == Opcode::Chunk && left_ > chunk_header_bytes && read(left_))
                    cut_chunk(Cursor(buffer_));
            } catch (const Malformed& error) {
                report(error.what());
            }
            if (cut) {
                report("the file ends within a record: the recording was cut");
                break;
            }
        }
        if (ended && (!read(left_) || !is_magic())) report("the file does not end with the MCAP signature");
        if (ended && defects_.empty() && message_count_ != counted_)
            report("the file does not hold as many messages as it counts");
        return finished();
    }

  private:
    Recording finished() {
        begin_at_zero();
        give_every_name_its_channel();
        recording_.complete = defects_.empty();
        for (const std::string& defect : defects_)
            recording_.defect += (recording_.defect.empty() ? "'" + name_ + "': " : "; ") + defect;
        if (has_more_defects_) recording_.defect += "; and more";
        recording_.unchecked = lacks_checksum_ && has_ours_;
        return std::move(recording_);
    }

    struct Schema {
        std::string name, encoding, text;
    };
    struct Foreign {
        std::string name;
        std::unique_ptr<Decoder> decoder;            // null: nobody understands it
        std::map<std::string, std::size_t> channels; // of the recording, by paths in messages
    };

    /// Of any version, which read_bag looks at.
    bool is_bag() {
        std::string first(std::min<std::uint64_t>(left_, bag_magic.find("2.0")), '\0');
        stream_.read(first.data(), static_cast<std::streamsize>(first.size()));
        stream_.seekg(0);
        return !first.empty() && first == bag_magic.substr(0, bag_magic.find("2.0"));
    }
    void parse_bag() {
        std::map<std::pair<std::string, std::string>, Foreign> topics; // several may write to one
        std::map<std::uint32_t, Foreign*> writers;
        const BagVisit visit{
            .connection =
                [&](std::uint32_t number, const BagConnection& its) {
                    const auto [known, is_new] = topics.try_emplace({its.topic, its.md5});
                    if (is_new)
                        known->second = foreign_of(its.topic, "ros1", "ros1msg", its.type, its.definition);
                    writers[number] = &known->second;
                },
            .message = [&](std::uint32_t number, std::int64_t time,
                           Bytes bytes) { foreign_message(*writers.at(number), time, bytes); },
            .defect = [&](std::string defect) { report(std::move(defect)); }};
        read_bag(stream_, name_, visit, options_);
    }

    bool read(std::uint64_t count) {
        require_wanted();
        if (count > left_) return false;
        buffer_.resize(count);
        stream_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(count));
        if (static_cast<std::uint64_t>(stream_.gcount()) != count) return false;
        left_ -= count;
        previous_crc_ = crc_;
        crc_ = crc32(buffer_, crc_);
        return true;
    }

    void require_wanted() const {
        if (options_.given_up && *options_.given_up)
            throw std::runtime_error("nobody waits for '" + name_ + "' any more");
    }

    bool is_magic() const {
        return buffer_.size() == magic.size() && std::memcmp(buffer_.data(), magic.data(), magic.size()) == 0;
    }

    void report(std::string defect) {
        constexpr std::size_t most = 10;
        if (std::ranges::find(defects_, defect) != defects_.end()) return;
        has_more_defects_ = defects_.size() == most;
        if (!has_more_defects_) defects_.push_back(std::move(defect));
    }

    /// A CRC of 0 in the file says that there is none, as the format allows.
    bool is_wrong(std::uint32_t stored, std::uint32_t computed) {
        lacks_checksum_ = lacks_checksum_ || (stored == 0 && computed != 0);
        return stored != 0 && stored != computed;
    }
    void check(std::uint32_t stored, std::uint32_t computed, const char* what) {
        const bool is_known = !defects_.empty(); // what of it is wrong
        if (is_wrong(stored, computed) && !is_known)
            report(std::string("the checksum of ") + what + " is wrong");
    }

    /// True for the record that ends the file. `crc_before`: of all bytes in front of the record.
    bool record(Opcode opcode, Bytes content, std::uint32_t crc_before) {
        Cursor cursor(content);
        switch (opcode) {
        case Opcode::Schema:
            if (!in_summary_) schema(cursor);
            break;
        case Opcode::Channel:
            if (!in_summary_) channel(cursor);
            break;
        case Opcode::Message:
            if (!in_summary_) message(cursor);
            break;
        case Opcode::Chunk: chunk(cursor); break;
        case Opcode::Attachment: attachment(content); break;
        case Opcode::Metadata: {
            std::string name = cursor.text();
            recording_.metadata[std::move(name)] = cursor.map();
            break;
        }
        case Opcode::DataEnd:
            check(cursor.get<std::uint32_t>(), crc_before, "the data section");
            in_summary_ = true;
            crc_ = 0;
            break;
        case Opcode::Statistics: message_count_ = cursor.get<std::uint64_t>(); break;
        case Opcode::Footer: {
            const Bytes offsets = cursor.take(16);
            check(cursor.get<std::uint32_t>(), crc32(offsets, previous_crc_), "the summary");
            return true;
        }
        default: break; // indices repeat what is known
        }
        return false;
    }

    void give_every_name_its_channel() {
        std::vector<Channel> channels;
        for (Channel& channel : recording_.channels) {
            const auto names = std::exchange(channel.info.other_names, {});
            channels.push_back(std::move(channel));
            for (std::size_t original = channels.size() - 1; const std::string& name : names) {
                if (!may_keep(channels[original].data.size())) break;
                channels.push_back(channels[original]);
                channels.back().name = name;
                channels.back().topic = topic_of(name);
            }
        }
        recording_.channels = std::move(channels);
    }

    static std::vector<std::string> lines_of(const std::string& text) {
        std::vector<std::string> lines;
        std::istringstream stream(text);
        for (std::string line; std::getline(stream, line);)
            if (!line.empty()) lines.push_back(line);
        return lines;
    }

    /// Lines "0 idle".
    static std::vector<std::pair<double, std::string>> names_of(const std::string& text) {
        std::vector<std::pair<double, std::string>> names;
        std::istringstream lines(text);
        for (double value = 0; lines >> value;) {
            std::string name;
            std::getline(lines >> std::ws, name);
            names.emplace_back(value, name);
        }
        return names;
    }

    void schema(Cursor cursor) {
        const auto id = cursor.get<std::uint16_t>();
        Schema schema{cursor.text(), cursor.text(), cursor.text()};
        schemas_.try_emplace(id, std::move(schema));
    }

    /// What another program has written. Each number of its messages becomes a channel, once it is seen.
    void foreign_channel(std::uint16_t id, const std::string& topic, std::uint16_t schema_id,
                         const std::string& encoding) {
        if (foreign_.contains(id)) return;
        const Schema& schema = schemas_[schema_id];
        foreign_[id] = foreign_of(topic, encoding, schema.encoding, schema.name, schema.text);
    }
    Foreign foreign_of(const std::string& topic, const std::string& encoding,
                       const std::string& schema_encoding, const std::string& schema_name,
                       const std::string& schema) {
        Foreign foreign{signal_of(topic), nullptr, {}};
        try {
            foreign.decoder = make_decoder(encoding, schema_encoding, schema_name, schema);
        } catch (const Malformed& error) {
            report("the channel '" + topic + "' is left out: " + error.what());
        }
        return foreign;
    }

    void foreign_message(Foreign& foreign, std::int64_t time, Bytes content) {
        try {
            decode(foreign, time, content);
        } catch (const Malformed& error) {
            report("a message of '" + foreign.name + "' is left out: it " + error.what());
        }
    }
    void decode(Foreign& foreign, std::int64_t time, Bytes content) {
        if (!foreign.decoder) return;
        constexpr std::size_t most_bytes = 8 << 20; // a picture; what is longer has no signals
        if (content.size() > most_bytes) throw Malformed("has more than 8 MiB");
        constexpr std::size_t most_channels = 1000; // of one topic
        foreign.decoder->decode(content, [&](const std::string& path, std::span<const double> values) {
            if (foreign.channels.size() >= most_channels && !foreign.channels.contains(path))
                return report("'" + foreign.name + "' has more than " + std::to_string(most_channels) +
                              " signals; the others are left out");
            const auto [known, is_new] = foreign.channels.try_emplace(path, recording_.channels.size());
            if (is_new) {
                Channel channel;
                channel.name = foreign.name + (path.empty() ? "" : "." + path);
                channel.topic = topic_of(channel.name);
                channel.info.rows = static_cast<std::uint32_t>(values.size());
                recording_.channels.push_back(std::move(channel));
                foreign_channels_.insert(known->second);
            }
            Channel& channel = recording_.channels[known->second];
            if (values.size() != channel.info.elements())
                return report("'" + channel.name +
                              "' changes its size; what has another one than at first is left out");
            if (!channel.time_ns.empty() && time < channel.time_ns.back())
                return report("the time stamps of '" + channel.name + "' go back; what follows is left out");
            keep(channel, time, std::as_bytes(values));
        });
    }

    void keep(Channel& channel, std::int64_t time, Bytes sample) {
        if (!may_keep(sizeof time + sample.size())) return;
        channel.time_ns.push_back(time);
        channel.data.insert(channel.data.end(), sample.begin(), sample.end());
    }
    bool may_keep(std::uint64_t bytes) {
        if (bytes <= most_kept_ - kept_) {
            kept_ += bytes;
            return true;
        }
        report("it has more than " + size_text(most_kept_) + " of samples; what follows is left out");
        return false;
    }

    /// Other programs count nanoseconds since 1970: their recordings begin at 0, too.
    void begin_at_zero() {
        std::optional<std::int64_t> first;
        for (const std::size_t i : foreign_channels_)
            if (const auto& times = recording_.channels[i].time_ns; !times.empty())
                first = std::min(first.value_or(times.front()), times.front());
        for (const std::size_t i : foreign_channels_)
            for (std::int64_t& time : recording_.channels[i].time_ns) time -= *first;
    }

    void channel(Cursor cursor) {
        const auto id = cursor.get<std::uint16_t>();
        const auto schema_id = cursor.get<std::uint16_t>(); // of ours it follows from type and shape
        Channel channel;
        channel.topic = cursor.text();
        const std::string encoding = cursor.text();
        const auto metadata = cursor.map();
        channel.name = text_of(metadata, "name");
        const auto is_ours = [&](const char* key) { return metadata.contains(key); };
        if (std::ranges::none_of(std::array{"name", "type", "rows", "cols"}, is_ours))
            return foreign_channel(id, channel.topic, schema_id, encoding);
        has_ours_ = true;
        const auto type = type_of(text_of(metadata, "type"));
        const auto rows = number<std::uint32_t>(metadata, "rows");
        const auto cols = number<std::uint32_t>(metadata, "cols");
        if (encoding != "cdr" || channel.name.empty() || !type || !rows || !cols || *rows == 0 ||
            *cols == 0 || std::uint64_t{*rows} * *cols > std::uint64_t{1} << 28)
            return report("the channel '" + channel.topic +
                          "' was not written by BlockFactory and is left out");
        channel.info = {*type,
                        *rows,
                        *cols,
                        text_of(metadata, "matrix") == "true",
                        text_of(metadata, "unit"),
                        text_of(metadata, "doc"),
                        number<double>(metadata, "period").value_or(0),
                        text_of(metadata, "held") == "true",
                        names_of(text_of(metadata, "names")),
                        lines_of(text_of(metadata, "other names")),
                        names_of_lines(text_of(metadata, "elements"), std::size_t{*rows} * *cols)};
        if (positions_.try_emplace(id, recording_.channels.size()).second)
            recording_.channels.push_back(std::move(channel));
    }

    void chunk(Cursor cursor) {
        cursor.take(16); // start and end time
        const auto size = cursor.get<std::uint64_t>();
        const auto crc = cursor.get<std::uint32_t>();
        const std::string compression = cursor.text();
        Bytes records = cursor.take(cursor.get<std::uint64_t>());
        std::vector<std::byte> whole;
        if (!compression.empty()) {
            if (size > options_.most_bytes - unpacked_)
                throw Malformed("its chunks have more than " + size_text(options_.most_bytes) +
                                " when they are decompressed; what follows is left out");
            unpacked_ += size;
            records = whole = decompressed(compression, records, size);
        }
        if (is_wrong(crc, crc32(records)))
            return report("the checksum of a chunk is wrong; its messages are left out");
        if (!messages(records)) report("a chunk ends within a message");
    }

    /// The whole messages of a chunk that is cut, unchecked; of one that is compressed there are none.
    void cut_chunk(Cursor cursor) {
        cursor.take(28); // times, size and checksum
        if (!cursor.text().empty()) return;
        cursor.get<std::uint64_t>();
        messages(cursor.rest());
    }

    /// False when the last record is not whole.
    bool messages(Bytes records) {
        Cursor cursor(records);
        while (cursor.rest().size() >= record_header_bytes) {
            const auto opcode = cursor.get<Opcode>();
            const auto length = cursor.get<std::uint64_t>();
            if (length > cursor.rest().size()) return false;
            const Bytes content = cursor.take(length);
            if (opcode == Opcode::Message) message(Cursor(content));
            if (opcode == Opcode::Schema) schema(Cursor(content));
            if (opcode == Opcode::Channel) channel(Cursor(content));
        }
        return cursor.rest().empty();
    }

    void message(Cursor cursor) {
        require_wanted();
        const auto id = cursor.get<std::uint16_t>();
        cursor.get<std::uint32_t>(); // sequence
        const auto time = cursor.get<std::int64_t>();
        cursor.get<std::uint64_t>(); // publish time: of ours the same
        ++counted_;
        if (const auto other = foreign_.find(id); other != foreign_.end())
            return foreign_message(other->second, time, cursor.rest());
        cursor.take(message_prefix_bytes);
        const auto position = positions_.find(id);
        if (position == positions_.end()) return report("a message belongs to no channel");
        Channel& channel = recording_.channels[position->second];
        const Bytes payload = cursor.rest();
        if (payload.size() != channel.info.bytes())
            return report("a message of '" + channel.name + "' has the wrong size");
        if (time < (channel.time_ns.empty() ? 0 : channel.time_ns.back()))
            return report("the time stamps of '" + channel.name + "' go back; what follows is left out");
        keep(channel, time, payload);
    }

    void attachment(Bytes content) {
        Cursor cursor(content);
        cursor.take(16); // log time and creation time
        Attachment attachment{cursor.text(), cursor.text(), {}};
        const Bytes data = cursor.take(cursor.get<std::uint64_t>());
        const Bytes checked = content.first(content.size() - cursor.rest().size());
        if (is_wrong(cursor.get<std::uint32_t>(), crc32(checked)))
            return report("the checksum of the attachment '" + attachment.name +
                          "' is wrong; it is left out");
        attachment.data.assign(data.begin(), data.end());
        recording_.attachments.push_back(std::move(attachment));
    }

    std::istream& stream_;
    const std::string name_;
    const LoadOptions options_;
    std::uint64_t left_ = 0; // bytes of the file not read yet
    std::vector<std::byte> buffer_;
    std::uint32_t crc_ = 0, previous_crc_ = 0; // of all bytes read, with and without the last
    bool in_summary_ = false;
    std::uint64_t message_count_ = 0, counted_ = 0; // by the statistics, by us
    std::uint64_t unpacked_ = 0;                    // bytes of chunks that were compressed
    std::uint64_t kept_ = 0, most_kept_ = 0;        // bytes of samples
    std::unordered_map<std::uint16_t, std::size_t> positions_;
    std::map<std::uint16_t, Schema> schemas_;
    std::map<std::uint16_t, Foreign> foreign_;
    std::set<std::size_t> foreign_channels_; // among the channels of the recording
    std::vector<std::string> defects_;
    bool has_more_defects_ = false;
    bool lacks_checksum_ = false, has_ours_ = false; // a channel as our writer declares it
    Recording recording_;
};

} // namespace

std::vector<double> Channel::times() const {
    std::vector<double> times(samples());
    for (std::size_t k = 0; k < times.size(); ++k) times[k] = time(k);
    return times;
}

std::size_t Channel::sample_at(double time) const noexcept {
    const auto ns = static_cast<std::int64_t>(time * 1e9 + 0.5);
    const auto after = std::upper_bound(time_ns.begin(), time_ns.end(), ns);
    return after == time_ns.begin() ? 0 : static_cast<std::size_t>(after - time_ns.begin()) - 1;
}

std::span<const std::byte> Channel::sample(std::size_t k) const noexcept {
    return std::span(data).subspan(k * info.bytes(), info.bytes());
}

double Channel::value(std::size_t k, std::size_t element) const noexcept {
    return element_at(info.type, sample(k).data(), element);
}

std::vector<double> Channel::values(std::size_t element) const {
    std::vector<double> values(samples());
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = value(k, element);
    return values;
}

std::string Channel::element_name(std::size_t element) const { return name + info.element_text(element); }

const Channel& Recording::channel(std::string_view name) const {
    const std::string prefix = std::string(name) + ".";
    const Channel* found = nullptr;
    std::string known, inside;
    for (const Channel& channel : channels) {
        if (channel.name == name) return channel;
        known += (known.empty() ? "" : ", ") + channel.name;
        if (!channel.name.starts_with(prefix) || channel.name.find('.', prefix.size()) != std::string::npos)
            continue;
        found = inside.empty() ? &channel : nullptr;
        inside += (inside.empty() ? "" : ", ") + channel.name;
    }
    if (found) return *found;
    throw std::runtime_error(inside.empty()
                                 ? "the recording has no signal '" + std::string(name) + "'; it has: " + known
                                 : "the recording has several signals of '" + std::string(name) +
                                       "': " + inside + "; name one");
}

Recording::Found Recording::find(std::string_view name) const {
    const auto [signal, which] = split_element(name);
    const bool is_whole = std::any_of(channels.begin(), channels.end(),
                                      [&](const Channel& channel) { return channel.name == name; });
    if (is_whole || which.empty()) return {channel(name), std::nullopt};
    const Channel& of = channel(signal);
    if (const auto element = of.info.find_element(which)) return {of, element};
    std::string known;
    for (std::size_t i = 0; i < of.info.elements() && known.size() < 1000; ++i)
        known += (i ? ", " : "") + of.info.element_text(i);
    throw std::runtime_error(of.info.elements() == 1
                                 ? "the signal '" + of.name + "' has a single element, not " +
                                       std::string(which)
                                 : "the signal '" + of.name + "' has no element " + std::string(which) +
                                       "; they are counted from 1: " + known);
}

Recording load(const std::filesystem::path& path, const LoadOptions& options) {
    std::string wrong = why_unreadable(path.string());
    std::ifstream stream;
    if (wrong.empty()) stream.open(path, std::ios::binary);
    if (wrong.empty() && !stream) wrong = file_error(errno);
    if (!wrong.empty())
        throw std::runtime_error("cannot open the recording '" + path.string() + "': " + wrong);
    return load(stream, path.string(), options);
}

Recording load(std::istream& stream, std::string_view name, const LoadOptions& options) {
    return Parser(stream, name, options).parse();
}

} // namespace bf::recording
