// Messages of Protocol Buffers (https://protobuf.dev/programming-guides/encoding/), by the descriptors that a
// recording has of them (google/protobuf/descriptor.proto, whose field numbers stand here).
#include "foreign.hpp"

#include <algorithm>
#include <protozero/pbf_reader.hpp>
#include <unordered_map>

namespace bf::recording {
namespace {

using protozero::data_view;
using protozero::pbf_reader;
using protozero::pbf_wire_type;

/// FieldDescriptorProto.Type
enum class Kind {
    float64 = 1,
    float32,
    int64,
    uint64,
    int32,
    fixed64,
    fixed32,
    boolean,
    text,
    group,
    message,
    bytes,
    uint32,
    enumeration,
    sfixed32,
    sfixed64,
    sint32,
    sint64
};

struct Field {
    std::string name;
    std::uint32_t number = 0;
    Kind kind = Kind::text;
    bool is_repeated = false;
    bool is_always = false; ///< 0 where the message does not have it
    std::string type_name = {};
    std::size_t type = 0; ///< of a message, its number

    bool is_number() const {
        return kind != Kind::text && kind != Kind::bytes && kind != Kind::group && kind != Kind::message;
    }
};

struct Type {
    std::string name; ///< ".foxglove.Pose"
    std::vector<Field> fields;
};

pbf_wire_type wire_type_of(Kind kind) {
    switch (kind) {
    case Kind::float64:
    case Kind::fixed64:
    case Kind::sfixed64: return pbf_wire_type::fixed64;
    case Kind::float32:
    case Kind::fixed32:
    case Kind::sfixed32: return pbf_wire_type::fixed32;
    case Kind::text:
    case Kind::bytes:
    case Kind::message: return pbf_wire_type::length_delimited;
    case Kind::group: return pbf_wire_type::unknown; // is skipped
    default: return pbf_wire_type::varint;
    }
}

/// Of a value of that wire type, which the reader stands at.
double read_number(pbf_reader& reader, Kind kind) {
    switch (kind) {
    case Kind::float64: return reader.get_double();
    case Kind::float32: return reader.get_float();
    case Kind::int64: return static_cast<double>(reader.get_int64());
    case Kind::uint64: return static_cast<double>(reader.get_uint64());
    case Kind::int32: return reader.get_int32();
    case Kind::fixed64: return static_cast<double>(reader.get_fixed64());
    case Kind::fixed32: return reader.get_fixed32();
    case Kind::boolean: return reader.get_bool() ? 1 : 0;
    case Kind::uint32: return reader.get_uint32();
    case Kind::enumeration: return reader.get_enum();
    case Kind::sfixed32: return reader.get_sfixed32();
    case Kind::sfixed64: return static_cast<double>(reader.get_sfixed64());
    case Kind::sint32: return reader.get_sint32();
    case Kind::sint64: return static_cast<double>(reader.get_sint64());
    default: return 0;
    }
}

class ProtobufDecoder final : public Decoder {
  public:
    ProtobufDecoder(std::string_view name, std::string_view schema) {
        try {
            pbf_reader files(schema.data(), schema.size());
            while (files.next(1, pbf_wire_type::length_delimited)) add_file(files.get_message());
        } catch (const protozero::exception& error) {
            throw Malformed(std::string("the schema is no FileDescriptorSet: ") + error.what());
        }
        for (Type& type : types_)
            for (Field& field : type.fields) {
                if (field.kind != Kind::message) continue;
                const auto found = numbers_.find(field.type_name);
                if (found == numbers_.end())
                    throw Malformed("the schema does not say what '" + field.type_name + "' is");
                field.type = found->second;
            }
        const auto root = numbers_.find("." + std::string(name));
        if (root == numbers_.end())
            throw Malformed("the schema does not say what '" + std::string(name) + "' is");
        root_ = root->second;
    }

    void decode(Bytes message, const Visit& visit) const override {
        std::size_t entered = 0;
        try {
            read(data_view(reinterpret_cast<const char*>(message.data()), message.size()), root_, "", 0,
                 entered, visit);
        } catch (const protozero::exception& error) {
            throw Malformed(std::string("is no message of Protocol Buffers: ") + error.what());
        }
    }

  private:
    void add_file(pbf_reader file) {
        std::string package;
        bool is_proto3 = false;
        std::vector<data_view> messages;
        while (file.next()) {
            if (file.wire_type() != pbf_wire_type::length_delimited)
                file.skip();
            else if (file.tag() == 2)
                package = file.get_string();
            else if (file.tag() == 4)
                messages.push_back(file.get_view());
            else if (file.tag() == 12)
                is_proto3 = file.get_string() == "proto3";
            else
                file.skip();
        }
        for (const data_view& message : messages)
            add_type(message, package.empty() ? "" : "." + package, is_proto3, 0);
    }

    void add_type(data_view descriptor, const std::string& around, bool is_proto3, int depth) {
        if (depth > deepest) throw Malformed("the types of the schema are nested too deeply");
        Type type;
        std::vector<data_view> nested;
        pbf_reader reader(descriptor);
        while (reader.next()) {
            if (reader.wire_type() != pbf_wire_type::length_delimited)
                reader.skip();
            else if (reader.tag() == 1)
                type.name = around + "." + reader.get_string();
            else if (reader.tag() == 2)
                type.fields.push_back(field_of(reader.get_message(), is_proto3));
            else if (reader.tag() == 3)
                nested.push_back(reader.get_view());
            else
                reader.skip();
        }
        const std::string name = type.name;
        if (numbers_.emplace(name, types_.size()).second) types_.push_back(std::move(type));
        for (const data_view& inner : nested) add_type(inner, name, is_proto3, depth + 1);
    }

