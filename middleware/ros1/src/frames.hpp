// Messages of tf.
#pragma once

#include "bf/middleware/frame_buffer.hpp"
#include "types.hpp"

#include <memory>
#include <vector>

namespace bf::ros1 {

/// tf2_msgs/TFMessage, whose package need not be installed.
std::shared_ptr<const MessageType> transforms_type();

/// What such a message has that came.
std::vector<middleware::FrameMessage> frames_of(const Message& message, bool is_static);

} // namespace bf::ros1
