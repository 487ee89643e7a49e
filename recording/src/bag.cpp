#include "bf/recording/bag.hpp"

#include "compression.hpp"
#include "format.hpp"

#include <istream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

namespace bf::recording {
namespace {

enum class Op : std::uint8_t {
    message = 2,
    header = 3,
    index = 4,
    chunk = 5,
    chunk_info = 6,
    connection = 7,
};

/// The fields of a record's header, each "name=value" behind its length.
class Fields {
  public:
    explicit Fields(Bytes bytes) {
        for (Cursor cursor(bytes); !cursor.rest().empty();) {
            const std::string field = cursor.text();
            const auto equals = field.find('=');
            if (equals == 0 || equals == field.npos)
                throw Malformed("a record has a field without a name or a value");
            fields_[field.substr(0, equals)] = field.substr(equals + 1);
        }
    }
    std::string text(const char* name) const {
        const auto found = fields_.find(name);
        return found == fields_.end() ? std::string() : found->second;
    }
    template <class T> T get(const char* name) const {
        const auto found = fields_.find(name);
        if (found == fields_.end() || found->second.size() != sizeof(T))
            throw Malformed(std::string("a record has no field '") + name + "' of " +
                            std::to_string(sizeof(T)) + " bytes");
        T value;
        std::memcpy(&value, found->second.data(), sizeof value);
        return value;
    }

  private:
    std::map<std::string, std::string> fields_;
};

class BagParser {
  public:
    BagParser(std::istream& stream, std::string_view name, const BagVisit& visit, const LoadOptions& options)
        : stream_(stream), name_(name), visit_(visit), options_(options) {
        stream_.seekg(0, std::ios::end);
        const auto size = stream_.tellg();
        stream_.seekg(0);
        if (!stream_ || size < 0) throw std::runtime_error("cannot read '" + name_ + "'");
        size_ = left_ = static_cast<std::uint64_t>(size);
    }

    void parse() {
        constexpr std::string_view any = "#ROSBAG V";
        std::vector<std::byte> bytes;
        if (!read(std::min<std::uint64_t>(left_, bag_magic.size()), bytes) || !starts_with(bytes, any))
            throw std::runtime_error("'" + name_ + "' is no bag: it does not start with '" +
                                     std::string(any) + "2.0'");
        if (!starts_with(bytes, bag_magic))
            throw std::runtime_error("'" + name_ + "' is a bag of another version than 2.0, which rosbag " +
                                     "migrates: run 'rosbag fix'");
        std::vector<std::byte> header;
        while (left_ > 0) {
            const std::uint64_t at = size_ - left_;
            if (!part(header) || !part(bytes))
                return visit_.defect("the file ends within the record that begins at byte " +
                                     std::to_string(at) + ": the bag was cut; 'rosbag reindex' mends it");
            try {
                record(Fields(header), bytes);
            } catch (const Malformed& error) {
                visit_.defect(std::string(error.what()) + ", at byte " + std::to_string(at));
            }
        }
        if (!has_header_) visit_.defect("the bag has no header");
    }

  private:
    static bool starts_with(Bytes bytes, std::string_view text) {
        return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
    }
    bool read(std::uint64_t count, std::vector<std::byte>& to) {
        if (options_.given_up && *options_.given_up)
            throw std::runtime_error("nobody waits for '" + name_ + "' any more");
        if (count > left_) return false;
        to.resize(count);
        stream_.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(count));
        if (static_cast<std::uint64_t>(stream_.gcount()) != count) return false;
        left_ -= count;
        return true;
    }
    /// Bytes behind their number.
    bool part(std::vector<std::byte>& to) {
        if (!read(sizeof(std::uint32_t), to)) return false;
        return read(Cursor(to).get<std::uint32_t>(), to);
    }

    void record(const Fields& header, Bytes data) {
        switch (header.get<Op>("op")) {
        case Op::header:
            has_header_ = true;
            if (const auto by = header.text("encryptor"); !by.empty())
                throw std::runtime_error("'" + name_ + "' is encrypted (" + by +
                                         "), which is not read: run 'rosbag decrypt'");
            if (header.get<std::uint64_t>("index_pos") == 0)
                visit_.defect("the bag was not closed: run 'rosbag reindex'");
            break;
        case Op::chunk: chunk(header, data); break;
        case Op::connection: connection(header, data); break;
        case Op::message: message(header, data); break;
        case Op::index:
        case Op::chunk_info: break; // they repeat what is known
        }
    }

    void chunk(const Fields& header, Bytes data) {
        const std::string method = header.text("compression");
        const auto size = header.get<std::uint32_t>("size");
        std::vector<std::byte> whole;
        if (method != "none") {
            if (size > options_.most_bytes - unpacked_)
                throw Malformed("its chunks have too many bytes when they are decompressed; what follows is "
                                "left out");
            unpacked_ += size;
            data = whole = decompressed(method, data, size);
        } else if (data.size() != size) {
            throw Malformed("a chunk has " + std::to_string(data.size()) + " bytes, but says it has " +
                            std::to_string(size));
        }
        for (Cursor cursor(data); !cursor.rest().empty();) {
            const Bytes its_header = cursor.take(cursor.get<std::uint32_t>());
            const Bytes its_data = cursor.take(cursor.get<std::uint32_t>());
            const Fields its(its_header);
            const auto op = its.get<Op>("op");
            if (op == Op::connection) connection(its, its_data);
            if (op == Op::message) message(its, its_data);
        }
    }

    void connection(const Fields& header, Bytes data) {
        const auto number = header.get<std::uint32_t>("conn");
        if (known_.contains(number)) return; // it is told once more at the end
        const Fields its(data);
        std::string topic = header.text("topic"); // as it is recorded, of which the sender may have another
        if (topic.empty()) topic = its.text("topic");
        visit_.connection(
            number, {std::move(topic), its.text("type"), its.text("md5sum"), its.text("message_definition")});
        known_.insert(number);
    }

    void message(const Fields& header, Bytes data) {
        const auto number = header.get<std::uint32_t>("conn");
        if (!known_.contains(number))
            throw Malformed("a message is of the connection " + std::to_string(number) +
                            ", which the bag does not tell");
        const auto time = header.get<std::uint64_t>("time"); // s in the lower half, ns in the upper one
        visit_.message(number,
                       static_cast<std::int64_t>(time & 0xffff'ffff) * 1'000'000'000 +
                           static_cast<std::int64_t>(time >> 32),
                       data);
    }

    std::istream& stream_;
    const std::string name_;
    const BagVisit& visit_;
    const LoadOptions options_;
    std::uint64_t size_ = 0, left_ = 0, unpacked_ = 0; ///< bytes
    bool has_header_ = false;
    std::set<std::uint32_t> known_; ///< connections
};

} // namespace

void read_bag(std::istream& stream, std::string_view name, const BagVisit& visit,
              const LoadOptions& options) {
    BagParser(stream, name, visit, options).parse();
}

} // namespace bf::recording
