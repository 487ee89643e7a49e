#pragma once

#include "bf/matlab/value.hpp"

#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace bf::matlab {

/// Named values in the order they were first set. Names that are missing are looked up in the enclosing
/// workspace, which must outlive this one and is never changed through it (a mask within a model).
class Workspace {
  public:
    using Entry = std::pair<std::string, Value>;

    explicit Workspace(const Workspace* enclosing = nullptr) : enclosing_(enclosing) {}

    const Value* find(std::string_view name) const; ///< null when neither this nor an enclosing one has it
    const Value& at(std::string_view name) const;   ///< throws Error with the nearest name
    bool contains(std::string_view name) const { return find(name) != nullptr; }
    void set(std::string_view name, Value value);
    Value take(std::string_view name); ///< moves a variable out, leaving `[]`; an enclosing one is copied
    std::vector<std::string_view> names() const; ///< of this and then the enclosing ones

    std::size_t size() const { return entries_.size(); }
    auto begin() const { return entries_.begin(); }
    auto end() const { return entries_.end(); }

  private:
    struct Hash {
        using is_transparent = void;
        std::size_t operator()(std::string_view name) const { return std::hash<std::string_view>()(name); }
    };

    const Workspace* enclosing_;
    std::vector<Entry> entries_;
    std::unordered_map<std::string, std::size_t, Hash, std::equal_to<>> places_;
};

} // namespace bf::matlab
