// What the blocks of ROS 1 talk through: a node, or a bag that stands for one.
#pragma once

#include "bf/core/registry.hpp"
#include "bf/middleware/calls.hpp"
#include "bf/middleware/frame_listener.hpp"
#include "bf/middleware/topics.hpp"
#include "bf/middleware/transforms.hpp"
#include "types.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::ros1 {

/// A topic as a block names it.
struct TopicOptions {
    std::string name;
    std::shared_ptr<const MessageType> type;
    int depth = 10;       ///< messages that are kept on their way
    bool is_kept = false; ///< the last message is for those, too, who come later
};

class Connection {
  public:
    virtual ~Connection() = default;
    /// Joins the network or reads the file; nothing where that is done. Throws std::runtime_error.
    virtual void open() = 0;
    virtual void close() noexcept = 0;
    /// Gives the end what it sends with.
    virtual void publish(const TopicOptions& topic, const std::shared_ptr<middleware::Outgoing>& end) = 0;
    /// The same for transforms of children in a frame.
    virtual void publish(const TopicOptions& topic, const std::string& frame,
                         const std::vector<std::string>& children,
                         const std::shared_ptr<middleware::OutgoingTransforms>& end) = 0;
    virtual std::shared_ptr<middleware::Incoming> subscribe(const TopicOptions& topic,
                                                            middleware::Wanted wanted) = 0;
    /// Gives it what it calls with, in a thread that ends with what is returned.
    virtual std::shared_ptr<void> call(const std::string& service, const ServiceType& type,
                                       const std::shared_ptr<middleware::Calling>& end) = 0;
    /// Follows what the topics of tf tell of a transform.
    virtual std::shared_ptr<middleware::TransformView> watch(const std::string& target,
                                                             const std::string& source) = 0;
    /// Are messages the same whenever a run goes on from a snapshot?
    virtual bool can_save() const = 0;
    int state_size() const { return 0; }
    void save(double*) const {}
    void restore(const double*) {}
};

/// Resource of the blocks that talk.
struct RosConnection {
    static constexpr const char* resource = "ROS 1 node";
    using Live = Connection;
    std::function<std::shared_ptr<Live>()> open; ///< opens nothing yet
};

void add_node(Library& library);
void add_bag(Library& library);
void add_topics(Library& library);
void add_calls(Library& library);
void add_transforms(Library& library);
void add_frames(Library& library);
void add_robot(Library& library);

} // namespace bf::ros1
