// Files of the model, written beside the thread of the service.
#pragma once

#include "bf/service/worker.hpp"

#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <sys/stat.h>
#include <vector>

namespace bf::service {

/// What tells that a file was written, without reading it.
struct Stamp {
    timespec changed{};
    ::ino_t inode = 0;
    ::off_t size = -1;
    bool is_certain = false; ///< may it be compared? Clocks of file systems take steps of some milliseconds

    bool operator==(const Stamp& other) const {
        return is_certain && other.is_certain && changed.tv_sec == other.changed.tv_sec &&
               changed.tv_nsec == other.changed.tv_nsec && inode == other.inode && size == other.size;
    }
};

/// Puts texts into files, each of which is on the disk before it is said to be written.
class Disk {
  public:
    using Texts = std::map<std::filesystem::path, std::string>;

    /// A text for a file, and what became of it.
    struct Written {
        std::filesystem::path file;
        std::string text;
        std::optional<std::string> before; ///< what the file holds; nothing: there is none
        bool is_foreign = false;           ///< it holds what another program wrote, and stays as it is
        std::string failure = {};
    };

    /// Without a worker files are written at once. `done` is called by the worker, after each of them. With
    /// `texts` these are all the files there are, and none is read or written.
    Disk(Worker* worker, std::function<void()> done, std::optional<Texts> texts)
        : worker_(texts ? nullptr : worker), done_(std::move(done)), texts_(std::move(texts)) {}

    /// Removes what programs that were killed left beside the file.
    void clean(const std::filesystem::path& file) const;
    Texts texts() const { return texts_.value_or(Texts()); }
    Stamp stamp(const std::filesystem::path& file) const;
    /// Throws FileError.
    std::string read(const std::filesystem::path& file) const;

    void write(Written wanted);
    /// What is done since this was asked last.
    std::vector<Written> take();
    /// Until all is done.
    void wait();

  private:
    void finish(Written wanted);

    Worker* const worker_;
    const std::function<void()> done_;
    std::optional<Texts> texts_;
    std::mutex mutex_; ///< of the list
    std::vector<Written> written_;
};

} // namespace bf::service
