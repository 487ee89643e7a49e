// Numbers of messages as ports of blocks.
#pragma once

#include "bf/core/block.hpp"
#include "types.hpp"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace bf::ros2 {

/// What a block has opened in a run. It is not part of snapshots.
template <class End> struct Opened { std::shared_ptr<End> end; };

/// A field, and where its numbers are among all of a message.
struct Place {
    const Field* field;
    int first, size;
};

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
    /// The text of a Status, as long as the block.
    struct Text {
        explicit Text(const std::string& text);
        char letters[400];
    };
    std::vector<Place> places_;
    std::vector<Port> ports_;
    std::vector<Text> too_long_; ///< what is said of each place
    int size_ = 0;
};

/// Copies the numbers of a message, zeros where there are none. Gives the number of the place that has more
/// elements than it should, with how many; -1: there is none.
int read(const void* message, const std::vector<Place>& places, std::vector<double>& values, int& count);

} // namespace bf::ros2
