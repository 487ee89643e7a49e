#include "bf/recording/writer.hpp"

#include "bf/base/elements.hpp"
#include "bf/base/numbers.hpp"
#include "bf/recording/message.hpp"
#include "file.hpp"
#include "ring.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <optional>
#include <pthread.h>
#include <set>
#include <thread>

namespace bf::recording {
namespace {

/// How often the background thread looks for records.
constexpr std::chrono::milliseconds poll_period{5};

constexpr std::size_t record_prefix_bytes = record_header_bytes + message_header_bytes + message_prefix_bytes;

/// What `append` needs about one channel.
struct Slot {
    std::size_t payload_bytes;
    std::uint32_t sequence = 0;
};

struct IndexEntry {
    std::uint64_t time;
    std::uint64_t offset;
};

struct Span {
    std::uint64_t first = ~std::uint64_t{0};
    std::uint64_t last = 0;
    void add(std::uint64_t time) noexcept {
        first = std::min(first, time);
        last = std::max(last, time);
    }
    std::uint64_t start() const noexcept { return std::min(first, last); } // 0 when empty
};

/// In blocks the compiler knows the size of: for a signal's size std::memcpy takes instructions for strings,
/// which need as long as the copy to begin.
void copy(std::byte* to, const std::byte* from, std::size_t size) noexcept {
    constexpr std::size_t block = 64;
    for (; size >= block; size -= block, to += block, from += block) std::memcpy(to, from, block);
    std::memcpy(to, from, size);
}

} // namespace

struct Writer::State {
    State(const std::filesystem::path& path, const WriterOptions& options)
        : options_(options), file(path), chunk_indices(path, File::Kind::nameless) {}

    const WriterOptions options_;

    // Set-up
    std::set<std::string, std::less<>> names;
    std::map<std::string, std::uint16_t> schema_ids;
    Builder schemas, channels; // records, written at the start and again in the summary

    // The thread that appends
    std::vector<Slot> slots;
    std::optional<Ring> ring;
    std::atomic<std::uint64_t> dropped{0};
    std::atomic<bool> is_clock_over{false};

    // The background thread
    std::thread thread;
    std::atomic<bool> stop{false};
    std::vector<std::vector<IndexEntry>> index; // of the current chunk, per channel
    Builder scratch;
    Builder chunk_index;
    std::vector<std::uint64_t> message_counts;
    Span times;
    std::uint32_t chunk_count = 0;

    // The file, shared by both under `mutex`; `append` does not touch it
    std::mutex mutex;
    File file;
    File chunk_indices; // of the summary; in memory they would grow with time
    Builder attachment_indices, metadata_indices;
    std::uint32_t attachment_count = 0, metadata_count = 0;
    bool begun = false, closed = false;

