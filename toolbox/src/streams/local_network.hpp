#pragma once

#include "bf/toolbox/streams.hpp"

#include <string>

namespace bf::toolbox {

/// Streams among the programs of one user on one computer, through shared memory. Networks of different
/// domains do not see each other. Its time is that of the system.
class LocalNetwork final : public StreamNetwork {
  public:
    explicit LocalNetwork(const std::string& domain);
    std::shared_ptr<StreamConnection> open() const override;

  private:
    std::string folder_, domain_;
};

} // namespace bf::toolbox
