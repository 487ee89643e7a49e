// What the names of a linear system's inputs, outputs and cuts stand for.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <string>
#include <vector>

namespace bf::analysis {

/// Elements of a signal or state that are inputs, outputs or states of the linear system.
struct Channel {
    Node::End end;
    std::vector<int> elements;
    std::string name = {}; ///< as the signal was asked for
};
/// All elements.
Channel whole(const Diagram& d, const Node::End& end);
std::string name(const Diagram& d, const Channel& channel, int element);

class ChannelFinder {
  public:
    explicit ChannelFinder(const Diagram& diagram) : d_(diagram), signals_(diagram) {}

    /// Throws RunError for what is none, and no real number.
    std::vector<Channel> find(const std::vector<std::string>& names) const;
    /// Ports of the root that are real numbers. Throws RunError where there are none, with the option that
    /// names others.
    std::vector<Channel> of_root(const std::vector<SignalName>& ports, const std::string& what,
                                 const std::string& option) const;

  private:
    Channel find(const std::string& name) const;

    const Diagram& d_;
    const SignalFinder signals_;
};

} // namespace bf::analysis