    bool failed() const noexcept { return file.failed() || is_clock_over; }
    std::string status();
    void add_channel(std::string_view name, const ChannelInfo& info);
    void write_start();
    void write_background() noexcept;
    void drain(bool everything);
    void write_chunk(Bytes records, const Span& span);
    void write_summary();
    void write_chunk_indices();
};

/// Only whole chunks count: what the loop has appended since is lost.
std::string Writer::State::status() {
    const std::lock_guard lock(mutex);
    std::string text = file.status();
    if (text.empty() && is_clock_over)
        text = "the recording '" + file.path() + "' ends, since its clock holds 292 years of nanoseconds";
    if (text.empty()) return text;
    return text + (chunk_count > 0 ? "; it holds the samples until t = " +
                                         number_text(static_cast<double>(times.last) / 1e9) + " s"
                                   : "; it holds no samples");
}

void Writer::State::add_channel(std::string_view name, const ChannelInfo& info) {
    const auto reject = [&](const std::string& why) {
        throw std::runtime_error("cannot record the signal '" + std::string(name) + "': " + why);
    };
    if (begun) reject("recording has begun; add all signals before begin()");
    if (name.empty()) reject("it has no name; give it its block path");
    if (info.elements() == 0) reject("it has no elements; leave it out");
    if (info.bytes() > std::size_t{1} << 28 || info.elements() > std::size_t{1} << 28)
        reject("one sample has " + std::to_string(info.elements()) +
               " elements; at most 256 MB can be recorded");
    if (!info.is_matrix && info.cols != 1)
        reject("it is 1-D but has " + std::to_string(info.cols) + " columns; set is_matrix");
    if (slots.size() > 0xFFFF) reject("a recording holds at most 65536 signals; record fewer");
    const auto claim = [&](std::string_view called) {
        std::string topic = topic_of(called);
        if (!names.insert(topic).second)
            reject("another signal has the topic '" + topic + "'; rename one of them");
        return topic;
    };
    const std::string topic = claim(name);
    std::string other_names;
    for (const auto& other : info.other_names) {
        claim(other);
        other_names += other + "\n";
    }

    const auto [schema, is_new] =
        schema_ids.try_emplace(message_type(info), static_cast<std::uint16_t>(schema_ids.size() + 1));
    if (is_new) {
        schemas.begin_record(Opcode::Schema);
        schemas.put(schema->second);
        schemas.put_text(schema->first);
        schemas.put_text("ros2msg");
        schemas.put_text(message_definition(info));
        schemas.end_record();
    }
    const auto id = static_cast<std::uint16_t>(slots.size());
    channels.begin_record(Opcode::Channel);
    channels.put(id);
    channels.put(schema->second);
    channels.put_text(topic);
    channels.put_text("cdr");
    std::string value_names;
    for (const auto& [value, text] : info.names) value_names += number_text(value) + " " + text + "\n";
    channels.put_map({{"name", std::string(name)},
                      {"type", name_of(info.type)},
                      {"rows", std::to_string(info.rows)},
                      {"cols", std::to_string(info.cols)},
                      {"matrix", info.is_matrix ? "true" : "false"},
                      {"unit", info.unit},
                      {"doc", info.doc},
                      {"period", number_text(info.period)},
                      {"held", info.is_held ? "true" : "false"},
                      {"names", value_names},
                      {"other names", other_names},
                      {"elements", element_lines(info.element_names)}});
    channels.end_record();
    slots.push_back({info.bytes()});
}

void Writer::State::write_start() {
    const std::lock_guard lock(mutex);
    begun = true;
    file.write(schemas.bytes());
    file.write(channels.bytes());
    index.resize(slots.size());
    message_counts.resize(slots.size());
}

// ---- the background thread ----

void Writer::State::write_background() noexcept {
    // Started by a real-time thread this one inherits its priority, which writing to a disk does not deserve;
    // and signals are for the threads of the application.
    const sched_param ordinary{};
    ::pthread_setschedparam(::pthread_self(), SCHED_OTHER, &ordinary);
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, nullptr);

    auto due = std::chrono::steady_clock::now() + options_.flush_period;
    bool last = false;
    while (!last) {
        ring->work.wait_until(std::chrono::steady_clock::now() + poll_period);
        last = stop.load(std::memory_order_acquire);
        const bool everything = last || std::chrono::steady_clock::now() >= due;
        if (everything) due = std::chrono::steady_clock::now() + options_.flush_period;
        drain(everything);
    }
}

void Writer::State::drain(bool everything) {
    std::uint64_t end = ring->head();
    const std::size_t enough = everything ? 1 : options_.chunk_bytes;
    while (end - ring->tail() >= enough) {
        Span span;
        Bytes run;
        try {
            run = ring->run(end, options_.chunk_bytes, [&](std::size_t offset, Bytes record) {
                std::uint16_t channel;
                std::uint64_t time;
                std::memcpy(&channel, &record[record_header_bytes], sizeof channel);
                std::memcpy(&time, &record[record_header_bytes + 6], sizeof time);
                index[channel].push_back({time, offset});
                span.add(time);
            });
            if (!run.empty()) write_chunk(run, span);
        } catch (const std::bad_alloc&) {
            file.fail(ENOMEM);
        }
        ring->release(run);
        if (!everything) end = ring->head();
    }
}

void Writer::State::write_chunk(Bytes records, const Span& span) {
    const std::uint32_t crc = crc32(records);
    const std::lock_guard lock(mutex);
    const std::uint64_t chunk_start = file.offset();
    scratch.clear();
    scratch.begin_record(Opcode::Chunk);
    scratch.put(span.first);
    scratch.put(span.last);
    scratch.put(std::uint64_t{records.size()});
    scratch.put(crc);
    scratch.put_text(""); // no compression
    scratch.put(std::uint64_t{records.size()});
    scratch.end_record(records.size());
    file.write(scratch.bytes(), records, crc);
    if (file.failed()) return;
    ++chunk_count;
    times.add(span.first);
    times.add(span.last);

    const std::uint64_t chunk_end = file.offset();
    chunk_index.clear();
    chunk_index.begin_record(Opcode::ChunkIndex);
    chunk_index.put(span.first);
    chunk_index.put(span.last);
    chunk_index.put(chunk_start);
    chunk_index.put(chunk_end - chunk_start);
    const std::size_t offsets = chunk_index.begin_array();
    scratch.clear();
    for (std::size_t channel = 0; channel < index.size(); ++channel) {
        if (index[channel].empty()) continue;
        message_counts[channel] += index[channel].size();
        chunk_index.put(static_cast<std::uint16_t>(channel));
        chunk_index.put(chunk_end + scratch.size());
        scratch.begin_record(Opcode::MessageIndex);
        scratch.put(static_cast<std::uint16_t>(channel));
        const std::size_t at = scratch.begin_array();
        scratch.put_bytes(std::as_bytes(std::span(index[channel])));
        scratch.end_array(at);
        scratch.end_record();
        index[channel].clear();
    }
    file.write(scratch.bytes());
    chunk_index.end_array(offsets);
    chunk_index.put(std::uint64_t{scratch.size()});
    chunk_index.put_text(""); // no compression
    chunk_index.put(std::uint64_t{records.size()});
    chunk_index.put(std::uint64_t{records.size()});
    chunk_index.end_record();
    chunk_indices.write(chunk_index.bytes());
    if (chunk_indices.failed()) file.fail(chunk_indices.error());
}

