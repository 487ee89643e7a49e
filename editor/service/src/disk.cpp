#include "disk.hpp"

#include "bf/base/files.hpp"

#include <utility>

namespace bf::service {

Stamp stamp_of(const std::filesystem::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return {};
    return {status.st_ctim, status.st_ino, status.st_size};
}

void Disk::write(Written wanted) {
    if (!worker_) return finish(std::move(wanted));
    worker_->post([this, wanted = std::move(wanted)] {
        finish(wanted);
        done_();
    });
}

void Disk::finish(Written wanted) {
    try {
        wanted.is_foreign = !(stamp_of(wanted.file) == wanted.stamp);
        if (!wanted.is_foreign) {
            OutputFile output(wanted.file);
            output.write(wanted.text);
            output.commit();
        }
    } catch (const FileError& error) {
        wanted.failure = error.what();
    }
    if (!wanted.is_foreign) wanted.stamp = stamp_of(wanted.file);
    const std::lock_guard lock(mutex_);
    written_.push_back(std::move(wanted));
}

std::vector<Disk::Written> Disk::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(written_, {});
}

void Disk::wait() {
    if (worker_) worker_->call([] {});
}

} // namespace bf::service
