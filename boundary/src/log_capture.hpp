#pragma once

#include <string>

namespace bf::boundary {

/// While it lives, the messages that its thread logs belong to it and nobody else reads them. Captures nest.
class LogCapture {
  public:
    LogCapture() noexcept;
    ~LogCapture();
    LogCapture(const LogCapture&) = delete;
    LogCapture& operator=(const LogCapture&) = delete;

    bool is_used() const { return used_; }
    /// Errors, then warnings, one per line; empties the capture.
    std::string take();

  private:
    friend struct LogAccess;
    LogCapture* outer_;
    bool used_ = false;
};

} // namespace bf::boundary