// ---- the end of the file ----

void Writer::State::write_summary() {
    scratch.clear();
    scratch.begin_record(Opcode::DataEnd);
    scratch.put(file.crc());
    scratch.end_record();
    file.write(scratch.bytes());

    const std::uint64_t summary_start = file.offset();
    file.reset_crc();
    Builder offsets;
    const auto group = [&](Opcode opcode, auto&& write) {
        const std::uint64_t start = file.offset();
        write();
        if (file.offset() == start) return;
        offsets.begin_record(Opcode::SummaryOffset);
        offsets.put(opcode);
        offsets.put(start);
        offsets.put(file.offset() - start);
        offsets.end_record();
    };
    group(Opcode::Schema, [&] { file.write(schemas.bytes()); });
    group(Opcode::Channel, [&] { file.write(channels.bytes()); });
    group(Opcode::Statistics, [&] {
        std::uint64_t messages = 0;
        for (const std::uint64_t count : message_counts) messages += count;
        scratch.clear();
        scratch.begin_record(Opcode::Statistics);
        scratch.put(messages);
        scratch.put(static_cast<std::uint16_t>(schema_ids.size()));
        scratch.put(static_cast<std::uint32_t>(slots.size()));
        scratch.put(attachment_count);
        scratch.put(metadata_count);
        scratch.put(chunk_count);
        scratch.put(times.start());
        scratch.put(times.last);
        const std::size_t at = scratch.begin_array();
        for (std::size_t channel = 0; channel < message_counts.size(); ++channel) {
            if (message_counts[channel] == 0) continue;
            scratch.put(static_cast<std::uint16_t>(channel));
            scratch.put(message_counts[channel]);
        }
        scratch.end_array(at);
        scratch.end_record();
        file.write(scratch.bytes());
    });
    group(Opcode::ChunkIndex, [&] { write_chunk_indices(); });
    group(Opcode::AttachmentIndex, [&] { file.write(attachment_indices.bytes()); });
    group(Opcode::MetadataIndex, [&] { file.write(metadata_indices.bytes()); });

    const std::uint64_t offsets_start = file.offset();
    file.write(offsets.bytes());
    scratch.clear();
    scratch.begin_record(Opcode::Footer);
    scratch.put(summary_start);
    scratch.put(offsets_start);
    scratch.end_record(sizeof(std::uint32_t));
    scratch.put(crc32(scratch.bytes(), file.crc()));
    scratch.put_bytes(bytes_of(magic));
    file.write(scratch.bytes());
}

void Writer::State::write_chunk_indices() {
    std::vector<std::byte> record;
    for (std::uint64_t at = 0; at < chunk_indices.offset(); at += record.size()) {
        record.resize(record_header_bytes);
        chunk_indices.read(at, record.data(), record.size());
        Cursor header(record);
        header.get<Opcode>();
        record.resize(record_header_bytes + header.get<std::uint64_t>());
        chunk_indices.read(at, record.data(), record.size());
        file.write(record);
    }
    if (chunk_indices.failed()) file.fail(chunk_indices.error());
}

// ---- the public functions ----

Writer::Writer(const std::filesystem::path& path, Metadata metadata, const WriterOptions& options)
    : state_(std::make_unique<State>(path, options)) {
    Builder start;
    start.put_bytes(bytes_of(magic));
    start.begin_record(Opcode::Header);
    start.put_text(""); // no profile
    start.put_text("BlockFactory");
    start.end_record();
    state_->file.write(start.bytes());
    add_metadata("recording", metadata);
}

Writer::~Writer() {
    if (!state_) return;
    try {
        close();
    } catch (const std::exception&) {
        // A destructor cannot report; call close() to learn of errors.
    }
}

Writer::Writer(Writer&&) noexcept = default;

Writer& Writer::operator=(Writer&& other) noexcept {
    std::swap(state_, other.state_);
    return *this;
}

