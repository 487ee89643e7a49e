// Messages of a WebSocket up to a limit, which those who send longer ones are told.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <string>
#include <utility>

namespace bf::realtime {

/// Reads a message of at most `most` bytes into the buffer and calls `then(error)`; of a longer one the error
/// is boost::beast::websocket::error::message_too_big, and the connection is still open. The stream needs
/// `read_message_max(0)`: with a limit of its own it would close without a reason.
template <class Stream, class Then>
void read_limited(Stream& stream, boost::beast::flat_buffer& buffer, std::size_t most, Then then) {
    stream.async_read_some(buffer, most + 1 - buffer.size(),
                           [&stream, &buffer, most, then = std::move(then)](boost::beast::error_code error,
                                                                            std::size_t) mutable {
                               if (!error && buffer.size() > most)
                                   error = boost::beast::websocket::error::message_too_big;
                               if (error || stream.is_message_done()) return then(error);
                               read_limited(stream, buffer, most, std::move(then));
                           });
}

/// What a client is told whose message is longer than `most` bytes.
inline boost::beast::websocket::close_reason too_long(std::size_t most) {
    return {boost::beast::websocket::close_code::too_big,
            "a message has at most " + std::to_string(most) + " bytes"};
}

} // namespace bf::realtime
