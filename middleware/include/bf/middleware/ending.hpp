// How a program ends whose middleware does not answer any more.
#pragma once

#include <functional>

namespace bf::middleware {

/// Has the program end without the destructors of its globals, which a call that never came back still uses.
void keep_globals() noexcept;

/// Calls `end` in a thread of its own, as a call of a middleware may never come back. False: it has not
/// within `patience` s. The thread then keeps what `end` holds, and the program its globals.
bool end_within(double patience, std::function<void()> end);

} // namespace bf::middleware
