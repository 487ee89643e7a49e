#include "bf/recording/writer.hpp"

#include "bf/recording/message.hpp"
#include "file.hpp"
#include "ring.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <mutex>
#include <optional>
#include <pthread.h>
#include <set>
#include <thread>

namespace bf::recording {
namespace {

constexpr std::size_t record_prefix_bytes = record_header_bytes + message_header_bytes + message_prefix_bytes;

/// What `append` needs about one channel: the bytes in front of the payload, and the payload's size.
struct Slot {
    std::array<std::byte, record_prefix_bytes> prefix;
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

std::string shortest(double value) {
    std::array<char, 32> text;
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

Slot make_slot(std::uint16_t id, std::size_t payload_bytes) {
    Builder record;
    record.begin_record(Opcode::Message);
    record.put(id);
    record.put(std::uint32_t{0}); // sequence, log time, publish time: filled by append
    record.put(std::uint64_t{0});
    record.put(std::uint64_t{0});
    record.end_record(message_prefix_bytes + payload_bytes);
    Slot slot{{}, payload_bytes};
    std::copy(record.bytes().begin(), record.bytes().end(), slot.prefix.begin()); // the rest: append
    return slot;
}

} // namespace

struct Writer::State {
    State(std::filesystem::path path, const WriterOptions& options)
        : options_(options), file(std::move(path)) {}

    const WriterOptions options_;

    // Set-up
    std::set<std::string, std::less<>> names;
    std::map<std::string, std::uint16_t> schema_ids;
    Builder schemas, channels; // records, written at the start and again in the summary

    // The thread that appends
    std::vector<Slot> slots;
    std::optional<Ring> ring;
    std::atomic<std::uint64_t> dropped{0};

    // The background thread
    std::thread thread;
    std::atomic<bool> stop{false};
    std::vector<std::vector<IndexEntry>> index; // of the current chunk, per channel
    Builder scratch;
    std::vector<std::uint64_t> message_counts;
    Span times;
    std::uint32_t chunk_count = 0;

    // The file, shared by both under `mutex`; `append` does not touch it
    std::mutex mutex;
    File file;
    std::uint64_t first_chunk_offset = 0;
    Builder attachment_indices, metadata_indices;
    std::uint32_t attachment_count = 0, metadata_count = 0;
    bool begun = false, closed = false;

