// Work shared among processes.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace bf {

/// Does `work(i)` for i = 0 ... count - 1 in `jobs` processes forked from this one and tells every answer to
/// `done`, in the order in which they come. A process that dies gives an empty answer with the reason in
/// `death`, and another takes its place. While it waits it asks `go_on` a few times a second; on false it
/// ends the processes and returns. The program must have one thread, since a fork copies no other.
void share(std::size_t count, int jobs, const std::function<std::string(std::size_t)>& work,
           const std::function<void(std::size_t, const std::string& answer, const std::string& death)>& done,
           const std::function<bool()>& go_on);

} // namespace bf
