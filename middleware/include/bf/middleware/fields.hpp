// Messages of any type, and their numbers as ports of blocks.
#pragma once

#include "bf/core/block.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::middleware {

/// What a port or an argument gives to a message, or takes from it. A middleware says how messages lie in
/// memory.
class Field {
  public:
    enum class Kind {
        numbers,  ///< one, or as many as the type says
        sequence, ///< any number of numbers, or up to `size`
        time,     ///< a moment or a duration, as s
        text,
        texts, ///< any number of them
    };
    Field(std::string its_path, Kind its_kind, int its_size, bool is_one)
        : path(std::move(its_path)), kind(its_kind), size(its_size), is_scalar(is_one) {}
    virtual ~Field() = default;

    std::string path; ///< such as header.stamp
    Kind kind;
    int size; ///< of numbers; of a sequence the largest, 0: none is said
    bool is_scalar;

    /// The path as a name of a port.
    std::string port() const;
    /// How many numbers the message has.
    virtual std::size_t length(const void* message) const = 0;
    /// Those that are there, up to `count`.
    virtual void read(const void* message, double* values, std::size_t count) const = 0;
    /// Numbers that the type cannot hold become the nearest one that it can. Throws std::bad_alloc.
    virtual void write(void* message, const double* values, std::size_t count) const = 0;
    virtual std::string text(const void* message) const = 0;
    virtual void write(void* message, const std::vector<std::string>& texts) const = 0;
};

/// `value` as the next number that T holds; NaN becomes 0 where T holds none.
template <class T> T nearest(double value) {
    if constexpr (std::is_floating_point_v<T>) {
        return static_cast<T>(value);
    } else if constexpr (std::is_same_v<T, bool>) {
        return value != 0;
    } else {
        using Its = std::numeric_limits<T>;
        if (std::isnan(value)) return 0;
        const double whole = std::round(value);
        if (whole <= static_cast<double>(Its::min())) return Its::min();
        // The largest 64-bit integers are no doubles.
        if (whole >= static_cast<double>(Its::max())) return Its::max();
        return static_cast<T>(whole);
    }
}

/// Seconds as whole ones and nanoseconds in [0, 1e9).
template <class Whole> std::pair<Whole, std::uint32_t> split_time(double seconds) {
    const double whole = std::floor(seconds), rest = std::round((seconds - whole) * 1e9);
    return {nearest<Whole>(whole + (rest >= 1e9 ? 1 : 0)), nearest<std::uint32_t>(rest >= 1e9 ? 0 : rest)};
}

/// A type of message.
class MessageType {
  public:
    virtual ~MessageType() = default;
    const std::string& name() const { return name_; }
    /// All but lists of messages: numbers and times alone are a vector where they are the numbers of one
    /// point, quaternion or the like.
    const std::vector<std::unique_ptr<const Field>>& fields() const { return fields_; }
    /// Null: there is none of that path.
    const Field* field(const std::string& path) const;
    /// A new message, with the type's defaults.
    virtual std::shared_ptr<void> make() const = 0;

  protected:
    std::string name_;
    std::vector<std::unique_ptr<const Field>> fields_;
};

/// A field, and where its numbers are among all of a message.
struct Place {
    const Field* field;
    int first, size;
};

/// A name of anything as those of ROS and of ports may be.
std::string plain(const std::string& name);

bool is_number(const Field& field);
/// Of those fields whose paths begin so.
std::vector<std::string> paths(const MessageType& type, bool are_numbers, const std::string& prefix = "");

/// Those of these paths, or all that are numbers where none is named, of those that begin with the prefix.
/// `problems` gets what is wrong with the `argument` that names them.
std::vector<const Field*> fields_of(const MessageType& type, const std::vector<std::string>& names,
                                    const char* argument, std::vector<std::string>& problems,
                                    const std::string& prefix = "");

/// Texts of a message by their fields, each given as field=text or, where there are several, field=a,b.
/// `problems` gets what is wrong.
std::vector<std::pair<const Field*, std::vector<std::string>>> texts_of(const MessageType& type,
                                                                        const std::vector<std::string>& given,
                                                                        std::vector<std::string>& problems);

/// Inputs, of which a step copies the numbers for a message.
class FieldInputs {
  public:
    /// Declares them.
    void add(Block& block, const MessageType& type, const std::vector<const Field*>& fields);
    /// Those that are wired, the first at `first`; the others stay what messages begin with. Throws
    /// std::runtime_error: more elements than a field has room for.
    std::vector<Place> places(Now at, int first) const;
    /// How many numbers those have that are wired.
    int size(Now at) const;
    /// Of those, one behind the other.
    void copy(Now at, double* to) const noexcept;

  private:
    struct Port {
        const Field* field;
        std::function<const double*(Now)> data;
        std::function<int(Now)> size; ///< empty: one
        std::function<bool(Now)> is_wired;
        int count(Now at) const { return size ? size(at) : 1; }
    };
    std::string type_;
    std::vector<Port> ports_;
};

/// The text of a Status that is no literal: for as long as the Status.
struct StatusText {
    explicit StatusText(const std::string& text);
    char letters[400];
};

/// Outputs, with the numbers that messages bring; behind those of a field of any number of elements one that
/// tells how many came.
class FieldOutputs {
  public:
    /// Declares them. Fields of any number of elements have at most that which `sizes` say, each as
    /// field=size; without it they are no ports, which is a problem where `are_named`.
    void add(Block& block, const MessageType& type, const std::vector<const Field*>& fields, bool are_named,
             const std::vector<std::string>& sizes, std::vector<std::string>& problems);
    const std::vector<Place>& places() const { return places_; }
    int size() const { return size_; } ///< numbers of a message
    void copy(const double* from, Out out) const noexcept;
    /// That a message has `count` elements for that place.
    Status too_long(int place, int count) const noexcept;

  private:
    struct Port {
        int size;
        std::function<double*(Out)> data;
    };
    std::vector<Place> places_;
    std::vector<Port> ports_;
    std::vector<StatusText> too_long_; ///< what is said of each place
    int size_ = 0;
};

/// Copies the numbers of a message, zeros where there are none. Gives the number of the place that has more
/// elements than it should, with how many; -1: there is none.
int read(const void* message, const std::vector<Place>& places, std::vector<double>& values, int& count);

} // namespace bf::middleware
