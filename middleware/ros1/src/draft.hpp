// Messages that are written field by field.
#pragma once

#include "raw.hpp"
#include "types.hpp"

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bf::ros1 {

/// A message whose fields are set by their paths, which its type has. What is not set is zero or empty.
class Draft {
  public:
    /// Throws std::runtime_error: there is no such type.
    explicit Draft(const std::string& type)
        : type_(MessageType::find(type)), message_(std::static_pointer_cast<Message>(type_->make())) {}

    const std::shared_ptr<const MessageType>& type() const { return type_; }
    void set(const char* path, std::span<const double> values) {
        type_->field(path)->write(message_.get(), values.data(), values.size());
    }
    void set(const char* path, double value) { set(path, std::span(&value, 1)); }
    void set(const char* path, const std::vector<std::string>& texts) {
        type_->field(path)->write(message_.get(), texts);
    }
    /// Behind what there is.
    void append_to(std::vector<std::uint8_t>& bytes) const { type_->encode(*message_, bytes); }
    /// As it goes out; it stays until the next call.
    const Raw& raw() {
        raw_.bytes.clear();
        append_to(raw_.bytes);
        return raw_;
    }

  private:
    std::shared_ptr<const MessageType> type_;
    std::shared_ptr<Message> message_;
    Raw raw_;
};

} // namespace bf::ros1