    void add_channel(std::string_view name, const ChannelInfo& info);
    void write_start();
    void write_background() noexcept;
    void drain(bool everything);
    void write_chunk(Bytes records, const Span& span);
    void write_summary();
    void write_chunk_indices(std::uint64_t end);
};

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
    const std::string topic = topic_of(name);
    if (!names.insert(topic).second)
        reject("another signal has the topic '" + topic + "'; rename one of them");

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
    for (const auto& [value, text] : info.names) value_names += shortest(value) + " " + text + "\n";
    channels.put_map({{"name", std::string(name)},
                      {"type", name_of(info.type)},
                      {"rows", std::to_string(info.rows)},
                      {"cols", std::to_string(info.cols)},
                      {"matrix", info.is_matrix ? "true" : "false"},
                      {"unit", info.unit},
                      {"doc", info.doc},
                      {"period", shortest(info.period)},
                      {"held", info.is_held ? "true" : "false"},
                      {"names", value_names}});
    channels.end_record();
    slots.push_back(make_slot(id, info.bytes()));
}

void Writer::State::write_start() {
    const std::lock_guard lock(mutex);
    begun = true;
    file.write(schemas.bytes());
    file.write(channels.bytes());
    first_chunk_offset = file.offset();
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
        // Nobody waits for a thread in real time to wake it: that would be a call into the system.
        if (options_.drop_when_full)
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        else
            ring->work.wait_until(due);
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
            run = ring->run(end, [&](std::size_t offset, Bytes record) {
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

    scratch.clear();
    for (std::size_t channel = 0; channel < index.size(); ++channel) {
        if (index[channel].empty()) continue;
        message_counts[channel] += index[channel].size();
        scratch.begin_record(Opcode::MessageIndex);
        scratch.put(static_cast<std::uint16_t>(channel));
        const std::size_t at = scratch.begin_array();
        scratch.put_bytes(std::as_bytes(std::span(index[channel])));
        scratch.end_array(at);
        scratch.end_record();
        index[channel].clear();
    }
    file.write(scratch.bytes());
}

// ---- the end of the file ----

void Writer::State::write_summary() {
    scratch.clear();
    scratch.begin_record(Opcode::DataEnd);
    scratch.put(file.crc());
    scratch.end_record();
    const std::uint64_t data_end = file.offset();
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
    group(Opcode::ChunkIndex, [&] { write_chunk_indices(data_end); });
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

/// Reads the headers of the chunks back, since keeping them would let memory grow with time.
void Writer::State::write_chunk_indices(std::uint64_t end) {
    struct Header {
        Opcode opcode;
        std::uint64_t length;
    };
    // Indices of messages follow one another in small records: many come with one reading.
    std::vector<std::byte> window(std::size_t{1} << 16);
    std::uint64_t begin = end;
    const auto bytes_at = [&](std::uint64_t offset, std::size_t count) {
        if (offset < begin || offset + count > begin + window.size()) {
            begin = offset;
            const auto left = std::min<std::uint64_t>(window.size(), file.offset() - offset);
            file.read(begin, window.data(), static_cast<std::size_t>(left));
        }
        return Bytes(window).subspan(static_cast<std::size_t>(offset - begin), count);
    };
    const auto header_at = [&](std::uint64_t offset) {
        Cursor cursor(bytes_at(offset, record_header_bytes));
        return Header{cursor.get<Opcode>(), cursor.get<std::uint64_t>()};
    };
    std::uint64_t offset = first_chunk_offset;
    while (offset < end && !file.failed()) {
        const Header chunk = header_at(offset);
        const std::uint64_t chunk_start = offset;
        offset += record_header_bytes + chunk.length;
        if (chunk.opcode != Opcode::Chunk) continue;

        std::array<std::byte, 24> fields; // start time, end time, size
        std::ranges::copy(bytes_at(chunk_start + record_header_bytes, fields.size()), fields.begin());
        scratch.clear();
        scratch.begin_record(Opcode::ChunkIndex);
        scratch.put_bytes(Bytes(fields).first(16));
        scratch.put(chunk_start);
        scratch.put(offset - chunk_start);
        const std::uint64_t indices_start = offset;
        const std::size_t at = scratch.begin_array();
        for (Header next; offset < end && !file.failed(); offset += record_header_bytes + next.length) {
            next = header_at(offset);
            if (next.opcode != Opcode::MessageIndex) break;
            scratch.put_bytes(bytes_at(offset + record_header_bytes, sizeof(std::uint16_t)));
            scratch.put(offset);
        }
        scratch.end_array(at);
        scratch.put(offset - indices_start);
        scratch.put_text(""); // no compression
        scratch.put_bytes(Bytes(fields).last(8));
        scratch.put_bytes(Bytes(fields).last(8));
        scratch.end_record();
        file.write(scratch.bytes());
    }
}

// ---- the public functions ----

Writer::Writer(std::filesystem::path path, Metadata metadata, const WriterOptions& options)
    : state_(std::make_unique<State>(std::move(path), options)) {
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
    s.ring.emplace(std::max({s.options_.buffer_bytes, 4 * s.options_.chunk_bytes, 4 * record}),
                   s.options_.chunk_bytes);
    s.thread = std::thread([&s] { s.write_background(); });
}

void Writer::append(std::span<const Sample> samples, std::int64_t time_ns) noexcept {
    State& s = *state_;
    assert(s.ring && !s.closed);
    if (s.file.failed()) return;
    const double time = static_cast<double>(time_ns) / 1e9;
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
        std::memcpy(record, slot.prefix.data(), record_prefix_bytes);
        std::memcpy(record + record_header_bytes + 2, &sequence, 4);
        std::memcpy(record + record_header_bytes + 6, &time_ns, 8);
        std::memcpy(record + record_header_bytes + 14, &time_ns, 8);
        write_message_prefix(record + record_prefix_bytes - message_prefix_bytes, time);
        std::memcpy(record + record_prefix_bytes, sample.data, slot.payload_bytes);
    }
    s.ring->publish();
}

bool Writer::failed() const noexcept { return state_->file.failed(); }
std::string Writer::status() const { return state_->file.status(); }
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
    if (s.file.failed()) throw std::runtime_error(s.file.status());
}

} // namespace bf::recording
