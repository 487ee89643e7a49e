// Messages as roscpp carries them for us.
#pragma once

#include <algorithm>
#include <cstdint>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <vector>

namespace bf::ros1 {

/// A message as roscpp carries it, whose type it leaves to us.
struct Raw {
    std::vector<std::uint8_t> bytes;
};

} // namespace bf::ros1

namespace ros {
namespace message_traits {
template <> struct MD5Sum<bf::ros1::Raw> {
    static const char* value() { return "*"; }
    static const char* value(const bf::ros1::Raw&) { return "*"; }
};
template <> struct DataType<bf::ros1::Raw> {
    static const char* value() { return "*"; }
    static const char* value(const bf::ros1::Raw&) { return "*"; }
};
template <> struct Definition<bf::ros1::Raw> {
    static const char* value() { return ""; }
    static const char* value(const bf::ros1::Raw&) { return ""; }
};
} // namespace message_traits
namespace serialization {
template <> struct Serializer<bf::ros1::Raw> {
    template <class Stream> static void read(Stream& stream, bf::ros1::Raw& raw) {
        raw.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
    }
    template <class Stream> static void write(Stream& stream, const bf::ros1::Raw& raw) {
        std::copy(raw.bytes.begin(), raw.bytes.end(), stream.advance(raw.bytes.size()));
    }
    static std::uint32_t serializedLength(const bf::ros1::Raw& raw) {
        return static_cast<std::uint32_t>(raw.bytes.size());
    }
};
} // namespace serialization
} // namespace ros