ChannelId Writer::add_channel(std::string_view name, const ChannelInfo& info) {
    state_->add_channel(name, info);
    return ChannelId{static_cast<std::uint16_t>(state_->slots.size() - 1)};
}

void Writer::add_attachment(std::string_view name, std::string_view media_type, Bytes bytes) {
    Builder record;
    record.begin_record(Opcode::Attachment);
    record.put(std::uint64_t{0}); // log time and creation time: those of the recording
    record.put(std::uint64_t{0});
    record.put_text(name);
    record.put_text(media_type);
    record.put(std::uint64_t{bytes.size()});
    record.put_bytes(bytes);
    record.end_record(sizeof(std::uint32_t));
    record.put(crc32(record.bytes().subspan(record_header_bytes)));

    const std::lock_guard lock(state_->mutex);
    Builder& entry = state_->attachment_indices;
    entry.begin_record(Opcode::AttachmentIndex);
    entry.put(state_->file.offset());
    entry.put(std::uint64_t{record.size()});
    entry.put(std::uint64_t{0});
    entry.put(std::uint64_t{0});
    entry.put(std::uint64_t{bytes.size()});
    entry.put_text(name);
    entry.put_text(media_type);
    entry.end_record();
    ++state_->attachment_count;
    state_->file.write(record.bytes());
}

void Writer::add_attachment(std::string_view name, std::string_view media_type, std::string_view text) {
    add_attachment(name, media_type, bytes_of(text));
}

void Writer::add_metadata(std::string_view name, const Metadata& values) {
    Builder record;
    record.begin_record(Opcode::Metadata);
    record.put_text(name);
    record.put_map(values);
    record.end_record();

    const std::lock_guard lock(state_->mutex);
    Builder& entry = state_->metadata_indices;
    entry.begin_record(Opcode::MetadataIndex);
    entry.put(state_->file.offset());
    entry.put(std::uint64_t{record.size()});
    entry.put_text(name);
    entry.end_record();
    ++state_->metadata_count;
    state_->file.write(record.bytes());
}

void Writer::begin() {
    State& s = *state_;
    if (s.begun) throw std::runtime_error("the recording has begun already");
    s.write_start();
    std::size_t record = 0;
    for (const Slot& slot : s.slots) record = std::max(record, record_prefix_bytes + slot.payload_bytes);
    s.ring.emplace(std::max({s.options_.buffer_bytes, 4 * s.options_.chunk_bytes, 4 * record}));
    s.thread = std::thread([&s] { s.write_background(); });
}

void Writer::append(std::span<const Sample> samples, std::int64_t time_ns) noexcept {
    State& s = *state_;
    assert(s.ring && !s.closed);
    if (time_ns < 0) s.is_clock_over = true;
    if (s.failed()) return;
    std::array<std::byte, 2 * sizeof time_ns + message_prefix_bytes> instant;
    std::memcpy(&instant[0], &time_ns, sizeof time_ns);              // log time
    std::memcpy(&instant[sizeof time_ns], &time_ns, sizeof time_ns); // publish time
    write_message_prefix(&instant[2 * sizeof time_ns], static_cast<double>(time_ns) / 1e9);
    for (const Sample& sample : samples) {
        assert(static_cast<std::size_t>(sample.channel) < s.slots.size());
        Slot& slot = s.slots[static_cast<std::size_t>(sample.channel)];
        const std::uint32_t sequence = slot.sequence++;
        std::byte* record =
            s.ring->claim(record_prefix_bytes + slot.payload_bytes, !s.options_.drop_when_full);
        if (record == nullptr) {
            s.dropped.fetch_add(1, std::memory_order_relaxed);
            continue;
        }
        const auto put = [&record](const auto& value) {
            std::memcpy(record, &value, sizeof value);
            record += sizeof value;
        };
        put(Opcode::Message);
        put(std::uint64_t{message_header_bytes + message_prefix_bytes + slot.payload_bytes});
        put(sample.channel);
        put(sequence);
        put(instant);
        copy(record, static_cast<const std::byte*>(sample.data), slot.payload_bytes);
    }
    s.ring->publish();
}

bool Writer::failed() const noexcept { return state_->failed(); }
std::string Writer::status() const { return state_->status(); }
std::uint64_t Writer::dropped() const noexcept { return state_->dropped.load(std::memory_order_relaxed); }

void Writer::close() {
    State& s = *state_;
    if (s.closed) return;
    s.closed = true;
    if (s.thread.joinable()) {
        s.stop.store(true, std::memory_order_release);
        s.ring->work.raise();
        s.thread.join();
    } else if (!s.begun) {
        s.write_start();
    }
    if (!s.file.failed()) s.write_summary();
    s.file.close();
    if (s.failed()) throw std::runtime_error(s.status());
}

} // namespace bf::recording