    static Field field_of(pbf_reader descriptor, bool is_proto3) {
        Field field;
        bool is_optional = false, is_choice = false; // proto3_optional, in a oneof
        while (descriptor.next()) {
            const auto tag = descriptor.tag();
            const bool is_text = descriptor.wire_type() == pbf_wire_type::length_delimited;
            if (is_text && tag == 1)
                field.name = descriptor.get_string();
            else if (is_text && tag == 6)
                field.type_name = descriptor.get_string();
            else if (descriptor.wire_type() != pbf_wire_type::varint)
                descriptor.skip();
            else if (tag == 3)
                field.number = descriptor.get_uint32();
            else if (tag == 4)
                field.is_repeated = descriptor.get_enum() == 3;
            else if (tag == 5)
                field.kind = static_cast<Kind>(descriptor.get_enum());
            else if (tag == 9)
                is_choice = descriptor.get_int32() >= 0;
            else if (tag == 17)
                is_optional = descriptor.get_bool();
            else
                descriptor.skip();
        }
        if (field.kind < Kind::float64 || field.kind > Kind::sint64)
            throw Malformed("the schema has a field '" + field.name + "' of a type that is not known");
        field.is_always = is_proto3 && !field.is_repeated && !is_optional && !is_choice && field.is_number();
        return field;
    }

    /// What a message has of one field, in whatever order it comes.
    struct Found {
        std::vector<double> numbers;
        std::vector<data_view> messages;
    };

    void read(data_view message, std::size_t number, const std::string& path, int depth, std::size_t& entered,
              const Visit& visit) const {
        if (depth > deepest) throw Malformed("is nested too deeply");
        if (++entered > most_elements) throw Malformed("has more messages in it than can be looked at");
        const auto& fields = types_[number].fields;
        std::vector<Found> found(fields.size());
        pbf_reader reader(message);
        while (reader.next()) {
            const auto field = std::ranges::find(fields, reader.tag(), &Field::number);
            if (field == fields.end())
                reader.skip();
            else
                take(reader, *field, found[static_cast<std::size_t>(field - fields.begin())]);
        }
        for (std::size_t i = 0; i < fields.size(); ++i)
            give(fields[i], found[i], path.empty() ? fields[i].name : path + "." + fields[i].name, depth,
                 entered, visit);
    }

    static void take(pbf_reader& reader, const Field& field, Found& found) {
        const pbf_wire_type expected = wire_type_of(field.kind);
        if (field.is_number() && reader.wire_type() == expected) {
            found.numbers.push_back(read_number(reader, field.kind));
        } else if (field.is_number() && reader.wire_type() == pbf_wire_type::length_delimited) {
            take_packed(reader, field, found); // whether or not it is declared so
        } else if (field.kind == Kind::message && reader.wire_type() == expected) {
            found.messages.push_back(reader.get_view());
        } else {
            reader.skip();
        }
        if (found.numbers.size() > most_elements) throw Malformed("has an array that is too long");
    }

    /// Numbers one after the other.
    static void take_packed(pbf_reader& reader, const Field& field, Found& found) {
        const auto all = [&](auto range) {
            for (const auto value : range) {
                if (found.numbers.size() == most_elements) throw Malformed("has an array that is too long");
                found.numbers.push_back(static_cast<double>(value));
            }
        };
        switch (field.kind) {
        case Kind::float64: return all(reader.get_packed_double());
        case Kind::float32: return all(reader.get_packed_float());
        case Kind::int64: return all(reader.get_packed_int64());
        case Kind::uint64: return all(reader.get_packed_uint64());
        case Kind::int32: return all(reader.get_packed_int32());
        case Kind::fixed64: return all(reader.get_packed_fixed64());
        case Kind::fixed32: return all(reader.get_packed_fixed32());
        case Kind::boolean: return all(reader.get_packed_bool());
        case Kind::uint32: return all(reader.get_packed_uint32());
        case Kind::enumeration: return all(reader.get_packed_enum());
        case Kind::sfixed32: return all(reader.get_packed_sfixed32());
        case Kind::sfixed64: return all(reader.get_packed_sfixed64());
        case Kind::sint32: return all(reader.get_packed_sint32());
        case Kind::sint64: return all(reader.get_packed_sint64());
        default: return;
        }
    }

    void give(const Field& field, const Found& found, const std::string& path, int depth,
              std::size_t& entered, const Visit& visit) const {
        static const double absent = 0;
        if (field.is_number() && field.is_repeated && !found.numbers.empty())
            visit(path, found.numbers);
        else if (field.is_number() && !field.is_repeated && !found.numbers.empty())
            visit(path, {&found.numbers.back(), 1}); // the last one counts
        else if (field.is_always)
            visit(path, {&absent, 1});
        if (found.messages.empty()) return;
        if (!field.is_repeated) { // parts of one message join, as what is encoded does
            std::string whole;
            for (const data_view& part : found.messages) whole.append(part.data(), part.size());
            return read(whole, field.type, path, depth + 1, entered, visit);
        }
        for (std::size_t i = 0; i < std::min(found.messages.size(), most_parts); ++i)
            read(found.messages[i], field.type, path + "[" + std::to_string(i + 1) + "]", depth + 1, entered,
                 visit);
    }

    std::vector<Type> types_;
    std::unordered_map<std::string, std::size_t> numbers_; ///< of types, by name
    std::size_t root_ = 0;
};

} // namespace

std::unique_ptr<Decoder> make_protobuf_decoder(std::string_view name, std::string_view schema) {
    return std::make_unique<ProtobufDecoder>(name, schema);
}

} // namespace bf::recording
