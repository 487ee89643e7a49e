#include "disk.hpp"

#include "bf/base/files.hpp"

#include <cstdint>
#include <utility>

namespace bf::service {

Stamp Disk::stamp(const std::filesystem::path& file) const {
    if (texts_) return {.size = 0, .is_certain = true};
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return {.is_certain = true};
    constexpr std::int64_t step = 20'000'000; // ns
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    const std::int64_t age = (now.tv_sec - status.st_ctim.tv_sec) * std::int64_t{1'000'000'000} +
                             now.tv_nsec - status.st_ctim.tv_nsec;
    return {status.st_ctim, status.st_ino, status.st_size, age > step};
}

void Disk::clean(const std::filesystem::path& file) const {
    if (!texts_) remove_abandoned(file);
}

std::string Disk::read(const std::filesystem::path& file) const {
    if (!texts_) return read_text_file(file);
    const auto found = texts_->find(file);
    if (found == texts_->end()) throw FileError("the recording has no file '" + file.string() + "'");
    return found->second;
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
        if (texts_) {
            (*texts_)[wanted.file] = wanted.text;
        } else {
            OutputFile output(wanted.file);
            output.write(wanted.text);
            wanted.is_foreign = !output.commit_over(wanted.before);
        }
    } catch (const FileError& error) {
        wanted.failure = error.what();
    }
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
